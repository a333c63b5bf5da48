"""Goals of tasks: objectives asked for, changed and given up, and what is told of them."""

import contextlib
import math
from dataclasses import replace

import pytest
from hierarchy_helpers import D1, model
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop import entries, journal
from mros1_reasoner.loop.entries import Entry
from mros1_reasoner.loop.entry_text import kind_of, read_entry, values_of
from mros1_reasoner.loop.fulfilment import Fulfilment
from mros1_reasoner.loop.goals import End, Goals, Wish
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import OBJECTIVE

SETTINGS = Settings(history=1, violation_window=0.0, cool_down=0.0, start_grace=0.0, restart_grace=0.0, backoff=0.0)


class Tasks:
    """A loop without a master: whatever it decides is carried out when the test says so."""

    def __init__(self, knowledge_base, objectives=(), settings=SETTINGS):
        reasoner = RuleEngine()
        reasoner.load(knowledge_base.ontology)
        self.core = Mape(knowledge_base, reasoner, objectives, settings)
        self.now, self.journal, self.told = 1.0, [], {}
        self.goals = Goals(self.core, self.take)

    def take(self, content):
        """Have the loop take something in, as the node does."""
        for decision in journal.apply(self.core, Entry(self.now, content)):
            self.goals.heed_decision(decision)
        self.journal.append(Entry(self.now, content))
        if isinstance(content, entries.SetNfr):
            self.goals.heed_limit(content.objective, content.quality, content.limit)

    def ask(self, goal, function="f_move", **wish):
        return self.goals.ask(goal, Wish(function, **wish))

    def look(self):
        """Step once; keep and return what is told."""
        self.take(entries.Step(False))
        news = self.goals.look(self.now)
        for goal, item in news:
            self.told.setdefault(goal, []).append(item)
        return dict(news)

    def settle(self):
        """Carry out whatever is decided, until nothing is."""
        for _ in range(20):
            self.look()
            if not self.core.pending:
                return
            self.carry_out()
        raise AssertionError("it does not come to rest")

    def carry_out(self, ok=True):
        self.take(entries.Result(self.core.pending.id, ok, "" if ok else "it broke"))

    def ended(self, goal):
        """Return why a goal has ended, which nothing was told of after that; None: it has not."""
        told = self.told.get(goal, [])
        assert not any(isinstance(item, End) for item in told[:-1])
        return told[-1].reason if told and isinstance(told[-1], End) else None

    def last(self, goal):
        return self.told[goal][-1]


@pytest.fixture
def tasks(knowledge_base):
    """A loop that nobody has asked for anything yet."""
    return Tasks(knowledge_base)


def test_goal_adds_an_objective_and_is_fulfilled_when_its_design_runs(tasks):
    assert tasks.ask("a", limits=(("energy", 0.5),)) == "objective o_move is new"
    tasks.look()
    assert tasks.last("a").statuses == ("UNGROUNDED",)
    assert tasks.last("a").why == "scan_slow is being deployed; no configuration runs"
    tasks.carry_out()
    tasks.look()
    assert tasks.last("a") == Fulfilment("o_move", ("IN_PROGRESS",), "scan_slow", is_fulfilled=True)
    assert tasks.look() == {}, "nothing is told twice"


def test_cancelled_goal_gives_its_function_up(tasks):
    tasks.ask("a", limits=(("energy", 0.5),))
    tasks.settle()
    tasks.goals.cancel("a")
    tasks.look()
    assert (tasks.ended("a"), dict(tasks.core.objectives), tasks.core.released) == ("CANCELLED", {}, ("f_move",))


def test_goal_cancelled_during_its_adaptation_ends_after_it(tasks):
    tasks.ask("a")
    tasks.look()
    tasks.goals.cancel("a")
    tasks.look()
    assert tasks.ended("a") is None
    tasks.carry_out()
    tasks.look()
    assert (tasks.ended("a"), tasks.core.released) == ("CANCELLED", ("f_move",))


def test_newer_goal_replaces_the_limits_and_ends_the_older_one(tasks):
    tasks.ask("a")
    tasks.settle()
    assert tasks.last("a").configuration == "scan_fast"
    assert "its limits are replaced" in tasks.ask("b", limits=(("energy", 0.35),))
    tasks.settle()
    assert tasks.ended("a") == "REPLACED"
    assert (tasks.last("b").configuration, tasks.last("b").is_fulfilled) == ("scan_slower", True)
    tasks.goals.cancel("a")
    tasks.look()
    assert tasks.core.objectives["o_move"].limits == {"energy": 0.35}, "who was replaced gives nothing up"


