"""The sequence of a reconfiguration: stop, start, wait until ready; and back when that fails."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

from rosgraph_manipulator.configuration import Configuration


class Result(enum.IntEnum):
    """The result codes of metacontrol_msgs/MvpReconfiguration."""

    OK = 1
    FAILED = 0
    UNKNOWN = -1
    GENERAL_ERROR = -2


class DeploymentError(Exception):
    """A step of a deployment failed; the message says which and why."""


class Platform(Protocol):
    """What a deployment needs of the running system. Every call blocks until done or its deadline is over."""

    def stop(self) -> None:
        """Stop the running configuration and wait until its nodes are gone."""

    def start(self, configuration: Configuration) -> None:
        """Start a configuration's nodes and wait until they are ready."""


@dataclass(frozen=True)
class Outcome:
    """How a request ended: the code, the configuration that runs now (None: none does), and why."""

    result: Result
    running: Configuration | None
    message: str


def deploy(platform: Platform, wanted: Configuration, last_good: Configuration | None) -> Outcome:
    """Replace what runs by the wanted configuration; on failure restore the last good one."""
    try:
        platform.stop()
        platform.start(wanted)
    except DeploymentError as error:
        return _restore(platform, last_good, f"{wanted.name}: {error}")
    return Outcome(Result.OK, wanted, f"{wanted.name} is deployed")


def _restore(platform: Platform, last_good: Configuration | None, reason: str) -> Outcome:
    try:
        platform.stop()
        if last_good is None:
            return Outcome(Result.GENERAL_ERROR, None, f"{reason}; there is no earlier configuration to restore")
        platform.start(last_good)
    except DeploymentError as error:
        return Outcome(Result.GENERAL_ERROR, None, f"{reason}; restoring the last good one failed too: {error}")
    return Outcome(Result.FAILED, last_good, f"{reason}; {last_good.name} was restored")
