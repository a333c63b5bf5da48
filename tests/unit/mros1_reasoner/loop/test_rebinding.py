"""A design with spares: the spare fills the role before another design is taken, and the first component comes back."""

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Design, Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.planning.planner import Situation, difference, plan
from ontology_text import APP, assertion, typed

SETTINGS = Settings(history=1, violation_window=0.0, cool_down=0.5)
# An arm that grips by a force sensor: of the wrist, else one of the fingers; suck needs neither, and is more useful.
LEVELS = {
    "grip": {"performance": 0.6, "force": 20},
    "grip_left": {"performance": 0.6, "force": 22},
    "grip_right": {"performance": 0.6, "force": 24},
    "suck": {"performance": 0.9, "force": 40},
}
SENSORS = {"grip": "wrist", "grip_left": "left", "grip_right": "right"}


def model(levels=LEVELS):
    text = typed(APP + "f_hold", v.FUNCTION) + typed(APP + "touch", v.TOMASYS + "Role")
    text += typed(APP + "performance", v.QA_TYPE) + typed(APP + "force", v.QA_TYPE)
    text += assertion(APP + "performance", v.QA_SIGN, "-1", v.XSD + "decimal")
    text += assertion(APP + "force", v.QA_SIGN, "1", v.XSD + "decimal")
    text += assertion(APP + "touch", v.ROLE_LEAST, "1", v.XSD + "decimal")
    for design, expected in levels.items():
        text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_hold")
        for quality, level in expected.items():
            value = f"{APP}{design}_{quality}"
            text += typed(value, v.QA_VALUE) + assertion(APP + design, v.HAS_QA_ESTIMATION, value)
            text += assertion(value, v.IS_QA_TYPE, APP + quality)
            text += assertion(value, v.HAS_VALUE, level, v.XSD + "decimal")
    for design, sensor in SENSORS.items():
        if design not in levels:
            continue
        binding = f"{APP}touch_by_{sensor}"
        text += typed(APP + sensor, v.COMPONENT) + typed(binding, v.TOMASYS + "Binding")
        text += assertion(binding, v.BINDING_ROLE, APP + "touch")
        text += assertion(binding, v.BINDING_COMPONENT, APP + sensor)
        text += assertion(APP + design, v.ROLES, APP + "touch") + assertion(APP + design, v.BINDS, binding)
        if design != "grip":
            text += assertion(APP + design, v.REBINDS, APP + "grip")
    return text


@pytest.fixture(params=["pellet", "rules"])
def loop(request, tmp_path, pellet):
    """Return a function that makes a loop in which a design runs."""

    def make(design="grip", limits=None, levels=LEVELS, **settings):
        (tmp_path / "arm.owl").write_text(model(levels))
        knowledge_base = read_knowledge_base([tmp_path / "arm.owl"], utility="performance")
        reasoner = pellet if request.param == "pellet" else RuleEngine()
        reasoner.load(knowledge_base.ontology)
        objective = Objective("o_hold", "f_hold", limits or {"force": 30})
        core = Mape(knowledge_base, reasoner, [objective], Settings(**{**vars(SETTINGS), **settings}))
        core.observe_active(0.1, "f_hold", design, "RUNNING")
        core.step(0.2)
        return core

    return make


def decided(core, now, heartbeat=False):
    """Return the decision of a step that has been carried out."""
    found = [decision for decision in core.step(now, heartbeat=heartbeat) if decision.to_configuration]
    if not found:
        return None
    core.report(now + 0.1, found[0].id, ok=True)
    return found[0]


def test_spare_fills_the_role_before_another_design_is_taken(loop):
    core = loop(limits={"force": 100})
    core.observe_component(1.0, "wrist", "FALSE")
    decision = decided(core, 1.1)
    assert decision.to_configuration in ("grip_left", "grip_right")  # though suck is more useful
    assert decision.trigger == "component:wrist"
    assert decision.reasons[0].rules == "S2, S3, S1a"
    assert "grip stays: left fills its role touch now" in decision.explanation