def test_goal_that_ends_leaves_its_objective_to_a_newer_one(tasks):
    tasks.ask("a")
    tasks.look()
    tasks.goals.cancel("a")
    tasks.look()  # it can't be given up yet
    tasks.ask("b", limits=(("energy", 0.35),))
    tasks.carry_out()
    tasks.settle()
    assert (tasks.ended("a"), tasks.ended("b")) == ("CANCELLED", None)
    assert tasks.last("b").configuration == "scan_slower"


def test_objective_that_was_there_gets_its_limits_back(knowledge_base):
    tasks = Tasks(knowledge_base, [OBJECTIVE])
    tasks.ask("a", limits=(("energy", 0.35),), always_improve=False)
    tasks.ask("b", name="o_move", limits=(("safety", 0.25),))
    tasks.settle()
    assert tasks.core.objectives["o_move"].limits == {"safety": 0.25}
    tasks.goals.cancel("b")
    tasks.settle()
    assert (tasks.ended("a"), tasks.ended("b")) == ("REPLACED", "CANCELLED")
    assert tasks.core.objectives == {"o_move": OBJECTIVE}


def test_objective_of_a_model_may_have_any_name(knowledge_base):
    named = Objective("move.slowly-please", "f_move", {"energy": 0.62})
    tasks = Tasks(knowledge_base, [named])
    tasks.ask("a", limits=(("energy", 0.35),))
    tasks.settle()
    tasks.goals.cancel("a")
    tasks.settle()
    assert tasks.core.objectives == {named.name: named}


def test_better_design_returns_after_a_violation_although_a_goal_without_that_limit_came_between(knowledge_base):
    tasks = Tasks(knowledge_base, settings=replace(SETTINGS, calm=0.0))
    tasks.ask("a", limits=(("safety", 0.75),))
    tasks.settle()
    tasks.take(entries.LevelFact("safety", 0.9))
    tasks.settle()
    assert tasks.last("a").configuration != "scan_fast"
    tasks.ask("b", limits=(("energy", 0.8),))
    tasks.settle()
    assert tasks.last("b").configuration == "scan_fast"
    assert tasks.core._state.levels.blamed("o_move") == ()


def test_limit_of_an_operator_outlasts_the_goal(knowledge_base):
    tasks = Tasks(knowledge_base, [OBJECTIVE])
    tasks.ask("a", limits=(("energy", 0.35),))
    tasks.take(entries.SetNfr("", "safety", 0.9))
    tasks.settle()
    assert tasks.core.objectives["o_move"].limits == {"energy": 0.35, "safety": 0.9}
    tasks.goals.cancel("a")
    tasks.settle()
    assert tasks.core.objectives["o_move"].limits == {"energy": 0.62, "safety": 0.9}


@pytest.mark.parametrize("is_during_the_goal", [False, True])
def test_goal_ends_although_a_limit_of_an_operator_fits_no_band(knowledge_base, is_during_the_goal):
    band = {"safety_min": 0.2, "safety": 0.75}
    assert all(map(knowledge_base.admit, band))
    tasks = Tasks(knowledge_base, [Objective("o_move", "f_move", band)])
    tasks.settle()
    if is_during_the_goal:
        tasks.ask("a", limits=(("energy", 0.65),))  # it has no band of safety
        tasks.take(entries.SetNfr("", "safety", 0.1))
    else:
        with pytest.raises(MapeError, match=r"the band of safety is 0.2 to 0.1: set its other limit first"):
            tasks.take(entries.SetNfr("", "safety", 0.1))
        tasks.ask("a", limits=(("energy", 0.65),))
    tasks.settle()
    tasks.goals.cancel("a")
    tasks.settle()
    assert tasks.ended("a") == "CANCELLED"
    assert ("former limits can't be restored" in tasks.last("a").message) == is_during_the_goal


def test_goal_of_another_name_gives_the_older_objective_up(knowledge_base):
    tasks = Tasks(knowledge_base, [OBJECTIVE, Objective("o_twin", "f_move", {"energy": 0.9})])
    tasks.ask("a", limits=(("energy", 0.35),))
    tasks.ask("b", name="o_twin", limits=(("energy", 0.7),))
    tasks.settle()
    assert tasks.ended("a") == "REPLACED"
    assert {name: o.limits["energy"] for name, o in tasks.core.objectives.items()} == {"o_move": 0.62, "o_twin": 0.7}


def test_removal_by_the_service_ends_the_goal(tasks):
    tasks.ask("a")
    tasks.settle()
    tasks.take(entries.RemoveObjective("o_move"))
    tasks.look()
    assert tasks.ended("a") == "REMOVED"


def test_objective_that_nothing_can_be_deployed_for_waits_and_says_why(tasks):
    tasks.take(entries.ComponentFact("base", "FALSE"))
    tasks.ask("a")
    tasks.settle()
    assert tasks.last("a").statuses == ("UNREACHABLE", "UNGROUNDED")
    assert "no design can be deployed" in tasks.last("a").why or "base" in tasks.last("a").why
    tasks.take(entries.ComponentFact("base", "TRUE"))
    tasks.settle()
    assert tasks.last("a").is_fulfilled


