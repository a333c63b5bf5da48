"""What becomes of a change that can't begin, or breaks off for an error that is none of a deployment."""

from types import SimpleNamespace

import pytest
from metacontrol_msgs.msg import FunctionGrounding
from rosgraph_launcher.description import SystemDescription
from rosgraph_launcher.launching.report import RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.change.deployment import CancelledError, DeploymentError, Result
from rosgraph_manipulator.change.journal import Journal, Resumption
from rosgraph_manipulator.change.manipulation import Manipulation
from rosgraph_manipulator.change.requests import Order
from rosgraph_manipulator.change.running_system import Comparison
from rosgraph_manipulator.change.tactics import ChangeProcesses, Plan
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions

A, B = Configuration("a", "f", "a.launch"), Configuration("b", "f", "b.launch")


class Executor:
    """Notes what is done; `compare` and `change_processes` raise what a test wants."""

    launcher_phases: dict = {}
    losses = 0
    launcher_gone = taken_back = False
    launcher_answers = True
    halts = 0
    now = 0.0
    launched = LauncherReport("f", "a", state=STABLE)

    def __init__(self, compare=None, change=None, nodes=False):
        self.done, self._compare, self._change, self._nodes = [], compare, change, nodes
        self.cleared = []
        self.system = SimpleNamespace(compare=self.compare, nodes=SimpleNamespace(adjustable=lambda _: None))

    def compare(self, wanted, restart):
        if self._compare:
            raise self._compare
        return Comparison(SystemDescription({}, {}), SystemDescription({}, {}), frozenset(), {})

    def require_launchers(self, configuration):
        if not self.launcher_answers:
            raise DeploymentError("the launcher does not answer")

    def change_processes(self, stop, start):
        self.done.append("touched")
        if self._change:
            raise self._change

    def has_nodes(self, function):
        return self._nodes

    def restore(self, configuration):
        self.done.append(f"{configuration.name} restored")

    def release(self, function):
        self.done.append(f"{function} released")
        return frozenset()

    def adopt(self, configuration):
        pass

    def begin(self, wanted, plan):
        if self.taken_back:
            raise CancelledError("taken back")

    def wait_until_ready(self):
        pass

    def wait_until_settled(self):
        pass

    def stop_robot(self, function):
        self.halts += 1

    def launcher_has_ended(self, function):
        return self.launcher_gone

    def clear(self, function):
        self.cleared.append(function)

    def expect_nothing(self, function):
        self.done.append(f"nothing of {function} expected")

    def catch_up(self):
        pass

    def begin_recovery(self, report, goes_on=False):
        self.done.append(("recovers", *report.dead, goes_on))

    def end_recovery(self, function):
        pass

    def take_deaths(self, function):
        return None

    def report(self, function):
        return self.launched


class Told(list):
    """What is announced."""

    def begin(self, states):
        pass

    def announce(self, configuration, state, outcome=None, phases=None):
        self.append((configuration.name, state))
        self.outcome = outcome

    def diagnose(self, ok, message, configuration):
        pass


class Keeper:
    """Keeps the journal."""

    def __init__(self):
        self.journal = Journal()

    def update(self, change):
        self.journal = change(self.journal, 0.0)


def manipulation(executor, running, keeper=None):
    told = Told()
    log = SimpleNamespace(info=lambda *_: None, warn=lambda *_: None, error=lambda *_: None)
    made = Manipulation(
        ManipulatorOptions({"a": A, "b": B}),
        {"all": lambda difference, facts: Plan("all", 1.0, (ChangeProcesses(("n",), ("n",)),))},
        5.0,
        executor,
        told,
        keeper or Keeper(),
        SimpleNamespace(now=lambda: executor.now, log=log, failures=(OSError,)),
        lambda runs: None,
    )
    made.begin({"f": Resumption(running=running)})
    return made, told


@pytest.mark.parametrize("error", [OSError("no space left"), DeploymentError("the launcher is gone")])
def test_change_that_breaks_off_half_way_is_undone(error):
    executor = Executor(change=error)
    manipulator, told = manipulation(executor, running="a")
    outcome = manipulator.carry_out(Order("f", "b"))
    assert executor.done == ["touched", "a restored"]
    assert (outcome.result, outcome.running) == (Result.FAILED, A)
    assert str(error) in outcome.message
    assert told[-1] == ("a", FunctionGrounding.STABLE)


@pytest.mark.parametrize(("running", "wanted", "undo"), [("a", "a", "restore"), ("", "", "release")])
def test_request_that_was_taken_back_is_not_finished_by_the_next_manipulator(monkeypatch, running, wanted, undo):
    executor, keeper, noted = Executor(change=CancelledError("taken back")), Keeper(), []
    manipulator, _ = manipulation(executor, running, keeper)
    monkeypatch.setattr(executor, undo, lambda _: noted.append(keeper.journal.wanted) or frozenset())
    manipulator.carry_out(Order("f", "b"))
    assert noted == [wanted]


def test_change_that_can_not_begin_leaves_what_runs():
    executor = Executor(compare=OSError("no such file"))
    manipulator, _ = manipulation(executor, running="a")
    assert manipulator.carry_out(Order("f", "b")).running == A
    assert executor.done == []


