"""One change of configuration: the plans one after the other, and the way back when none gets there."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Mapping, Sequence
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
    """A step of a deployment failed; the message says which and why."""


class CancelledError(DeploymentError):
    """The request was taken back, or, where it is superseded, another one takes its place at once."""

    def __init__(self, message: str, superseded: bool = False) -> None:
        super().__init__(message)
        self.superseded = superseded


class ChangeExecutor(StepExecutor, Protocol):
    """What a deployment needs of the running system; the calls block, and raise DeploymentError."""

    def begin(self, wanted: Configuration, plan: Plan) -> None:
        """Prepare the way to a configuration by a plan; nothing is touched."""

    def wait_until_ready(self) -> None:
        """Wait until the wanted configuration's nodes answer and what it offers is there."""

    def wait_until_settled(self) -> None:
        """Wait until nodes that were started are past the age at which most that die early are dead."""

    def restore(self, configuration: Configuration) -> None:
        """Stop what runs, and start all of a configuration."""

    def stop_everything(self) -> None:
        """Stop what the launcher runs, and the robot."""


@dataclass(frozen=True)
class Outcome:
    """How a request ended.

    Attributes:
        result: the code.
        running: the configuration that runs now; None: none does, or, where a request was superseded, a part of one.
        message: why, in one line.
        tactic: name of the tactic that got there, `rollback`, or empty.
        cancelled: whether the request was taken back.
    """

    result: Result
    running: Configuration | None
    message: str
    tactic: str = ""
    cancelled: bool = False


@dataclass
class Stopwatch:
    """Durations of a change's phases, s, in the order in which they first began."""

    clock: Callable[[], float]
    phases: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Add the time that the body takes to a phase."""
        self.phases.setdefault(name, 0.0)
        began = self.clock()
        try:
            yield
        finally:
            self.phases[name] += self.clock() - began


def durations(phases: Mapping[str, float], launcher_phases: Mapping[str, float], ok: bool) -> dict[str, float]:
    """Return the durations of a change's phases; the launcher's own take the place of `change` where all went well."""
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
) -> Outcome:
    """Carry out the first plan that gets to the wanted configuration; where none does, restore the last good one.

    Args:
        executor: the running system.
        wanted: the configuration to deploy.
        plans: cheapest first.
        last_good: what ran before and may be restored; None: there is nothing to go back to.
        watch: takes the durations.
    """
    reasons: list[str] = []
    touched = False
    for plan in plans:
        try:
            executor.begin(wanted, plan)
            touched = True
            _carry_out(executor, plan, watch)
        except CancelledError as error:
            reason = f"{wanted.name}: {error}"
            if not touched or error.superseded:
                return Outcome(Result.FAILED, None if touched else last_good, reason, cancelled=True)
            return _go_back(executor, last_good, reason, watch, cancelled=True)
        except DeploymentError as error:
            reasons.append(f"{plan.tactic}: {error}")
        else:
            failed = f" ({'; '.join(reasons)})" if reasons else ""
            return Outcome(Result.OK, wanted, f"{wanted.name} is deployed by {plan.tactic}{failed}", plan.tactic)
    return _go_back(executor, last_good, f"{wanted.name}: {'; '.join(reasons) or 'no tactic has a plan'}", watch)


def _carry_out(executor: ChangeExecutor, plan: Plan, watch: Stopwatch) -> None:
    for step in plan.steps:
        with watch.phase("set" if isinstance(step, SetParameters) else "change"):
            step.run(executor)
    with watch.phase("ready"):
        executor.wait_until_ready()
    if plan.started:
        with watch.phase("settle"):
            executor.wait_until_settled()


def _go_back(
    executor: ChangeExecutor, last_good: Configuration | None, reason: str, watch: Stopwatch, cancelled: bool = False
) -> Outcome:
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
            executor.stop_everything()
        except DeploymentError as error:
            reason = f"{reason}; {error}"
    return Outcome(Result.GENERAL_ERROR, None, reason, cancelled=cancelled)
