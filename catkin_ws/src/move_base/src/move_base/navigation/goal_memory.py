"""The navigator's memory of one goal."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from move_base.navigation.recovery import Recovery

if TYPE_CHECKING:
    from robot_formulas.geometry import Pose


@dataclass
class Work:
    """What is remembered for one goal; times in s.

    Attributes:
        planned_well: last time that a plan was found, or that waiting for one began.
        controlled: the same for a free velocity.
        anchored: when the robot was at `anchor`, which follows it by steps of the oscillation distance.
        anchor: see above.
        planned: when planning was last tried.
        planning_error: why it failed.
        failed_plans: how often, since `planned_well`.
        stale_since: since when sensor data are too old.
        not_ready_since: since when map or transforms are missing.
        reached_xy: whether the robot was within the goal's position tolerance.
        turned: heading at which the robot was last seen to turn to the goal's, rad; None: it has not begun.
        recovery: what was tried against being stuck.
    """

    planned_well: float
    controlled: float
    anchored: float
    anchor: Pose | None = None
    planned: float = -math.inf
    planning_error: str = ""
    failed_plans: int = 0
    stale_since: float | None = None
    not_ready_since: float | None = None
    reached_xy: bool = False
    turned: float | None = None
    recovery: Recovery = field(default_factory=Recovery)

    @classmethod
    def begun(cls, now: float) -> Work:
        """Return the memory of a goal on which work begins at a time in s."""
        return cls(planned_well=now, controlled=now, anchored=now)

    def restart_patience(self, now: float) -> None:
        """Restart the patience of planner, controller and oscillation, also while the robot has to stand still."""
        self.planned_well = self.controlled = self.anchored = now
        self.failed_plans = 0
        self.anchor = None
