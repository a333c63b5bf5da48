"""Expected levels corrected by observed ones: a lasting disturbance leads to one adaptation or two, not to many."""

import random
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge.model import Design, Direction, Objective, Quality
from mros1_reasoner.knowledge.scale import Correction
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.planning.planner import Situation, difference, plan

D2 = Path(__file__).parents[4] / "catkin_ws" / "src" / "metacontrol_sim" / "models" / "d2.owl"
START = "f2_v2_r1"  # its safety has some room: noise does not violate that limit
ONSET, DURATION = 20.0, 300.0  # s: when the power consumption rises, and how long the mission is


def use_of(design):
    return design.expected.get("use", 0.0)


def expected_energy(d2, design=START):
    return d2.designs[design].expected["energy"]


@dataclass
class Mission:
    """A robot whose levels are the usual ones of the design that runs, but for noise and a power factor."""

    core: Mape
    designs: dict[str, Design]
    factor: float
    seed: int = 1
    noise: float = 0.12
    adaptations: list[tuple[float, str]] = field(default_factory=list)
    above: int = 0

    def run(self, design):
        """Run the mission from a design; fill in adaptations, and the seconds above the energy threshold."""
        self.core.observe_active(0.0, "f_navigate", design, "STABLE")
        noise = random.Random(self.seed)
        for second in range(int(DURATION)):
            running = self.core.facts.groundings.get("o_navigate", design)
            expected = self.designs[running].expected
            load = (0.2 + 4.8 * expected["energy_median"]) * (self.factor if second >= ONSET else 1.0)
            energy = (min(load, 5.0) - 0.2) / 4.8 * (1.0 + noise.gauss(0.0, self.noise))
            self.above += second >= ONSET and energy > 0.62
            self.core.observe_level(second, "energy", energy)
            self.core.observe_level(second, "safety", expected["safety"] * (1.0 + noise.gauss(0.0, 0.01)))
            for tenth in range(10):
                self.step(second + tenth / 10)
        return self

    def step(self, now):
        for decision in self.core.step(now):
            if decision.state == DECIDED:
                self.adaptations.append((now, decision.to_configuration))
                self.core.report(now + 0.1, decision.id, True)


@pytest.fixture(scope="module")
def d2(pellet):
    return read_knowledge_base([D2])


@pytest.fixture
def mission(d2, pellet):
    """Return a function that makes a mission."""
    pellet.load(d2.ontology)

    def make(factor, seed=1, **settings):
        settings = {"indifference": 0.05, **settings}  # as d2
        return Mission(Mape(d2, pellet, d2.objectives, Settings(**settings)), d2.designs, factor, seed)

    return make


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("factor", [1.6, 1.8, 2.0, 2.2, 2.5])
def test_lasting_power_increase_leads_to_few_adaptations_and_then_to_rest(mission, factor, seed):
    """Levels scatter by 12 % all the time; with 1.6 to 1.8, those of the slow variants lie at the limit."""
    done = mission(factor, seed).run(START)
    assert 1 <= len(done.adaptations) <= 2, done.adaptations
    assert "_v1_" in done.adaptations[-1][1], "the slow variants are the best there is"


def test_after_the_adaptation_the_energy_is_below_its_threshold_where_that_is_possible(mission):
    done = mission(1.6).run(START)
    assert done.above / (DURATION - ONSET) < 0.25


def test_without_correction_designs_are_tried_one_after_the_other(mission):
    corrected, plain = mission(2.0).run(START), mission(2.0, correct_expected=False).run(START)
    assert len(plain.adaptations) > 2 * len(corrected.adaptations)


def test_robot_as_expected_is_left_alone(mission):
    assert mission(1.0).run("f1_v1_r1").adaptations == []


def usual_energy(d2, design=START):
    return d2.designs[design].expected["energy_median"]


def under_load(core, d2):
    """Return what is decided once ten levels have been 1.6 times the usual one; before, nothing is."""
    for now in range(1, 11):
        core.observe_level(now, "energy", 1.6 * usual_energy(d2))
        decisions = core.step(now)
        assert now == 10 or not decisions
    return decisions


def test_decision_tells_the_factor(mission, d2):
    core = mission(1.6).core
    core.observe_active(0.0, "f_navigate", START, "STABLE")
    (decision,) = under_load(core, d2)
    (text,) = decision.corrections
    assert text == (
        f"energy was 1.6 times what was expected of {START}: 1.6 times that (at most 2.5 times) is expected of the "
        "others"
    )
    assert text in decision.explanation
    refused = {c.name: c.refused_because for c in decision.candidates}
    level = 1.6 * expected_energy(d2, "f1_v2_r1")
    assert refused["f1_v2_r1"].startswith(f"energy {level:.4g} (1.6 times what was expected) > 0.62")
    assert "_v1_" in decision.to_configuration


@pytest.mark.parametrize(("ratio", "factor"), [(0.5, 1.0), (1.2, 1.2), (9.0, 2.5)])
def test_factor_is_bounded_and_never_makes_things_look_better(mission, d2, ratio, factor):
    core = mission(1.0).core
    core.observe_active(0.0, "f_navigate", START, "STABLE")
    for now in range(10):
        core.observe_level(now, "energy", ratio * usual_energy(d2))
    found = core._deliberation.corrections("o_navigate", 10.0)["energy", ""]
    highest = 1.0 / expected_energy(d2)  # levels of energy end at 1
    assert found.factor == pytest.approx(min(factor, highest), abs=0.01)


def test_what_was_learnt_of_one_design_holds_for_the_next(mission, d2):
    core = mission(1.6).core
    core.observe_active(0.0, "f_navigate", START, "STABLE")
    (decision,) = under_load(core, d2)
    core.report(11.0, decision.id, True)
    core.observe_component(12.0, "front_laser", "FALSE")
    (decision,) = core.step(12.0)
    assert "energy was 1.6 times" in decision.corrections[0]


def test_quality_where_higher_is_better_is_corrected_downwards():
    designs = [Design("now", "f", {"reach": 0.8, "use": 0.1}), Design("other", "f", {"reach": 0.9, "use": 0.2})]
    designs.append(Design("far", "f", {"reach": 1.4, "use": 0.1}))
    situation = Situation(
        {"reach": Quality(Direction.HIGHER_IS_BETTER)},
        current="now",
        observed={"reach": 0.4},
        corrections={("reach", ""): Correction(factor=0.5)},
    )
    outcome = plan(Objective("o", "f", {"reach": 0.6}), designs, situation, use_of, difference)
    assert (outcome.choice, outcome.degraded) == ("far", False)


def test_degraded_design_stays_where_another_is_hardly_better():
    designs = [
        Design("now", "f", {"load": 0.34}),
        Design("other", "f", {"load": 0.33}),
        Design("far", "f", {"load": 0.3}),
    ]
    situation = Situation(
        current="now", observed={"load": 0.7}, corrections={("load", ""): Correction(factor=2.0)}, worth=0.1
    )
    objective = Objective("o", "f", {"load": 0.5})
    outcome = plan(objective, designs[:2], situation, use_of, difference)
    assert (outcome.choice, outcome.degraded) == ("now", True)
    assert "other would violate them hardly less" in outcome.reason
    assert plan(objective, designs, situation, use_of, difference).choice == "far"
    assert plan(objective, designs[:2], replace(situation, worth=0.0), use_of, difference).choice == "other"