@pytest.mark.parametrize(("running", "result"), [("a", Result.FAILED), ("", Result.GENERAL_ERROR)])
def test_change_without_a_launcher_touches_nothing(running, result):
    executor = Executor()
    executor.launcher_answers = False
    manipulator, _ = manipulation(executor, running)
    assert manipulator.carry_out(Order("f", "b")).result is result
    assert not {"touched", "a restored", "f released"}.intersection(executor.done)
    executor.launcher_answers = True
    assert manipulator.carry_out(Order("f", "b")).result is Result.OK


def test_change_that_can_not_begin_stops_what_is_left_where_nothing_whole_runs():
    executor = Executor(compare=DeploymentError("no such file"), nodes=True)
    manipulator, told = manipulation(executor, running="")
    outcome = manipulator.carry_out(Order("f", "b"))
    assert executor.done == ["f released", "nothing of f expected"]
    assert (outcome.result, outcome.running) == (Result.GENERAL_ERROR, None)
    assert told[-1] == ("b", FunctionGrounding.FAILED)


@pytest.mark.parametrize("failure", [DeploymentError("no answer in time"), OSError("no answer in time")])
@pytest.mark.parametrize("asked", [False, True])
def test_torn_function_that_can_not_be_stopped_has_failed(failing, failure, asked):
    executor = Executor(change=CancelledError("given up for a", superseded=True))
    manipulator, told = manipulation(executor, running="")
    manipulator.carry_out(Order("f", "b"))
    assert told[-1] == ("b", FunctionGrounding.RECONFIGURING)  # what it was given up for follows
    failing(executor, "release", failure, times=1)
    if asked:
        assert "no answer in time" in manipulator.carry_out(Order("f", "")).message
    else:
        manipulator.make_whole("f")  # it was taken back
    assert told[-1] == ("b", FunctionGrounding.FAILED)
    assert executor.halts == 1
    manipulator.make_whole("f")
    assert executor.done == ["touched", "nothing of f expected"]


def test_what_could_not_be_stopped_is_stopped_later(failing):
    executor = Executor(change=DeploymentError("the launcher hangs"))
    manipulator, told = manipulation(executor, running="a")
    for undo in ("restore", "release"):
        failing(executor, undo, DeploymentError("the launcher hangs"), times=1)
    manipulator.carry_out(Order("f", "b"))
    assert told[-1] == ("b", FunctionGrounding.FAILED)
    assert executor.done == ["touched", "nothing of f expected"]
    manipulator.look()
    assert executor.cleared == ["f"]


def test_change_that_can_not_begin_asks_the_launcher_nothing_where_it_has_no_nodes():
    executor = Executor(compare=DeploymentError("no such file"))
    manipulator, _ = manipulation(executor, running="")
    assert manipulator.carry_out(Order("f", "b")).result is Result.GENERAL_ERROR
    assert executor.done == ["nothing of f expected"]


@pytest.mark.parametrize("compare", [DeploymentError("no such file"), None])
def test_request_that_touches_nothing_does_not_end_a_recovery(compare):
    executor = Executor(compare=compare)
    executor.taken_back = True
    manipulator, told = manipulation(executor, running="a")
    stable, executor.launched = executor.launched, LauncherReport("f", "a", state=RECOVERING)
    manipulator.follow_launcher()
    manipulator.carry_out(Order("f", "b"))
    assert told[-1] == ("a", FunctionGrounding.RECOVERING)
    executor.launched = stable
    manipulator.follow_launcher()
    assert told[-1] == ("a", FunctionGrounding.STABLE)
    manipulator.carry_out(Order("f", "b"))
    assert told[-1] == ("a", FunctionGrounding.STABLE)


def test_death_during_a_recovery_is_dealt_with_and_announced_once():
    executor = Executor()
    manipulator, told = manipulation(executor, running="a")
    for dead in (("/n",), ("/n", "/m")):
        executor.launched = LauncherReport("f", "a", state=RECOVERING, dead=dead)
        manipulator.follow_launcher()
    assert executor.done == [("recovers", "/n", False), ("recovers", "/m", True)]
    assert told == [("a", FunctionGrounding.RECOVERING)]


# -- the launcher has ended


def test_function_whose_launcher_stays_away_is_told_as_recovering_until_it_is_deployed_again():
    executor = Executor()
    manipulator, told = manipulation(executor, running="a")
    executor.launcher_gone = True
    for executor.now in (10.0, 11.5):
        manipulator.look()
    assert told == []
    for executor.now in (12.5, 14.0):
        manipulator.look()
        manipulator.follow_launcher()  # another host's launcher has reported
    assert told == [("a", FunctionGrounding.RECOVERING)]
    assert told.outcome.message == "rosgraph_launcher has ended, and its nodes with it"
    assert executor.halts == 1
    executor.launcher_gone, executor.launched = False, LauncherReport("f")
    manipulator.follow_launcher()
    assert told[1:] == [("a", FunctionGrounding.RECONFIGURING), ("a", FunctionGrounding.STABLE)]
