import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mros1_reasoner.loop.diagnostics import DiagnosticsReader, newest_goal
from mros1_reasoner.loop.entries import BindingFact, ComponentFact, LevelFact, StaleFact, TaskFact

QUALITIES = ("safety", "energy")
COMPONENTS = ("laser", "laser_resender", "front_laser")


def status(message, *values, level=0, name="", hardware_id=""):
    pairs = [SimpleNamespace(key=key, value=value) for key, value in values]
    return SimpleNamespace(message=message, values=pairs, level=level, name=name, hardware_id=hardware_id)


def read(*statuses, nodes=None):
    return DiagnosticsReader(QUALITIES, COMPONENTS, nodes).read(statuses)


def facts(*statuses, nodes=None):
    reading = read(*statuses, nodes=nodes)
    assert not reading.remarks
    return list(reading.facts)


def test_level_with_the_grounding_that_it_names():
    (fact,) = facts(status("QA status", ("safety", "0.250"), name="fg_x"))
    assert fact == LevelFact("safety", 0.25, "fg_x")
    assert fact.text == "0.250"


def test_stale_quality():
    (fact,) = facts(status("QA stale", ("safety", "no scan"), level=3))
    assert fact == StaleFact("safety")
    assert fact.reason == "no scan"


def test_facts_have_the_stamp_of_their_array():
    statuses = [status("QA status", ("safety", "0.2")), status("Component status", ("laser", "FALSE"))]
    reading = DiagnosticsReader(QUALITIES, COMPONENTS).read(statuses, 7.5)
    assert [fact.stamp for fact in reading.facts] == [7.5, 7.5]


@pytest.mark.parametrize("value", ["TRUE", "FALSE", "RECOVERED"])
def test_component_status(value):
    assert facts(status("Component status", ("laser", value))) == [ComponentFact("laser", value)]


def test_missing_node_is_its_component_failed():
    missing = status("Missing node", level=2, name="/front_laser")
    assert facts(missing, nodes={"front_laser": "laser_resender"}) == [ComponentFact("laser_resender", "FALSE")]
    assert facts(missing) == [ComponentFact("front_laser", "FALSE")]


def test_binding_error_from_level_two():
    assert facts(status("binding error", name="fg", level=2)) == [BindingFact("fg", True)]
    assert facts(status("binding error", name="fg", level=0)) == [BindingFact("fg", False)]


def test_level_as_bytes_is_understood():
    assert facts(status("binding error", name="fg", level=b"\x02")) == [BindingFact("fg", True)]


@pytest.mark.parametrize("key", ["objetive_error", "objective_error"])
def test_failure_of_a_task_as_the_published_observer_reports_it(key):
    assert facts(status("QA status", (key, "True"), name="obj_error")) == [
        TaskFact("obj_error", True, message="reported as a diagnostic")
    ]
    assert facts(status("QA status", (key, "False"), name="obj_error")) == [
        TaskFact("obj_error", False, message="reported as a diagnostic")
    ]


@pytest.mark.parametrize(
    "bad",
    [
        status("QA status"),
        status("QA status", ("", "0.5")),
        status("QA status", ("safety", "")),
        status("QA status", ("safety", "high")),
        status("QA status", ("safety", "nan")),
        status("QA status", ("safety", "-inf")),
        status("QA status", ("safety", "1e999")),
        status("QA status", ("objetive_error", "perhaps")),
        status("QA status", ("saf*", "0.5")),
        status("QA status", ("*", "0.5")),
        status("QA status", ("http://ros/mros#safety", "0.5")),
        status("QA stale"),
        status("QA stale", ("comfort", "")),
        status("Component status"),
        status("Component status", ("laser", "maybe")),
        status("Component status", ("", "TRUE")),
        status("Component status", ("*", "FALSE")),
        status("Component status", ("las*", "FALSE")),
        status("Component status", ("front/laser", "FALSE")),
        status("Missing node", name="/*", level=2),
        status("binding error", level=2),
    ],
)
def test_bad_status_becomes_one_line_and_no_fact(bad):
    reading = read(bad)
    assert reading.facts == ()
    (remark,) = reading.remarks
    assert "\n" not in remark.text


def test_unsupported_quality_is_named_as_published_tools_expect():
    (remark,) = read(status("QA status", ("not_a_qa", "0.2"))).remarks
    assert remark.is_warning
    assert remark.text == "Unsupported QA TYPE received: not_a_qa"


