"""What the launcher reports about its nodes."""

from __future__ import annotations

from dataclasses import dataclass

from metacontrol_msgs.msg import LauncherState

STABLE: str = LauncherState.STABLE
CHANGING: str = LauncherState.CHANGING
RECOVERING: str = LauncherState.RECOVERING
FAILED: str = LauncherState.FAILED
STATES = (STABLE, CHANGING, RECOVERING, FAILED)
"""From the best to the worst."""

ENDING = "the launcher is shutting down"
"""What a launcher answers once it has begun to end. All its nodes end with it, so a successor may be asked the same."""


@dataclass(frozen=True)
class LauncherReport:
    """What the launcher runs for one function: the content of metacontrol_msgs/LaunchedFunction.

    Attributes:
        function: name of the function.
        configuration: name of the configuration; empty where none runs.
        change: number of the last change of this function that was asked for.
        state: STABLE, CHANGING, RECOVERING or FAILED.
        nodes: names of the nodes that should run.
        dead: names of those among them that do not run.
        message: how the last node ended; empty where none did.
    """

    function: str = ""
    configuration: str = ""
    change: int = 0
    state: str = STABLE
    nodes: tuple[str, ...] = ()
    dead: tuple[str, ...] = ()
    message: str = ""
