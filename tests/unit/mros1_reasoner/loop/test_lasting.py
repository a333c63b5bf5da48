"""Designs that deploy well and end soon after: others are taken, and the same ones wait longer and longer."""

from itertools import pairwise

import pytest
from hierarchy_helpers import model
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import application

WELD = Objective("o_weld", "f_weld")
DESIGNS = {
    "laser_weld": ({"performance": 1.0}, ["gas"]),
    "spot_weld": ({"performance": 0.7}, []),
    "glue": ({"performance": 0.2}, []),
}
FOR_EVER = 1e9


class Plant:
    """A loop whose decisions are carried out after a second; each design then lives for so long, in s."""

    def __init__(self, core, lives, took=1.0):
        self.core, self.lives, self.took = core, lives, took
        self.now, self.ends = 0.0, {}  # by objective: when what runs for it ends
        self.done, self.told = [], []
        self.is_taken_back = False  # whether the manipulator restores the former design, as on probation

    def run(self, seconds):
        """Let time pass; return what was deployed: the moments and the designs."""
        end, before = self.now + seconds, len(self.done)
        while self.now < end:
            self.now = round(self.now + 0.1, 1)
            for name, (moment, design, former) in list(self.ends.items()):
                if self.now >= moment:
                    del self.ends[name]
                    runs, state = (former, "STABLE") if self.is_taken_back and former else (design, "FAILED")
                    self.core.observe_active(self.now, self.core.objectives[name].function, runs, state)
            decisions = self.core.step(self.now)
            self.told += decisions
            for decision in decisions:
                if decision.state == DECIDED:
                    self.now = round(self.now + self.took, 1)
                    self.core.report(self.now, decision.id, True)
                    name, design = decision.objective, decision.to_configuration
                    self.ends[name] = self.now + self.lives[design], design, decision.from_configuration
                    self.done.append((self.now, design))
        return self.done[before:]


def waits(done, life):
    """Return how long each design of those was waited for after the end of the one before, s."""
    return [round(after - before - life - 1.0) for (before, _), (after, _) in pairwise(done)]


@pytest.fixture
def make(load, pellet):
    def make(lives, designs=tuple(DESIGNS), text=None, objectives=(WELD,), **settings):
        chosen = {name: DESIGNS[name] for name in designs}
        knowledge_base = load(text or application(chosen, function="f_weld"))
        pellet.load(knowledge_base.ontology)
        return Plant(Mape(knowledge_base, pellet, objectives, Settings(start_grace=0.0, **settings)), lives)

    return make


def test_only_design_that_always_ends_soon_is_tried_with_growing_waits(make):
    plant = make({"glue": 1.0}, ["glue"], backoff_limit=20.0)
    done = plant.run(200.0)
    assert waits(done, 1.0)[:7] == [1, 2, 4, 8, 16, 20, 20]
    assert len(done) < 15


def test_decisions_tell_why_they_wait_and_that_they_have_waited(make):
    plant = make({"glue": 1.0}, ["glue"])
    plant.run(15.0)
    tried = [decision for decision in plant.told if decision.state == DECIDED]
    waiting = [decision for decision in plant.told if decision.state != DECIDED]
    how = "(ended 1.0 s after it was deployed)"
    assert f"glue is tried again in 1.0 s: the last deployment did not last {how}" in waiting[0].explanation
    assert f"glue is tried again in 2.0 s: the last 2 deployments did not last {how}" in waiting[1].explanation
    assert len(waiting) <= len(tried), "each wait is told once"
    assert tried[2].explanation.endswith(f"; the last 2 deployments did not last {how}")


def test_other_designs_are_tried_at_once_before_one_is_tried_again(make):
    plant = make({"laser_weld": 1.0, "spot_weld": 1.0, "glue": FOR_EVER}, always_improve=False)
    done = plant.run(100.0)
    assert [design for _, design in done] == ["laser_weld", "spot_weld", "glue"]
    assert waits(done, 1.0) == [0, 0]


def test_design_that_lasts_ends_the_waits(make):
    plant = make({"glue": 1.0}, ["glue"])
    plant.run(30.0)
    plant.lives["glue"] = 100.0
    plant.run(70.0)
    plant.lives["glue"] = 1.0
    before = len(plant.done)
    done = plant.done[-1:] + plant.run(80.0)
    assert before == len(plant.done) - len(done) + 1
    assert round(done[1][0] - done[0][0] - 100.0 - 1.0) == 0, "the end of a design that has lasted costs no wait"
    assert waits(done[1:], 1.0)[:3] == [1, 2, 4]


def test_lasting_design_that_is_replaced_ends_the_waits_too(make):
    plant = make({"laser_weld": 1.0, "glue": FOR_EVER}, ["laser_weld", "glue"], always_improve=False)
    plant.run(100.0)
    assert plant.core._state.running["o_weld"].brief == 1
    plant.core.observe_active(plant.now, "f_weld", "laser_weld", "STABLE")  # somebody has asked for it
    assert plant.core._state.running["o_weld"].brief == 0


def test_design_that_the_manipulator_takes_back_soon_is_not_asked_for_again(make):
    plant = make({"spot_weld": 1.0, "laser_weld": FOR_EVER, "glue": FOR_EVER})
    plant.core.observe_active(0.0, "f_weld", "laser_weld", "STABLE")
    plant.run(3.0)
    plant.is_taken_back = True
    plant.core.observe_component(plant.now, "gas", "FALSE", plant.now)
    assert [design for _, design in plant.run(50.0)] == ["spot_weld", "glue"]
    (refused,) = (c.refused_because for c in plant.told[-1].candidates if c.name == "spot_weld")
    assert refused.startswith("was taken back 1.0 s after it was deployed")


