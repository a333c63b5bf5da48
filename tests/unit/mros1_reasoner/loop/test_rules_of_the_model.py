"""What the rules of a model conclude leads to decisions that name them."""

import owlready2
import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from ontology_text import APP, assertion, swrl, typed

OBSERVED = "hasQAvalue(?fg, ?m), isQAtype(?m, app:clarity), hasValue(?m, ?x)"
CLOSER = (
    f"{OBSERVED}, typeFD(?fg, ?fd), hasQAestimation(?fd, ?e), isQAtype(?e, app:clarity), hasValue(?e, ?y), "
    "lessThan(?x, ?y) -> fg_status(?fg, 'IN_ERROR_NFR')"
)
SETTINGS = Settings(violation_window=2.0, cool_down=1.0, error_log_expiry=30.0)


@pytest.fixture
def loop(tmp_path, pellet):
    """Return a function that makes a loop of a model with three designs, from the most useful on, and rules."""

    def make(*rules, extra=""):
        text = typed(APP + "f_see", v.FUNCTION) + typed(APP + "lens", v.COMPONENT)
        text += "".join(typed(APP + quality, v.QA_TYPE) for quality in ("clarity", "performance"))
        for design, clarity, performance in (("far", 0.8, 1.0), ("middle", 0.5, 0.6), ("near", 0.2, 0.3)):
            text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_see")
            for quality, level in (("clarity", clarity), ("performance", performance)):
                name = f"{APP}{design}_{quality}"
                text += typed(name, v.QA_VALUE) + assertion(APP + design, v.HAS_QA_ESTIMATION, name)
                text += assertion(name, v.IS_QA_TYPE, APP + quality)
                text += assertion(name, v.HAS_VALUE, level, v.XSD + "decimal")
        path = tmp_path / "app.owl"
        path.write_text(text + extra + "".join(swrl(rule, name) for name, rule in rules))
        knowledge_base = read_knowledge_base([path], utility="performance")
        pellet.load(knowledge_base.ontology)
        core = Mape(knowledge_base, pellet, [Objective("o_see", "f_see")], SETTINGS)
        core.step(0.0)
        core.observe_active(0.1, "f_see", "far", "STABLE")
        assert core.step(0.1) == []
        return core

    return make


def decided(core, now):
    return [decision for decision in core.step(now) if decision.to_configuration]


def test_error_of_quality_counts_when_it_lasts(loop):
    core = loop(("closer", CLOSER))
    core.observe_level(5.0, "clarity", 0.6)
    assert decided(core, 5.0) == []
    assert core.due(5.0) <= 7.0
    core.observe_level(6.9, "clarity", 0.6)
    assert decided(core, 6.9) == []
    (decision,) = decided(core, 7.0)
    assert decision.trigger == "qa:o_see"
    assert decision.causes == ("rule closer of the model finds an error of quality",)
    assert decision.stamp_monitored == 5.0
    assert decision.to_configuration == "middle"
    core.report(7.5, decision.id, ok=True)
    core.observe_level(8.0, "clarity", 0.6)
    assert decided(core, 12.0) == []


def test_error_of_quality_that_passes_counts_not(loop):
    core = loop(("closer", CLOSER))
    for now, clarity in ((5.0, 0.6), (6.0, 0.9), (6.5, 0.6), (8.0, 0.6)):
        core.observe_level(now, "clarity", clarity)
        assert decided(core, now) == []
    assert decided(core, 8.5)


def test_design_that_a_rule_found_in_error_is_tried_again_later(loop):
    core = loop(("closer", CLOSER))
    core.observe_level(5.0, "clarity", 0.6)
    core.step(5.0)
    (decision,) = decided(core, 7.0)
    core.report(7.5, decision.id, ok=True)
    moment = 7.5
    while not (found := decided(core, moment)) and moment < 60.0:
        core.observe_level(moment, "clarity", 0.9)
        moment = core.due(moment) or moment + 1.0
    assert [d.to_configuration for d in found] == ["far"]
    assert 30.0 <= moment <= 45.0
    assert "found it in error" in found[0].explanation


def test_error_of_a_component_counts_at_once(loop):
    core = loop(
        ("cold lens", "c_status(app:lens, 'FALSE'), FunctionGrounding(?fg) -> fg_status(?fg, 'IN_ERROR_COMPONENT')")
    )
    core.observe_component(5.0, "lens", "FALSE")
    (decision,) = decided(core, 5.0)
    assert decision.causes == ("rule cold lens of the model finds an error of a component",)
    assert decision.to_configuration == "middle"


