"""Carrying out plans, and coming back when none gets there."""

import itertools

import pytest
from rosgraph_manipulator.change.deployment import (
    CancelledError,
    DeploymentError,
    Result,
    Stopwatch,
    deploy,
    durations,
    release,
)
from rosgraph_manipulator.change.tactics import ChangeProcesses, Plan, SetParameters
from rosgraph_manipulator.configuration.configurations import Configuration

OLD = Configuration("old", "f", "old.launch")
NEW = Configuration("new", "f", "new.launch")
SETTING = Plan("parameters", 0.05, (SetParameters("/n", {"speed": 1.0}), ChangeProcesses()))
RESTART = Plan("restart", 0.8, (ChangeProcesses(("/n",), ("/n",)),))


class Recorder:
    """An executor of which some calls fail."""

    def __init__(self, **failures):
        self.calls = []
        self.staying = ()
        self._failures = failures

    def _call(self, name, text=""):
        self.calls.append(f"{name} {text}".strip())
        if name in self._failures:
            raise self._failures[name]

    def begin(self, wanted, plan):
        self._call("begin", f"{wanted.name} by {plan.tactic}")

    def set_parameters(self, server, values):
        self._call("set_parameters", f"{server} {values}")

    def change_processes(self, stop, start):
        self._call("change_processes", f"{stop} {start}")

    def wait_until_ready(self):
        self._call("ready")

    def wait_until_settled(self):
        self._call("settled")

    def restore(self, configuration):
        self._call("restore", configuration.name)

    def release(self, function):
        self._call("release", function)
        return self.staying


def run(executor, plans, last_good=OLD, runs=True):
    return deploy(executor, NEW, plans, last_good, Stopwatch(itertools.count().__next__), runs=runs)


def test_cheapest_plan_that_works_is_the_only_one_carried_out():
    executor = Recorder()
    outcome = run(executor, [SETTING, RESTART])
    assert (outcome.result, outcome.running, outcome.tactic) == (Result.OK, NEW, "parameters")
    assert executor.calls == [
        "begin new by parameters",
        "set_parameters /n {'speed': 1.0}",
        "change_processes () ()",
        "ready",
    ]


def test_configuration_that_runs_is_not_restored_when_its_parameters_cannot_be_put_back():
    executor = Recorder(change_processes=DeploymentError("the master does not answer"))
    outcome = run(executor, [SETTING], last_good=NEW)
    assert (outcome.result, outcome.running) == (Result.FAILED, NEW)
    assert outcome.message == "new: parameters: the master does not answer; it runs on as it did"
    assert "restore new" not in executor.calls
    assert run(executor, [SETTING, RESTART], last_good=NEW).tactic == "rollback"
    assert run(executor, [SETTING]).tactic == "rollback"


def test_started_nodes_must_settle():
    executor = Recorder()
    assert run(executor, [RESTART]).result is Result.OK
    assert executor.calls[-1] == "settled"


def test_tactic_that_fails_falls_through_to_the_next():
    executor = Recorder(set_parameters=DeploymentError("it refuses"))
    outcome = run(executor, [SETTING, RESTART])
    assert (outcome.result, outcome.tactic) == (Result.OK, "restart")
    assert "parameters: it refuses" in outcome.message


@pytest.mark.parametrize("where", ["change_processes", "ready", "settled"])
def test_last_good_configuration_is_restored_when_all_plans_fail(where):
    executor = Recorder(**{where: DeploymentError("it dies")})
    outcome = run(executor, [RESTART])
    assert (outcome.result, outcome.running, outcome.tactic) == (Result.FAILED, OLD, "rollback")
    assert "it dies" in outcome.message
    assert executor.calls[-1] == "restore old"


def test_function_is_released_when_there_is_nothing_to_restore():
    executor = Recorder(ready=DeploymentError("it dies"))
    outcome = run(executor, [RESTART], last_good=None)
    assert (outcome.result, outcome.running) == (Result.GENERAL_ERROR, None)
    assert executor.calls[-1] == "release f"


def test_function_is_released_when_restoring_fails_too():
    executor = Recorder(ready=DeploymentError("it dies"), restore=DeploymentError("so does the old one"))
    outcome = run(executor, [RESTART])
    assert (outcome.result, outcome.running) == (Result.GENERAL_ERROR, None)
    assert "so does the old one" in outcome.message
    assert executor.calls[-1] == "release f"


