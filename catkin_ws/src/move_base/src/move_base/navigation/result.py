"""The state of the navigator, and the result of one step."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose, Velocity

    from move_base.control.rollout import Trajectory
    from move_base.planning.global_planner import Plan


class State(Enum):
    """What the navigator is doing."""

    IDLE = "idle"
    PLANNING = "planning"
    CONTROLLING = "controlling"
    RECOVERING = "recovering"


class Outcome(Enum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"


@dataclass(frozen=True)
class RecoveryStatus:
    """A recovery behaviour that begins: its name, its index in the sequence, and the length of the sequence."""

    name: str
    index: int
    count: int


@dataclass(frozen=True)
class Result:
    """What one step decided.

    Attributes:
        velocity: the command; None where nothing is to be sent.
        robot: pose in the global frame, if known.
        outcome: set when the goal has just ended.
        text: the reason of the outcome.
        warning: something the operator should know; repeated as long as it holds.
        new_plan: the plan, where a new one was taken.
        path: what the controller followed, in the local frame.
        trajectory: what it chose.
        recovery: the recovery behaviour that begins.
    """

    velocity: Velocity | None = None
    robot: Pose | None = None
    outcome: Outcome | None = None
    text: str = ""
    warning: str = ""
    new_plan: Plan | None = None
    path: NDArray[np.float64] | None = None
    trajectory: Trajectory | None = None
    recovery: RecoveryStatus | None = None