@pytest.mark.parametrize("start", [1.0, 1.7e9])
def test_goal_gives_up_when_it_was_not_fulfilled_for_so_long(tasks, start):
    tasks.now = 0.0  # the clock begins late
    tasks.take(entries.ComponentFact("base", "FALSE"))
    tasks.ask("a", give_up_after=5.0)
    tasks.settle()
    for tasks.now, ended in ((start, None), (start + 4.9, None), (start + 5.0, "NOT_FULFILLED")):
        tasks.settle()
        assert tasks.goals.due() is None if ended else tasks.goals.due() == start + 5.0
    tasks.settle()
    assert tasks.ended("a") == "NOT_FULFILLED"
    assert "o_move has not been fulfilled for 5 s: " in tasks.last("a").message
    assert tasks.core.objectives == {}


def test_time_in_which_it_is_fulfilled_counts_for_nothing(tasks):
    tasks.ask("a", give_up_after=5.0)
    tasks.settle()
    tasks.now = 100.0
    tasks.settle()
    tasks.take(entries.ActiveFact("f_move", "scan_fast", "RECOVERING"))
    tasks.settle()
    assert (tasks.last("a").why, tasks.goals.due()) == ("scan_fast is RECOVERING", 105.0)
    tasks.take(entries.ActiveFact("f_move", "scan_fast", "STABLE"))
    tasks.settle()
    tasks.now = 200.0
    tasks.settle()
    assert tasks.ended("a") is None


def test_violated_limit_is_told_when_it_counts(tasks):
    tasks.ask("a", limits=(("safety", 0.75),))
    tasks.settle()
    assert tasks.last("a").configuration == "scan_fast"
    tasks.take(entries.LevelFact("safety", 0.9))
    tasks.look()
    assert (tasks.last("a").violated, tasks.last("a").is_fulfilled) == (("safety",), False)
    assert "IN_ERROR_NFR" in tasks.last("a").statuses
    tasks.settle()
    assert tasks.last("a").is_fulfilled
    assert tasks.last("a").configuration != "scan_fast"


def test_limit_that_no_design_keeps_is_told_with_the_makeshift(tasks):
    tasks.ask("a", limits=(("energy", 0.25),))
    tasks.settle()
    last = tasks.last("a")
    assert (last.configuration, last.violated, last.is_fulfilled) == ("scan_slower", ("energy",), False)
    assert "energy of scan_slower is expected to be 0.3 > 0.25" in last.why


def test_band_is_kept(tasks):
    tasks.ask("a", limits=(("energy", 0.35), ("energy", 0.5)))
    tasks.settle()
    assert tasks.core.objectives["o_move"].limits == {"energy": 0.5, "energy_min": 0.35}
    assert (tasks.last("a").configuration, tasks.last("a").is_fulfilled) == ("scan_slow", True)


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        (Wish("f_fly"), "^no Function is called 'f_fly': known: f_move"),
        (Wish("f_move", "o move"), "objective 'o move': use letters"),
        (Wish("f_move", limits=(("comfort", 1.0),)), "Unsupported QA TYPE received: comfort"),
        (Wish("f_move", limits=(("energy", math.inf),)), "limit of energy is inf"),
        (Wish("f_move", limits=(("energy", 0.5), ("energy", 0.2))), "band of energy is 0.5 to 0.2: give the least"),
        (Wish("f_move", limits=(("energy", 0.2), ("energy_min", 0.5))), "band of energy is 0.5 to 0.2: give the least"),
        (Wish("f_move", limits=(("energy", 0.1), ("energy", 0.2), ("energy", 0.3))), "energy has 3 limits"),
        (Wish("f_move", give_up_after=-1.0), "give_up_after is -1.0"),
        (Wish("f_move", give_up_after=math.nan), "give_up_after is nan"),
    ],
)
def test_goal_that_makes_no_sense_is_rejected_and_changes_nothing(tasks, wish, message):
    tasks.ask("a", limits=(("safety", 0.5),))
    with pytest.raises(MapeError, match=message) as found:
        tasks.goals.ask("b", wish)
    assert "\n" not in str(found.value)
    tasks.settle()
    assert (tasks.ended("a"), tasks.core.objectives["o_move"].limits) == (None, {"safety": 0.5})


def test_name_of_an_objective_of_another_function_is_rejected(load):
    tasks = Tasks(load(model()), [Objective("o_build", "F0")])
    with pytest.raises(MapeError, match="objective o_build is one of F0, not of F2: give another name"):
        tasks.ask("a", "F2", name="o_build")