def test_component_that_no_design_requires_is_no_reason_to_warn():
    (remark,) = read(status("Component status", ("sonar", "FALSE"))).remarks
    assert not remark.is_warning


def test_slash_before_a_component_is_left_out():
    assert facts(status("Component status", ("/laser", "FALSE"))) == [ComponentFact("laser", "FALSE")]


def test_long_foreign_text_is_cut_and_control_characters_are_escaped():
    (remark,) = read(status("QA status", ("k\n" * 10000, "x" * 10000))).remarks
    assert len(remark.text) < 300
    assert remark.text.isprintable()


def test_other_statuses_are_left_out():
    assert facts(status("CPU Usage", ("/x", "3")), status("running OK"), status("Missing node", level=0)) == []


def test_later_status_of_the_same_thing_holds():
    statuses = [status("Component status", ("laser", value)) for value in ("FALSE", "TRUE", "RECOVERED")]
    assert facts(*statuses) == [ComponentFact("laser", "RECOVERED")]


def test_a_million_statuses_yield_few_facts_and_few_remarks():
    def flood():
        for i in range(250_000):
            yield status("QA status", ("safety", str(i)), name=f"fg_{i}")
            yield status("QA status", (f"quality_{i}", "0.5"))
            yield status("Component status", (f"component_{i}", "FALSE"))
            yield status("binding error", name=f"fg_{i}", level=2)
        yield status("Component status", ("laser", "FALSE"))

    reading = DiagnosticsReader(QUALITIES, COMPONENTS).read(flood())
    assert len(reading.facts) <= DiagnosticsReader.MAX_NAMES + 1
    assert len(reading.remarks) <= DiagnosticsReader.MAX_REMARKS
    assert ComponentFact("laser", "FALSE") in reading.facts


TEXTS = st.one_of(
    st.text(max_size=80),
    st.sampled_from(["safety", "laser", "TRUE", "nan", "inf", "-1e400", "0.5", "", "*", "/", "objetive_error", "\0"]),
)
MESSAGES = st.one_of(
    st.sampled_from(["QA status", "QA stale", "Component status", "Missing node", "binding error"]), st.text(max_size=9)
)
STATUSES = st.builds(
    lambda message, values, level, name: status(message, *values, level=level, name=name),
    MESSAGES,
    st.lists(st.tuples(TEXTS, TEXTS), max_size=3),
    st.one_of(st.integers(-128, 255), st.binary(max_size=2)),
    TEXTS,
)


@given(st.lists(STATUSES, max_size=30))
def test_whatever_comes_facts_are_about_what_the_model_knows_and_finite(statuses):
    reading = read(*statuses)
    for fact in reading.facts:
        match fact:
            case LevelFact():
                assert fact.quality in QUALITIES
                assert math.isfinite(fact.level)
                assert fact.text.isprintable()
            case StaleFact():
                assert fact.quality in QUALITIES
            case ComponentFact():
                assert fact.component in COMPONENTS
                assert fact.status in ("TRUE", "FALSE", "RECOVERED")
    for remark in reading.remarks:
        assert remark.text.isprintable()
        assert len(remark.text) < 400


def goals(*given):
    found = [
        SimpleNamespace(goal_id=SimpleNamespace(stamp=stamp, id=name), status=status) for stamp, name, status in given
    ]
    return SimpleNamespace(status_list=found)


def test_only_the_newest_goal_counts():
    assert newest_goal(goals((2.0, "b", 1), (1.0, "a", 4))) == ("b", False)
    assert newest_goal(goals((1.0, "a", 3), (2.0, "b", 4))) == ("b", True)


def test_without_goals_nothing_is_known():
    assert newest_goal(goals()) is None


def test_reason_of_a_failed_component_comes_along():
    why = ("reason", "hung: its process does not answer")
    missing = status("Missing node", ("reason", "another"), level=2, name="/laser")
    (fact,) = facts(status("Component status", ("laser", "FALSE"), why), missing)
    assert fact == ComponentFact("laser", "FALSE", reason=why[1])
    assert facts(status("Component status", ("laser", "TRUE"), why)) == [ComponentFact("laser", "TRUE")]


def test_foreign_reason_is_short_and_on_one_line():
    (fact,) = facts(status("Component status", ("laser", "FALSE"), ("reason", "a\nb" + "x" * 1000)))
    assert fact.reason.isprintable()
    assert len(fact.reason) < 250
