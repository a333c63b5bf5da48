from types import SimpleNamespace

import pytest
from mros1_reasoner.diagnostics import BadFact, BindingFact, ComponentFact, LevelFact, StaleFact, read_statuses


def status(message, *values, level=0, name="", hardware_id=""):
    pairs = [SimpleNamespace(key=key, value=value) for key, value in values]
    return SimpleNamespace(message=message, values=pairs, level=level, name=name, hardware_id=hardware_id)


def read(*statuses, components=None):
    return read_statuses(statuses, components or {})


def test_level_with_the_grounding_that_it_names():
    assert read(status("QA status", ("safety", "0.25"), name="fg_x")) == [LevelFact("safety", 0.25, "fg_x")]


def test_stale_quality():
    assert read(status("QA stale", ("safety", "no scan"), level=3)) == [StaleFact("safety", "no scan")]


@pytest.mark.parametrize("value", ["TRUE", "FALSE", "RECOVERED"])
def test_component_status(value):
    assert read(status("Component status", ("laser", value))) == [ComponentFact("laser", value)]


def test_missing_node_is_its_component_failed():
    missing = status("Missing node", level=2, name="/front_laser")
    assert read(missing, components={"front_laser": "laser_resender"}) == [ComponentFact("laser_resender", "FALSE")]
    assert read(missing) == [ComponentFact("front_laser", "FALSE")]


def test_binding_error_from_level_two():
    assert read(status("binding error", name="fg", level=2)) == [BindingFact("fg", True)]
    assert read(status("binding error", name="fg", level=0)) == [BindingFact("fg", False)]


def test_level_as_bytes_is_understood():
    assert read(status("binding error", name="fg", level=b"\x02")) == [BindingFact("fg", True)]


@pytest.mark.parametrize(
    "bad",
    [
        status("QA status"),
        status("QA status", ("", "0.5")),
        status("QA status", ("safety", "")),
        status("QA status", ("safety", "high")),
        status("QA status", ("safety", "nan")),
        status("QA status", ("safety", "-inf")),
        status("QA stale"),
        status("Component status"),
        status("Component status", ("laser", "maybe")),
        status("Component status", ("", "TRUE")),
        status("binding error", level=2),
    ],
)
def test_bad_status_becomes_one_line(bad):
    (fact,) = read(bad)
    assert isinstance(fact, BadFact)
    assert "\n" not in fact.warning


def test_long_foreign_text_is_cut():
    (fact,) = read(status("QA status", ("k" * 10000, "x" * 10000)))
    assert len(fact.warning) < 300


def test_other_statuses_are_left_out():
    assert read(status("CPU Usage", ("/x", "3")), status("running OK"), status("Missing node", level=0)) == []
