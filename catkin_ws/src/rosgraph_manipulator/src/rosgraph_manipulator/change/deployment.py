"""One change of configuration: try the plans in order, and restore the last good configuration when all fail."""

from __future__ import annotations

import enum
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

from metacontrol_msgs.msg import ReconfigurationResult

from rosgraph_manipulator.change.tactics import Plan, SetParameters, StepExecutor
from rosgraph_manipulator.configuration.configurations import Configuration


class Result(enum.IntEnum):
    """The result codes of metacontrol_msgs/MvpReconfiguration."""

    OK = ReconfigurationResult.OK
    FAILED = ReconfigurationResult.FAILED
    UNKNOWN = ReconfigurationResult.UNKNOWN_CONFIGURATION
    GENERAL_ERROR = ReconfigurationResult.GENERAL_ERROR


class DeploymentError(Exception):
    """A step of a deployment failed; the message says which one and why."""


class CancelledError(DeploymentError):
    """The request was cancelled. Where it is superseded, another request follows at once, so nothing is restored."""

    def __init__(self, message: str, superseded: bool = False) -> None:
        super().__init__(message)
        self.superseded = superseded


class ChangeExecutor(StepExecutor, Protocol):
    """What a deployment does to the running system. The calls block, and raise DeploymentError."""

    def begin(self, wanted: Configuration, plan: Plan) -> None:
        """Begin a plan for a configuration; nothing is touched yet."""

    def wait_until_ready(self) -> None:
        """Wait until the nodes of the wanted configuration answer, and its topics and its action server are there."""

    def wait_until_settled(self) -> None:
        """Wait for the settling time, in which a node with a fault at its start would die."""

    def restore(self, configuration: Configuration) -> None:
        """Stop all nodes that run for a configuration's function, and start all nodes of the configuration."""

    def release(self, function: str) -> Collection[str]:
        """Stop all nodes that only this function needs, and the robot if none of the others drives it.

        Returns:
            The nodes that stay, because other functions need them.
        """


@dataclass(frozen=True)
class Outcome:
    """How a request ended.

    Attributes:
        result: the result code.
        running: the configuration that runs now. None: no complete configuration runs.
        message: why, in one line.
        tactic: name of the tactic that got there, `rollback`, or empty.
        cancelled: whether the request was cancelled.
        untouched: whether `running` runs on as it did: it may be recovering, or without its launcher.
    """

    result: Result
    running: Configuration | None
    message: str
    tactic: str = ""
    cancelled: bool = False
    untouched: bool = False