def test_failing_stop_is_told_and_changes_nothing_else():
    error = DeploymentError("no launcher")
    outcome = run(Recorder(ready=error, restore=error, release=error), [RESTART])
    assert outcome.result is Result.GENERAL_ERROR


def test_request_taken_back_before_anything_was_touched_leaves_what_runs():
    executor = Recorder(begin=CancelledError("taken back"))
    outcome = run(executor, [RESTART])
    assert (outcome.result, outcome.running, outcome.cancelled) == (Result.FAILED, OLD, True)
    assert executor.calls == ["begin new by restart"]


@pytest.mark.parametrize("last_good, result", [(OLD, Result.FAILED), (None, Result.GENERAL_ERROR)])
def test_request_taken_back_where_nothing_whole_runs_is_not_told_to_leave_it(last_good, result):
    executor = Recorder(begin=CancelledError("taken back"))
    outcome = run(executor, [RESTART], last_good=last_good, runs=False)
    assert (outcome.result, outcome.running, outcome.cancelled) == (result, last_good, True)
    assert executor.calls[-1] == ("restore old" if last_good else "release f")


@pytest.mark.parametrize("where", ["change_processes", "ready", "settled"])
def test_request_taken_back_later_goes_back_and_tries_nothing_else(where):
    executor = Recorder(**{where: CancelledError("taken back")})
    outcome = run(executor, [RESTART, RESTART])
    assert (outcome.result, outcome.running, outcome.cancelled) == (Result.FAILED, OLD, True)
    assert executor.calls.count("begin new by restart") == 1


def test_superseded_request_leaves_the_rest_to_the_next_one():
    executor = Recorder(ready=CancelledError("given up", superseded=True))
    outcome = run(executor, [RESTART])
    assert (outcome.result, outcome.running, outcome.cancelled) == (Result.FAILED, None, True)
    assert "restore old" not in executor.calls


def test_no_plan_at_all_restores():
    assert run(Recorder(), []).result is Result.FAILED


def test_stopwatch_adds_up_phases_in_order():
    times = iter([0.0, 1.0, 5.0, 7.0, 8.0, 8.5])
    watch = Stopwatch(times.__next__)
    for name in ("stop", "start", "stop"):
        with watch.phase(name):
            pass
    assert watch.phases == {"stop": 1.5, "start": 2.0}
    assert list(watch.phases) == ["stop", "start"]


def test_launchers_phases_stand_for_the_change_that_went_well():
    phases, launcher = {"plan": 0.1, "change": 1.0, "ready": 0.2}, {"stop": 0.4, "start": 0.6}
    assert list(durations(phases, launcher, True)) == ["plan", "stop", "start", "ready"]
    assert durations(phases, launcher, False) == phases


@pytest.mark.parametrize(("running", "told"), [(OLD, "f is released: old is stopped"), (None, "nothing ran for it")])
def test_released_function_runs_nothing(running, told):
    executor = Recorder()
    outcome = release(executor, "f", running, Stopwatch(itertools.count().__next__))
    assert (outcome.result, outcome.running) == (Result.OK, None)
    assert told in outcome.message
    assert executor.calls == ["release f"]


def test_release_of_a_function_that_failed_says_why_it_did():
    outcome = release(Recorder(), "f", None, Stopwatch(itertools.count().__next__), "old: it died")
    assert outcome.message == "f is released: nothing ran for it, because old: it died"


def test_nodes_that_other_functions_need_are_not_told_to_be_stopped():
    executor = Recorder()
    executor.staying = {"/cell/arm", "/cell/camera"}
    outcome = release(executor, "f", OLD, Stopwatch(itertools.count().__next__))
    told = "f is released: old is given up, and for other functions these of its nodes run on: /cell/arm, /cell/camera"
    assert outcome.message == told


def test_release_that_fails_is_told():
    executor = Recorder(release=DeploymentError("no launcher"))
    outcome = release(executor, "f", OLD, Stopwatch(itertools.count().__next__))
    assert (outcome.result, "no launcher" in outcome.message) == (Result.GENERAL_ERROR, True)