def test_function_given_up_runs_on_while_another_one_requires_it(load):
    tasks = Tasks(load(model()))
    tasks.take(entries.ComponentFact("left_arm", "FALSE"))
    tasks.ask("build", "F0")
    tasks.ask("look", "F2")
    tasks.settle()
    assert {o: tasks.core.facts.groundings[o] for o in ("o_F0", "o_F1", "o_F2")} == {
        "o_F0": "FD1",
        "o_F1": "FD1.1",
        "o_F2": "FD2.1",
    }
    tasks.goals.cancel("look")
    tasks.settle()
    assert (tasks.ended("look"), tasks.core.released, tasks.last("build").is_fulfilled) == ("CANCELLED", (), True)
    tasks.goals.cancel("build")
    tasks.settle()
    assert set(tasks.core.released) == {"F0", "F1", "F2"}


FUNCTIONS = sorted({function for function, _, _ in D1.values()})
NAMES = ("", "o_build", "o_more")
EVENTS = st.one_of(
    st.tuples(st.just("ask"), st.sampled_from(FUNCTIONS), st.sampled_from(NAMES), st.sampled_from([0.1, 0.5, None])),
    st.tuples(st.just("cancel"), st.integers(0, 8)),
    st.tuples(st.just("remove"), st.sampled_from([*NAMES[1:], "o_F0", "o_F1", "o_F2"])),
    st.tuples(st.just("add"), st.sampled_from(NAMES[1:]), st.sampled_from(FUNCTIONS)),
    st.tuples(st.just("component"), st.sampled_from(["left_arm", "rgbd"]), st.sampled_from(["TRUE", "FALSE"])),
    st.tuples(st.just("report"), st.booleans()),
    st.tuples(st.just("wait"), st.sampled_from([1.0, 30.0])),
    st.just(("restart",)),
)


def take_event(tasks, event, count, first):
    match event:
        case ("ask", function, name, limit):
            limits = () if limit is None else (("error", limit),)
            tasks.ask(f"g{count}", function, name=name, limits=limits, give_up_after=20.0 * (count % 2))
        case ("cancel", number):
            tasks.goals.cancel(f"g{number}")
        case ("remove", name):
            tasks.take(entries.RemoveObjective(name))
        case ("add", name, function):
            tasks.take(entries.AddObjective(name, function, {}))
        case ("component", name, status):
            tasks.take(entries.ComponentFact(name, status))
        case ("report", ok) if tasks.core.pending:
            tasks.carry_out(ok)
        case ("wait", seconds):
            tasks.now += seconds
        case ("restart",):  # what runs is taken over, goals are not
            active = dict(tasks.core._state.active)
            tasks.__init__(tasks.core._kb, first)
            for function, (design, state) in active.items():
                tasks.take(entries.ActiveFact(function, design, state))


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(events=st.lists(EVENTS, max_size=20), is_there=st.booleans())
def test_goals_hold_whatever_happens(load, events, is_there):
    """One goal a function; each one that was accepted ends once; what was there first comes back."""
    first = [Objective("o_build", "F0", {"error": 0.9})] if is_there else []
    tasks = Tasks(load(model()), first)
    removed, accepted = set(), set()
    for count, event in enumerate(events):
        with contextlib.suppress(MapeError):  # what does not fit is refused
            take_event(tasks, event, count, first)
            accepted |= {f"g{count}"} if event[0] == "ask" else set()
            removed |= {event[1]} if event[0] in ("remove", "add") else set()
            if event[0] == "restart":
                accepted, removed = set(), set()
        tasks.look()
        active = [goal for goal in accepted if tasks.ended(goal) is None]
        functions = [tasks.goals._goals[goal].wish.function for goal in active]
        assert sorted(functions) == sorted(set(functions))
        for goal in active:
            known = tasks.goals._goals[goal]
            assert tasks.core.objectives[known.objective].function == known.wish.function
    for goal in accepted:
        tasks.goals.cancel(goal)
    tasks.settle()
    tasks.settle()
    assert all(tasks.ended(goal) for goal in accepted)
    left = {name: objective for name, objective in tasks.core.objectives.items() if name in tasks.core.roots}
    assert {name: o for name, o in left.items() if name not in removed} == {
        o.name: o for o in first if o.name not in removed
    }
    assert_replays(tasks, first)


def assert_replays(tasks, first):
    """Check that a loop which gets the same entries, as text, comes to the same objectives."""
    again = Tasks(tasks.core._kb, first)
    for entry in tasks.journal:
        again.core.step(entry.now) if isinstance(entry.content, entries.Step) else journal.apply(
            again.core, read_entry(entry.now, kind_of(entry.content), values_of(entry.content))
        )
    assert again.core.objectives == tasks.core.objectives


def test_model_without_a_goal_is_as_before(knowledge_base):
    tasks = Tasks(knowledge_base, [OBJECTIVE])
    tasks.settle()
    assert tasks.told == {}
    assert tasks.core.facts.groundings == {"o_move": "scan_slow"}