def test_only_design_left_that_is_always_taken_back_is_tried_with_growing_waits(make):
    plant = make({"laser_weld": FOR_EVER, "glue": 1.0}, ["laser_weld", "glue"])
    plant.core.observe_active(0.0, "f_weld", "laser_weld", "STABLE")
    plant.run(3.0)
    plant.is_taken_back = True
    plant.core.observe_component(plant.now, "gas", "FALSE", plant.now)
    done = plant.run(50.0)
    assert {design for _, design in done} == {"glue"}
    assert waits(done, 1.0) == [1, 2, 4, 8, 16]


def test_design_that_an_operator_puts_in_its_place_does_not_speak_against_it(make):
    plant = make(dict.fromkeys(DESIGNS, FOR_EVER))
    plant.run(5.0)
    plant.core.observe_active(plant.now, "f_weld", "glue", "STABLE")
    assert plant.core._state.error_log == {}


def test_late_success_of_a_request_is_not_taken_for_a_return_to_the_former_design(make):
    plant = make(dict.fromkeys(DESIGNS, FOR_EVER), always_improve=True)
    plant.core.observe_active(0.0, "f_weld", "laser_weld", "STABLE")
    plant.run(3.0)
    plant.core.observe_component(plant.now, "gas", "FALSE", plant.now)
    plant.run(3.0)
    plant.core.observe_component(plant.now, "gas", "TRUE", plant.now)
    (decision,) = plant.core.step(plant.now + 10.0)
    assert decision.to_configuration == "laser_weld"
    plant.core.observe_active(plant.now + 11.0, "f_weld", "laser_weld", "STABLE")
    plant.core.report(plant.now + 11.0, decision.id, True)
    assert not plant.core._state.why_failed("o_weld", "spot_weld")


def test_better_design_that_failed_is_tried_again_in_place_of_a_working_one(make):
    plant = make({"laser_weld": 1.0, "glue": FOR_EVER}, ["laser_weld", "glue"])
    plant.run(50.0)
    plant.lives["laser_weld"] = FOR_EVER
    (again,) = plant.run(100.0)
    assert 60.0 < again[0] < 70.0
    assert plant.core.facts.groundings == {"o_weld": "laser_weld"}
    (decision,) = (d for d in plant.told[2:] if d.state == DECIDED)
    assert decision.trigger == "retry:laser_weld"
    assert "may be tried again, which failed (ended 1.0 s after" in decision.explanation


def test_better_design_that_always_fails_is_tried_again_ever_more_rarely(make):
    plant = make({"laser_weld": 1.0, "glue": FOR_EVER}, ["laser_weld", "glue"])
    tries = [moment for moment, design in plant.run(3000.0) if design == "laser_weld"]
    gaps = [round(after - before, -1) for before, after in pairwise(tries)]
    assert gaps == [60, 120, 240, 480, 600, 600, 600]


class InTurn:
    """Lives of one design, one after the other; all others live for ever."""

    def __init__(self, design, lives):
        self._design, self._lives = design, list(lives)

    def __getitem__(self, design):
        return self._lives.pop(0) if design == self._design else FOR_EVER


def test_failures_of_a_design_are_in_a_row_only_until_it_has_lasted(make):
    lives = [1.0, 1.0, 1000.0, 1.0, 1000.0, 1000.0, FOR_EVER]
    plant = make(InTurn("laser_weld", lives), ["laser_weld", "glue"])
    begun = [moment for moment, design in plant.run(4000.0) if design == "laser_weld"]
    gaps = [round(after - before - life, -1) for (before, after), life in zip(pairwise(begun), lives, strict=False)]
    assert gaps == [60, 120, 60, 120, 60, 60]


def test_design_that_failed_and_is_hardly_better_is_not_tried_again(make):
    plant = make({"laser_weld": 1.0, "glue": FOR_EVER}, ["laser_weld", "glue"], improvement=0.9)
    assert [design for _, design in plant.run(200.0)] == ["laser_weld", "glue"]


def test_requirement_that_never_lasts_is_tried_with_growing_waits_and_keeps_its_function(make):
    designs = {"cell": ("F0", 1.0, ("F1",)), "feed": ("F1", 1.0, ())}
    plant = make({"cell": FOR_EVER, "feed": 1.0}, text=model(designs, {}), objectives=(Objective("o_cell", "F0"),))
    done = [entry for entry in plant.run(80.0) if entry[1] == "feed"]
    assert len(done) < 12
    assert waits(done, 1.0)[-1] >= 16
    plant.lives["feed"] = FOR_EVER
    plant.run(60.0)
    assert set(plant.core.facts.groundings.values()) == {"cell", "feed"}


def test_binding_error_soon_after_each_deployment_makes_the_waits_grow(make):
    plant = make({"glue": FOR_EVER}, ["glue"])
    while plant.now < 60.0:
        if plant.run(0.5):
            grounding = plant.core._kb.grounding("o_weld", "glue")
            plant.core.observe_binding(plant.now, grounding, True)
    assert waits(plant.done, 0.4)[:4] == [1, 2, 4, 8]


def test_node_that_fails_after_its_design_has_lasted_is_restarted_without_delay(make):
    nodes = '<t:Component rdf:about="#torch"><m:deployedBy rdf:resource="#glue"/></t:Component>'
    plant = make({"glue": FOR_EVER}, text=application({"glue": DESIGNS["glue"]}, nodes, "f_weld"))
    plant.run(5.0)
    gaps = []
    for _ in range(6):
        plant.core.observe_component(plant.now, "torch", "FALSE", plant.now)
        failed, done = plant.now, plant.run(100.0)
        gaps.append(done[0][0] - failed)
    assert max(gaps) < 2.0
    assert plant.core._state.running["o_weld"].not_before < plant.now - 90.0