def test_design_that_a_rule_excludes_is_not_taken(loop):
    dark = f"{OBSERVED}, lessThan(?x, 0.5) -> fd_realisability(app:middle, false)"
    core = loop(("closer", CLOSER), ("too dark", dark))
    core.observe_level(5.0, "clarity", 0.4)
    core.step(5.0)
    (decision,) = decided(core, 7.0)
    assert decision.to_configuration == "near"
    middle = next(c for c in decision.candidates if c.name == "middle")
    assert "a rule of the model says that it can't be deployed" in middle.lost_because


def test_design_that_a_rule_no_longer_excludes_is_taken_again(loop):
    dark = f"{OBSERVED}, lessThan(?x, 0.5) -> fd_realisability(app:far, false)"
    hurt = f"{OBSERVED}, lessThan(?x, 0.5), typeFD(?fg, app:far) -> fg_status(?fg, 'IN_ERROR_COMPONENT')"
    core = loop(("too dark", dark), ("cannot see", hurt))
    core.observe_level(5.0, "clarity", 0.4)
    (decision,) = decided(core, 5.0)
    assert decision.to_configuration == "middle"
    core.report(5.5, decision.id, ok=True)
    core.observe_level(8.0, "clarity", 0.4)
    assert decided(core, 8.0) == []
    core.observe_level(9.0, "clarity", 0.7)
    (decision,) = decided(core, 9.0)
    assert decision.to_configuration == "far"
    assert decision.causes == ("far can be deployed again",)


def test_rule_may_read_which_decisions_have_failed_before(loop):
    """A design that did not come up is not tried again where the lens is cold, though its entry in the log is gone."""
    rule = (
        "decision_to(?d, ?fd), decision_state(?d, 'FAILED'), decision_cause(?d, 'component:lens'), "
        "c_status(app:lens, 'FALSE') -> fd_realisability(?fd, false)"
    )
    cold = "c_status(app:lens, 'FALSE'), typeFD(?fg, app:far) -> fg_status(?fg, 'IN_ERROR_COMPONENT')"
    core = loop(("failed before", rule), ("cold", cold), extra=assertion(APP + "lens", v.REQUIRED_BY, APP + "far"))
    core.observe_component(5.0, "lens", "FALSE")
    (decision,) = decided(core, 5.0)
    assert decision.to_configuration == "middle"
    core.report(6.0, decision.id, ok=False, message="no process")
    core.step(6.0)
    assert set(core.analysis.unrealisable) == {"far", "middle"}
    core.observe_component(8.0, "lens", "TRUE")
    core.step(8.0)
    assert not core.analysis.unrealisable


def test_saved_knowledge_base_has_the_decisions(loop, tmp_path):
    core = loop(("closer", CLOSER))
    core.observe_level(5.0, "clarity", 0.6)
    core.step(5.0)
    (decision,) = decided(core, 7.0)
    core.report(7.5, decision.id, ok=True)
    assert core.facts.history == ()  # no rule reads it
    knowledge_base = read_knowledge_base([tmp_path / "app.owl"])
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, core.known)
    world = owlready2.World()
    world.get_ontology((tmp_path / "saved.owl").as_uri()).load()
    (past,) = world[v.DECISION].instances()
    assert (past.decision_from.name, past.decision_to.name) == ("far", "middle")
    assert (past.decision_state, float(past.decision_stamp)) == ("EXECUTED", 7.5)
    assert list(past.decision_cause) == ["qa:o_see"]
    assert read_knowledge_base([tmp_path / "saved.owl"]).designs == knowledge_base.designs


def test_better_design_that_a_rule_calls_for_is_taken(loop):
    bright = f"{OBSERVED}, greaterThan(?x, 0.9), solvesO(?fg, ?o) -> o_status(?o, 'UPDATABLE')"
    core = loop(("bright", bright))
    core.observe_active(1.0, "f_see", "near", "STABLE")
    core.step(3.0)
    core.observe_level(5.0, "clarity", 0.7)
    assert decided(core, 5.0) == []
    core.observe_level(6.0, "clarity", 0.95)
    (decision,) = decided(core, 6.0)
    assert decision.to_configuration == "far"
    assert decision.causes == ("rule bright of the model says that there may be a better design",)
