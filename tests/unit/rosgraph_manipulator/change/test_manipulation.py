"""What becomes of a change that can't begin, or breaks off for an error that is none of a deployment."""

from types import SimpleNamespace

import pytest
from metacontrol_msgs.msg import FunctionGrounding
from rosgraph_launcher.description import SystemDescription
from rosgraph_manipulator.change.deployment import DeploymentError, Result
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

    def __init__(self, compare=None, change=None, nodes=False):
        self.done, self._compare, self._change, self._nodes = [], compare, change, nodes
        self.system = SimpleNamespace(compare=self.compare, nodes=SimpleNamespace(adjustable=lambda _: None))

    def compare(self, wanted, restart):
        if self._compare:
            raise self._compare
        return Comparison(SystemDescription({}, {}), SystemDescription({}, {}), frozenset(), {})

    def change_processes(self, stop, start):
        self.done.append("touched")
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
        pass

    def stop_robot(self, function):
        pass


class Told(list):
    """What is announced."""

    def begin(self, states):
        pass

    def announce(self, configuration, state, outcome=None, phases=None):
        self.append((configuration.name, state))

    def diagnose(self, ok, message, configuration):
        pass


def manipulation(executor, running):
    told = Told()
    log = SimpleNamespace(info=lambda *_: None, warn=lambda *_: None, error=lambda *_: None)
    made = Manipulation(
        ManipulatorOptions({"a": A, "b": B}),
        {"all": lambda difference, facts: Plan("all", 1.0, (ChangeProcesses(("n",), ("n",)),))},
        5.0,
        executor,
        told,
        SimpleNamespace(update=lambda change: change(Journal(), 0.0)),
        SimpleNamespace(now=lambda: 0.0, log=log, failures=(OSError,)),
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


def test_change_that_can_not_begin_leaves_what_runs():
    executor = Executor(compare=OSError("no such file"))
    manipulator, _ = manipulation(executor, running="a")
    assert manipulator.carry_out(Order("f", "b")).running == A
    assert executor.done == []


def test_change_that_can_not_begin_stops_what_is_left_where_nothing_whole_runs():
    executor = Executor(compare=DeploymentError("no such file"), nodes=True)
    manipulator, told = manipulation(executor, running="")
    outcome = manipulator.carry_out(Order("f", "b"))
    assert executor.done == ["f released"]
    assert (outcome.result, outcome.running) == (Result.GENERAL_ERROR, None)
    assert told[-1] == ("b", FunctionGrounding.FAILED)


def test_change_that_can_not_begin_asks_the_launcher_nothing_where_it_has_no_nodes():
    executor = Executor(compare=DeploymentError("no such file"))
    manipulator, _ = manipulation(executor, running="")
    assert manipulator.carry_out(Order("f", "b")).result is Result.GENERAL_ERROR
    assert executor.done == []
