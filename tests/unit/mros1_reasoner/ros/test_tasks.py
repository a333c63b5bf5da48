"""Behaviours and states by which tasks ask for functions, beside a reasoner that stands as the test says."""

import subprocess
import sys
import threading

import pytest
from mros1_reasoner.ros import behaviours, states
from mros1_reasoner.ros.asking import Need, Standing
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Running
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Sequence

NEED = Need("f_grip")


class Reasoner:
    """In place of an Asking: what it is told, and how a function stands."""

    def __init__(self):
        self.standing, self.calls, self.words = Standing.UNFULFILLED, [], ""

    def begin(self):
        self.calls.append("begin")

    def end(self):
        self.calls.append("end")

    def wait(self, _):
        return True

    def look(self):
        return self.standing


@pytest.fixture
def reasoner(monkeypatch):
    found = Reasoner()
    for module in (behaviours, states):
        monkeypatch.setattr(module, "Asking", lambda *_: found)
    return found


class Counter(Behaviour):
    """A task that succeeds with its third tick."""

    count = 0

    def update(self):
        self.count += 1
        return Status.SUCCESS if self.count == 3 else Status.RUNNING


def tick(behaviour, reasoner, *standings):
    """Tick once for each standing; return the statuses."""
    found = []
    for reasoner.standing in standings:
        behaviour.tick_once()
        found.append(behaviour.status)
    return found


U, F, E, W = Standing.UNFULFILLED, Standing.FULFILLED, Standing.ENDED, Standing.WAITING
R, S, X = Status.RUNNING, Status.SUCCESS, Status.FAILURE


@pytest.mark.parametrize(
    ("succeeds", "standings", "statuses", "calls"),
    [
        (False, (W, U, F, U, F), [R, R, R, R, R], ["begin"]),
        (False, (U, E), [R, X], ["begin", "end"]),
        (True, (U, F), [R, S], ["begin"]),
        (True, (F, F, U, F), [S, S, R, S], ["begin"] * 3),  # asked already: it changes nothing
        (True, (F, E), [S, X], ["begin", "begin", "end"]),
    ],
)
def test_leaf_runs_succeeds_and_fails_as_the_function_stands(reasoner, succeeds, standings, statuses, calls):
    leaf = behaviours.PursueObjective("grip", NEED, succeeds=succeeds)
    assert tick(leaf, reasoner, *standings) == statuses
    assert reasoner.calls == calls


def test_interrupted_leaf_gives_the_function_up(reasoner):
    leaf = behaviours.PursueObjective("grip", NEED, succeeds=True)
    tick(leaf, reasoner, F)
    leaf.stop(Status.INVALID)
    assert reasoner.calls == ["begin", "end"]


def test_leaf_beside_its_task_ends_with_it(reasoner):
    task = Counter("task")
    both = Parallel("both", ParallelPolicy.SuccessOnSelected([task]))
    both.add_children([behaviours.PursueObjective("grip", NEED), task])
    assert tick(both, reasoner, F, F, F) == [R, R, S]
    assert reasoner.calls == ["begin", "end"]


def test_precondition_stops_the_task_when_the_function_is_lost(reasoner):
    task = Running("task")
    both = Sequence("both", memory=False)
    both.add_children([behaviours.PursueObjective("grip", NEED, succeeds=True), task])
    tick(both, reasoner, F)
    assert task.status == R
    tick(both, reasoner, E)
    assert (both.status, task.status) == (X, Status.INVALID)


@pytest.mark.parametrize(
    ("pauses", "standings", "statuses", "ticks"),
    [
        (False, (W, U, F, F, F), [R, R, R, R, S], 3),
        (False, (F, U, U), [R, R, S], 3),
        (True, (F, U, U), [R, R, R], 1),
        (True, (F, U, F, F), [R, R, R, S], 3),
        (False, (F, E), [R, X], 1),
        (False, (E,), [X], 0),
    ],
)
def test_decorator_ticks_its_task_while_the_function_is_there(reasoner, pauses, standings, statuses, ticks):
    task = Counter("task")
    while_asked = behaviours.WhileObjective("grip", task, NEED, pauses=pauses)
    assert tick(while_asked, reasoner, *standings) == statuses
    assert task.count == ticks
    assert reasoner.calls == ["begin", *(["end"] if statuses[-1] != R else [])]
    assert task.status != R or statuses[-1] == R


def test_interrupted_decorator_stops_its_task_and_gives_the_function_up(reasoner):
    while_asked = behaviours.WhileObjective("grip", Running("task"), NEED)
    tick(while_asked, reasoner, F)
    while_asked.stop(Status.INVALID)
    assert (while_asked.decorated.status, reasoner.calls) == (Status.INVALID, ["begin", "end"])


class Work(states.State):
    """A task that works until it is asked to end, or ends at once."""

    def __init__(self, endless=False):
        super().__init__(outcomes=["success", "stopped"], input_keys=["thing"])
        self.has_begun, self._endless = threading.Event(), endless

    def execute(self, userdata):
        self.has_begun.set()
        while self._endless and not self.preempt_requested():
            self.has_begun.wait(0.01)
        return "stopped" if self._endless else f"{userdata}"


def execute(state, reasoner, *later):
    """Have a state executed, and do things when its task works; return the outcome."""
    found = []
    thread = threading.Thread(target=lambda: found.append(state.execute("success")), daemon=True)
    thread.start()
    for act in later:
        act()
    thread.join(150)
    assert reasoner.calls[-1] == "end"
    return found[0]


def test_state_has_the_outcomes_and_keys_of_its_task(reasoner):
    state = states.WhileObjective(Work(), NEED)
    assert set(state.get_registered_outcomes()) == {"success", "stopped", "unfulfilled", "preempted"}
    assert set(state.get_registered_input_keys()) == {"thing"}


def test_state_does_its_task_when_the_function_is_there(reasoner):
    work = Work()
    state = states.WhileObjective(work, NEED)

    def begin():
        assert not work.has_begun.is_set()
        reasoner.standing = F

    assert execute(state, reasoner, begin) == "success"


def test_state_is_unfulfilled_when_the_function_is_pursued_no_longer(reasoner):
    reasoner.standing = F
    work = Work(endless=True)

    def lose():
        work.has_begun.wait(150)
        reasoner.standing = E

    assert execute(states.WhileObjective(work, NEED), reasoner, lose) == "unfulfilled"


@pytest.mark.parametrize(("standing", "outcome"), [(F, "stopped"), (U, "preempted")])
def test_preempted_state_ends_its_task(reasoner, standing, outcome):
    reasoner.standing = standing
    work = Work(endless=True)
    state = states.WhileObjective(work, NEED)

    def preempt():
        if standing is F:
            work.has_begun.wait(150)
        state.request_preempt()

    assert execute(state, reasoner, preempt) == outcome
    assert not state.preempt_requested()


def test_node_does_without_py_trees_and_smach():
    code = (
        "import sys, mros1_reasoner.ros.reasoner, mros1_reasoner.ros.states; "
        "print([name for name in ('py_trees', 'pydot') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