def test_each_spare_in_turn_and_then_another_design(loop):
    core, now, seen = loop(limits={"force": 100}), 1.0, []
    for sensor in ("wrist", "left", "right"):
        core.observe_component(now, sensor, "FALSE")
        seen.append(decided(core, now + 0.1).to_configuration)
        now += 5.0
    assert seen == ["grip_left", "grip_right", "suck"]


def test_first_component_comes_back(loop):
    core = loop(levels={name: levels for name, levels in LEVELS.items() if name != "suck"})
    core.observe_component(1.0, "wrist", "FALSE")
    assert decided(core, 1.1).to_configuration == "grip_left"
    core.observe_component(20.0, "wrist", "TRUE")
    decision = decided(core, 20.1) or decided(core, 25.0)
    assert decision.to_configuration == "grip"
    assert "grip stays: wrist fills its role touch now" in decision.explanation


def test_spare_that_violates_a_limit_is_not_taken(loop):
    core = loop(limits={"force": 21})
    core.observe_component(1.0, "wrist", "FALSE")
    decision = core.step(1.1)[0]
    assert "stays:" not in decision.explanation
    assert {c.name for c in decision.candidates} == {*LEVELS}


def test_where_more_is_wrong_every_design_is_considered(loop):
    core = loop(limits={"force": 200})
    core.observe_level(1.0, "force", 250.0)
    core.observe_component(1.0, "wrist", "FALSE")
    assert decided(core, 1.1).to_configuration == "suck"


def test_spare_that_failed_before_is_not_taken(loop):
    core = loop(limits={"force": 100})
    core.observe_component(1.0, "wrist", "FALSE")
    decision = core.step(1.1)[0]
    assert decision.to_configuration == "grip_left"
    core.report(1.2, decision.id, ok=False, message="no force from left")
    assert decided(core, 5.0).to_configuration == "grip_right"


def test_spare_that_is_more_useful_than_its_design_stays(loop):
    levels = {name: dict(levels) for name, levels in LEVELS.items() if name != "suck"}
    levels["grip_left"]["performance"] = 0.7
    core = loop("grip_left", levels=levels)
    for now in (2.0, 12.0, 22.0):
        core.observe_component(now, "right", "FALSE")
        assert decided(core, now + 1.0) is None
        core.observe_component(now + 5.0, "right", "TRUE")
        assert decided(core, now + 6.0) is None


def test_first_component_comes_back_and_the_way_back_to_the_design_before_stays_open(loop):
    levels = {
        "suck": {"performance": 0.9, "force": 26},
        "grip": {"performance": 0.6, "force": 20},
        "grip_left": {"performance": 0.6, "force": 16},
    }
    core, running, now, seen = loop("suck", levels=levels, history=3, violation_window=1.0), "suck", 1.0, []
    # The cause of the violation gets less, so far that the first component may be used again, and then it is gone.
    for factor in [1.5] * 20 + [1.2] * 40 + [1.0] * 80:
        now += 0.5
        core.observe_level(now, "force", levels[running]["force"] * factor)
        if decision := decided(core, now, heartbeat=True):
            running = decision.to_configuration
            seen.append(running)
    assert seen == ["grip_left", "grip", "suck"]


def test_design_comes_before_its_rebindings_though_their_levels_are_nearer_to_the_running_one():
    running = Design("cam", "f_see", {"p": 0.1, "risk": 0.2}, components=frozenset({"camera"}))
    first = Design("laser", "f_see", {"p": 0.9, "risk": 0.1}, components=frozenset({"front"}))
    spare = Design("laser_r", "f_see", {"p": 0.9, "risk": 0.12}, components=frozenset({"rear"}), rebinds="laser")
    situation = Situation(current="cam")
    found = plan(Objective("o", "f_see"), [running, first, spare], situation, lambda d: d.expected["p"], difference)
    assert found.choice == "laser"


def test_design_comes_before_its_rebindings_where_they_are_as_useful():
    first, spare = Design("zoom", "f_see", {"p": 1.0}), Design("aaa", "f_see", {"p": 1.0}, rebinds="zoom")
    found = plan(
        Objective("o_see", "f_see"), [spare, first], Situation(), lambda design: design.expected["p"], difference
    )
    assert found.choice == "zoom"
