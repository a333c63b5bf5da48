"""A reasoner that takes the place of one that died knows what that one has waited for, and what was asked of it."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.loop import journal
from mros1_reasoner.loop.asked import Asked, carry_out
from mros1_reasoner.loop.entries import (
    ActiveFact,
    Command,
    ComponentFact,
    Content,
    Entry,
    FailedFact,
    LeftFact,
    LevelFact,
    Lock,
    Pursue,
    Released,
    RemoveObjective,
    Result,
    SetNfr,
    Step,
    Unlock,
    UnneededFact,
)
from mros1_reasoner.loop.goals import Goals, Wish
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.remembered import remembered, remembered_goals, to_remember
from mros1_reasoner.loop.settings import Settings
from simulated import systems


class Line:
    """Reasoners of one robot, one after the other."""

    def __init__(self, system: str, **limits: float) -> None:
        self.system, self.now = systems.load(system), 0.0
        self.objectives = tuple(replace(o, limits=limits or o.limits) for o in self.system.objectives)
        self.asked = Asked()
        self.runs: dict[str, str] = {}
        self.begin()

    def begin(self) -> None:
        engine = RuleEngine()
        engine.load(self.system.knowledge.ontology)
        self.core = Mape(self.system.knowledge, engine, self.objectives, Settings())

    def take(self, content: Content) -> list[tuple[str, str, str]]:
        found = []
        for decision in journal.apply(self.core, Entry(self.now, content)):
            found.append((decision.state, decision.objective, decision.to_configuration))
            if decision.state == "DECIDED":
                self.take(Result(decision.id, True))
                self.runs[self.core.objectives[decision.objective].function] = decision.to_configuration
        return found

    def ask(self, command: Lock | Unlock | SetNfr) -> None:
        self.take(command)
        self.asked.heed(command, self.core.objectives)

    def deploy(self, **configurations: str) -> None:
        self.runs |= configurations
        self.tell_what_runs()
        self.live(1.0)

    def tell_what_runs(self) -> None:
        for function, configuration in self.runs.items():
            self.take(ActiveFact(function, configuration, "STABLE"))

    def live(self, duration: float, **strains: float) -> list[tuple[str, str, str]]:
        """Let time pass; observe levels that are so many times the expected ones."""
        found, end = [], self.now + duration
        for tick in self._ticks(end):
            design = self.system.knowledge.designs[next(iter(self.runs.values()))]
            for quality, strain in strains.items():
                level = design.expected[quality] * strain
                self.take(LevelFact(quality, level, stamp=self.now))
            found += self.take(Step(tick % 2 == 0))
        return found

    def _ticks(self, end: float) -> Iterator[int]:
        tick = 0
        while self.now < end:
            self.now += 1.0
            yield tick
            tick += 1

    def die(self) -> None:
        """Have another reasoner take the place of the present one, with nothing but what parameters can tell."""
        memory, asked = to_remember(self.core.view, {}), self.asked.as_parameter()
        self.begin()
        for fact in remembered(memory):
            self.take(fact)
        self.asked = Asked.from_parameter(asked)
        assert carry_out(self.asked.commands, self.take) == []
        self.tell_what_runs()


def designs_of(decisions: list[tuple[str, str, str]]) -> list[str]:
    return [to for state, _, to in decisions if state == "DECIDED"]


@pytest.fixture
def robot():
    """Return D2 with a fast design, of which only the safety is limited."""
    line = Line("d2", safety=0.6)
    line.deploy(f_navigate="f1_v2_r1")
    line.live(10.0, safety=1.0)
    return line


@pytest.mark.parametrize("dies", [False, True])
def test_better_design_comes_back_when_the_cause_of_a_violation_is_gone(robot, dies):
    left = robot.runs["f_navigate"]
    assert designs_of(robot.live(20.0, safety=1.5))
    assert robot.runs["f_navigate"] != left
    if dies:
        robot.die()
    robot.live(5.0, safety=1.5)
    assert designs_of(robot.live(200.0, safety=1.0)), "it must not stay with the slow one for ever"


@pytest.mark.parametrize("dies", [False, True])
def test_cause_that_stays_brings_nothing_back(robot, dies):
    robot.live(20.0, safety=1.5)
    if dies:
        robot.die()
    assert designs_of(robot.live(100.0, safety=1.5)) == []


@pytest.mark.parametrize("dies", [False, True])
def test_component_that_comes_back_is_news(dies):
    robot = Line("d2")
    robot.deploy(f_navigate="f3_v3_r3")
    robot.live(20.0)
    robot.take(ComponentFact("front_laser", "FALSE", robot.now, "dead"))
    assert designs_of(robot.live(5.0))
    if dies:
        robot.die()
    robot.take(ComponentFact("front_laser", "TRUE", robot.now))
    assert designs_of(robot.live(60.0)), "what needs the laser can be had again"


def test_component_that_works_as_before_is_no_news():
    robot = Line("d2")
    robot.deploy(f_navigate="f3_v3_r3")
    robot.live(20.0)
    robot.die()
    robot.take(ComponentFact("front_laser", "TRUE", robot.now))
    assert designs_of(robot.live(60.0)) == []


def test_what_has_failed_is_not_forgotten_by_who_dies_before_it_hears_of_it():
    robot = Line("d2")
    robot.take(ComponentFact("front_laser", "FALSE", 0.0, "dead"))
    robot.die()
    assert to_remember(robot.core.view, {})["failed"] == ["front_laser"]


def test_limit_of_an_operator_holds_when_a_task_asks_anew_for_an_objective_of_the_model():
    robot = Line("d2", safety=0.6)
    robot.ask(SetNfr("o_navigate", "safety", 0.3))
    robot.die()

    def command(command: Command) -> None:
        robot.take(command)
        if isinstance(command, Pursue):
            assert carry_out(robot.asked.asked_anew(command.name), robot.take) == []

    goals = Goals(robot.core, command)
    wish = Wish("f_navigate", limits=(("safety", 0.5),))
    goals.ask("first", wish)
    assert robot.core.objectives["o_navigate"].limits == {"safety": 0.3}
    goals.ask("second", wish)
    assert robot.core.objectives["o_navigate"].limits == {"safety": 0.5}


@pytest.mark.parametrize(
    "left",
    [
        LeftFact("o_navigate", "f1_v2_r1", degraded=True),
        LeftFact("o_navigate", "f1_v2_r1", "safety", 1.5, 0.0, "f1", True),
        LeftFact("o_later", "f1_v2_r1", degraded=True),
        LeftFact("o_later", "", "safety", 1.5, 0.0, "f1"),
    ],
)
def test_what_was_left_is_not_forgotten_by_who_dies_before_the_design_or_the_objective_is_there(left):
    robot = Line("d2")
    robot.take(left)
    assert remembered(to_remember(robot.core.view, {})) == [left]


@pytest.mark.parametrize("deaths", [0, 1, 2])
def test_what_nothing_needed_when_a_reasoner_died_is_released(deaths):
    station = Line("station")
    station.deploy(f_assemble="screw", f_grasp="grasp_fine", f_look="look_left")
    station.take(RemoveObjective(next(iter(station.core.roots))))
    station.take(Step(False))
    unneeded = station.core.released
    assert unneeded == ("f_assemble", "f_grasp", "f_look")
    station.objectives = ()
    for _ in range(deaths):
        station.die()
    assert station.core.released == unneeded
    station.live(20.0)
    assert station.core.released == unneeded
    station.take(Released("f_look"))
    assert station.core.released == ("f_assemble", "f_grasp")


def test_what_was_to_be_released_and_is_needed_again_stays():
    station = Line("station")
    station.runs = {"f_look": "look_left"}
    station.take(UnneededFact("f_look"))
    station.deploy(f_assemble="screw", f_grasp="grasp_fine")
    assert station.core.released == ()


def test_what_was_released_before_a_reasoner_died_may_run_again_later():
    station = Line("station")
    station.take(UnneededFact("f_look"))
    station.deploy(f_assemble="screw", f_grasp="grasp_fine")
    station.live(20.0)
    assert to_remember(station.core.view, {})["unneeded"] == []


@pytest.mark.parametrize("dies", [False, True])
@pytest.mark.parametrize("name", ["", "o_look"])
def test_locked_objectives_that_designs_require_keep_their_designs(dies, name):
    station = Line("station")
    station.deploy(f_assemble="screw", f_grasp="grasp_fine", f_look="look_left")
    station.ask(Lock(name))
    if dies:
        station.die()
    station.live(2.0)
    station.take(ComponentFact("eye_left", "FALSE", station.now, "dead"))
    assert designs_of(station.live(20.0)) == []
    station.ask(Unlock())
    assert "look_right" in designs_of(station.live(5.0))


def test_limit_of_an_objective_that_a_design_requires_holds_when_it_comes():
    station = Line("station")
    quality, kind = next(iter(station.system.knowledge.qualities.items()))
    limit = 0.5 if kind.holds(0.5) else 1.0
    station.ask(SetNfr("o_look", quality, limit))
    assert "o_look" not in station.core.objectives
    station.deploy(f_assemble="screw", f_grasp="grasp_fine", f_look="look_left")
    assert station.core.objectives["o_look"].limits[quality] == limit


def test_objective_that_no_design_may_require_is_refused():
    station = Line("station")
    for command in (Lock("o_lock"), Unlock("o_lock"), SetNfr("o_lock", "precision", 1.0)):
        with pytest.raises(MapeError, match="no objective is called 'o_lock'"):
            station.take(command)


@pytest.mark.parametrize(
    "value",
    [
        None,
        3,
        "left",
        [],
        {"failed": 3, "left": "x", "unneeded": [3]},
        {"left": [3, [], ["o"], ["o", "d", "q", "much"]]},
        {"goals": [3, ["o"], ["o", 3]]},
    ],
)
def test_memory_that_makes_no_sense_is_left_out(value):
    assert remembered(value) == []
    assert remembered_goals(value) == {}


def test_memory_reads_back():
    robot = Line("d2")
    left = LeftFact("o_navigate", "f1_v2_r1", "safety", 1.5, 0.0, "f1", True)
    robot.deploy(f_navigate="f1_v2_r1")
    robot.take(left)
    robot.take(FailedFact("rear_laser"))
    assert remembered(to_remember(robot.core.view, {})) == [FailedFact("rear_laser"), left]
    assert remembered_goals(to_remember(robot.core.view, {"o_navigate": "a", "o_look": "b"})) == {
        "o_navigate": "a",
        "o_look": "b",
    }


@pytest.mark.parametrize("fact", [LeftFact("o_navigate", "f1_v2_r1", "beauty"), FailedFact("third_laser")])
def test_memory_of_another_model_is_refused(fact):
    with pytest.raises(MapeError, match="not in the model: left out"):
        Line("d2").take(fact)