@dataclass
class Stopwatch:
    """Measures the phases of a change, in s; a phase that comes twice is added up."""

    clock: Callable[[], float]
    phases: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Measure the time of the body, and add it to a phase."""
        self.phases.setdefault(name, 0.0)
        began = self.clock()
        try:
            yield
        finally:
            self.phases[name] += self.clock() - began


def durations(phases: Mapping[str, float], launcher_phases: Mapping[str, float], ok: bool) -> dict[str, float]:
    """Return the durations of a change's phases, s. Where all went well, the launcher's phases replace `change`."""
    found: dict[str, float] = {}
    for name, duration in phases.items():
        found.update(launcher_phases if ok and name == "change" else {name: duration})
    return found


def deploy(
    executor: ChangeExecutor,
    wanted: Configuration,
    plans: Sequence[Plan],
    last_good: Configuration | None,
    watch: Stopwatch,
    remark: str = "",
    runs: bool = True,
    undoing: Callable[[], object] = lambda: None,
) -> Outcome:
    """Carry out plans until one succeeds; where none does, restore the last good configuration.

    If the wanted configuration is the last good one and no node was touched, it runs on as it did.

    Args:
        executor: carries out steps on the running system.
        wanted: the configuration to deploy.
        plans: the plans, cheapest first.
        last_good: the configuration to restore; None: there is none.
        watch: measures the phases.
        remark: what the plans do besides, in words.
        runs: whether a complete configuration runs now.
        undoing: is called before a request that was taken back is undone.
    """
    reasons: list[str] = []
    whole = runs
    for plan in plans:
        try:
            executor.begin(wanted, plan)
            whole = False
            _carry_out(executor, plan, watch)
        except CancelledError as error:
            reason = f"{wanted.name}: {error}"
            if whole or error.superseded:
                return Outcome(Result.FAILED, last_good if whole else None, reason, cancelled=True, untouched=whole)
            undoing()
            return go_back(executor, wanted.function, last_good, reason, watch, cancelled=True)
        except DeploymentError as error:
            reasons.append(f"{plan.tactic}: {error}")
        else:
            failed = f" ({'; '.join(reasons)})" if reasons else ""
            words = f"{wanted.name} is deployed by {plan.tactic}{failed}{remark and f'; {remark}'}"
            return Outcome(Result.OK, wanted, words, plan.tactic)
    reason = f"{wanted.name}: {'; '.join(reasons) or 'no tactic has a plan'}"
    if last_good == wanted and not any(plan.touched for plan in plans):
        return Outcome(Result.FAILED, last_good, f"{reason}; it runs on as it did", untouched=runs)
    return go_back(executor, wanted.function, last_good, reason, watch)


def release(
    executor: ChangeExecutor, function: str, running: Configuration | None, watch: Stopwatch, failure: str = ""
) -> Outcome:
    """Stop what only one function needs.

    Args:
        executor: carries out steps on the running system.
        function: its name.
        running: the configuration that runs for it; None: none does.
        watch: measures the phases.
        failure: why none does, in words; empty: nothing has failed.
    """
    try:
        with watch.phase("stop"):
            staying = executor.release(function)
    except CancelledError as error:
        return Outcome(Result.FAILED, running, f"{function}: {error}", cancelled=True)
    except DeploymentError as error:
        return Outcome(Result.GENERAL_ERROR, None, f"{function} could not be released: {error}")
    what = f"{running.name} is stopped" if running else f"nothing ran for it{failure and f', because {failure}'}"
    if running and staying:
        what = f"{running.name} is given up, and for other functions these of its nodes run on: "
        what += ", ".join(sorted(staying))
    return Outcome(Result.OK, None, f"{function} is released: {what}", "release")


def go_back(
    executor: ChangeExecutor,
    function: str,
    last_good: Configuration | None,
    reason: str,
    watch: Stopwatch,
    cancelled: bool = False,
) -> Outcome:
    """Restore the last good configuration; where there is none, or it does not come up, stop what is left.

    Args:
        executor: carries out steps on the running system.
        function: its name.
        last_good: the configuration to restore; None: there is none.
        reason: why the change has failed, in words.
        watch: measures the phases.
        cancelled: whether the request was cancelled.
    """
    try:
        if last_good is None:
            reason = f"{reason}; there is no earlier configuration to restore"
        else:
            with watch.phase("rollback"):
                executor.restore(last_good)
            return Outcome(Result.FAILED, last_good, f"{reason}; {last_good.name} was restored", "rollback", cancelled)
    except DeploymentError as error:
        reason = f"{reason}; restoring {last_good.name} failed too: {error}" if last_good else f"{reason}; {error}"
    with watch.phase("stop"):
        try:
            executor.release(function)
        except DeploymentError as error:
            reason = f"{reason}; {error}"
    return Outcome(Result.GENERAL_ERROR, None, reason, cancelled=cancelled)


def _carry_out(executor: ChangeExecutor, plan: Plan, watch: Stopwatch) -> None:
    for step in plan.steps:
        with watch.phase("set" if isinstance(step, SetParameters) else "change"):
            step.run(executor)
    with watch.phase("ready"):
        executor.wait_until_ready()
    if plan.started:
        with watch.phase("settle"):
            executor.wait_until_settled()
