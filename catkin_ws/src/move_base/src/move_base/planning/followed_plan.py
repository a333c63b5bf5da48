"""The plan that the robot follows, and how far the robot has come."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from move_base.planning.global_planner import PATH_SPACING, Plan, path_cost

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from move_base.costmap.snapshot import Snapshot

LOOKAHEAD = 3.0
"""Length of the plan that the controller is given, m: twice what 0.75 m/s covers in a sim_time of 2 s."""

PATH_STEP = 2
"""The controller is given every second point of the plan (0.1 m)."""

SEARCHED_POINTS = 60
"""The robot is looked for along so many points from where it was: 3 m."""

KEEP_RATIO = 0.9
"""A new plan replaces a free one only if it costs less than this share of it: equal ways must not alternate."""

KEEP_DISTANCE = 0.3
"""Farther than this from its plan (m) the robot takes the new one in any case."""


@dataclass
class FollowedPlan:
    """A plan with the index of its point nearest to the robot."""

    plan: Plan
    progress: int = 0

    def cost_left(self, robot: Pose, snapshot: Snapshot, *, allow_unknown: bool) -> float:
        """Return the cost of what remains, in weighted metres; infinite where it is blocked or far away."""
        points = self._rest(robot)
        if math.hypot(points[0, 0] - robot.x, points[0, 1] - robot.y) > KEEP_DISTANCE:
            return math.inf
        return path_cost(points, snapshot, allow_unknown=allow_unknown)

    def is_better_than(self, new: Plan, robot: Pose, snapshot: Snapshot, *, allow_unknown: bool) -> bool:
        """Whether the robot keeps this plan although there is a new one."""
        if self.plan.goal != new.goal:
            return False
        kept = self.cost_left(robot, snapshot, allow_unknown=allow_unknown)
        cost = path_cost(new.points, snapshot, allow_unknown=allow_unknown)
        return kept < math.inf and cost > KEEP_RATIO * kept

    def ahead(self, robot: Pose) -> tuple[NDArray[np.float64], float]:
        """Return the next metres of the plan, at least two points (N, 2), and the length left to its end (m)."""
        points = self._rest(robot)
        count = round(LOOKAHEAD / PATH_SPACING)
        ahead = points[: count + 1 : PATH_STEP]
        if len(points) <= count or len(ahead) < 2:
            ahead = np.vstack([ahead, points[-1:]])
        return ahead, float(self.plan.lengths[self.progress :].sum())

    def _rest(self, robot: Pose) -> NDArray[np.float64]:
        """Move on to the nearest point within the next few metres, and return what is left from there."""
        window = self.plan.points[self.progress : self.progress + SEARCHED_POINTS]
        squared = (window[:, 0] - robot.x) ** 2 + (window[:, 1] - robot.y) ** 2
        self.progress += int(squared.argmin())
        return self.plan.points[self.progress :]
