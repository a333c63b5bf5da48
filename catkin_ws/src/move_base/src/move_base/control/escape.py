"""The way out for a robot that touches an obstacle: slow moves that never cover more of it, and in the end less."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from move_base.control.rollout import Rollout, Trajectory, roll_out

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from move_base.control.rollout import Footprint
    from move_base.costmap.snapshot import Snapshot
    from move_base.parameters.parameters import ControllerParameters

SLOW = 0.1
"""Speed ahead where `min_vel_x` is less, m/s: the default of `escape_vel`."""

SPACING = 0.025
"""Distance between the points that stand for the area of the footprint, m: half of a usual cell."""

MOST_POINTS = 40
"""As many points along each axis at the most, for large robots."""

STEPS = 16
"""Poses per move."""


class Escape:
    """Counts the points of the footprint's area that are in an obstacle."""

    def __init__(self, corners: NDArray[np.float64], footprint: Footprint) -> None:
        self._footprint = footprint
        low, high = corners.min(axis=0), corners.max(axis=0)
        counts = [min(MOST_POINTS, math.ceil(size / SPACING) + 1) for size in (high - low).tolist()]
        x, y = (np.linspace(*ends) for ends in zip(low, high, counts, strict=True))
        grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        outline = corners.astype(np.float32)
        inside = [cv2.pointPolygonTest(outline, point, False) > 0 for point in grid.tolist()]
        self._points = np.concatenate([grid[inside], footprint.edge])

    def best(self, samples: NDArray[np.float64], robot: Pose, horizon: float, snapshot: Snapshot) -> Trajectory | None:
        """Return the move that covers least of the obstacles, or None where none leads out.

        Args:
            samples: velocities (C, 3).
            robot: in the local costmap's frame.
            horizon: s.
            snapshot: the local costmap.
        """
        here = Rollout(np.zeros((1, 3)), *(np.array([[value]]) for value in (robot.x, robot.y, robot.yaw)))
        now = self._touched(here, snapshot)[0, 0]
        rollout = roll_out(samples, robot, horizon, STEPS)
        touched = self._touched(rollout, snapshot)
        allowed = np.maximum.accumulate(touched, axis=1) <= now
        leads_out = allowed[:, -1] & (touched[:, -1] < now)
        if leads_out.any():
            return rollout.trajectory(int(np.where(leads_out, touched.mean(axis=1), np.inf).argmin()), 0.0)
        # One may set the robot free and touch again later. What follows is decided anew in each period.
        sets_free = (allowed & (touched == 0.0)).any(axis=1)
        return rollout.trajectory(int(sets_free.argmax()), 0.0) if sets_free.any() else None

    def _touched(self, rollout: Rollout, snapshot: Snapshot) -> NDArray[np.float64]:
        """Return how many points are in an obstacle, or outside the costmap, at each pose (C, S).

        One half more where the pose is not free: the check for that looks at whole cells, and is stricter.
        """
        g = snapshot.geometry
        cos, sin = np.cos(rollout.yaw)[..., None], np.sin(rollout.yaw)[..., None]
        x, y = self._points.T
        rows, columns = g.cells_at(rollout.x[..., None] + cos * x - sin * y, rollout.y[..., None] + sin * x + cos * y)
        outside = (rows < 0) | (rows >= g.height) | (columns < 0) | (columns >= g.width)
        rows, columns = rows.clip(0, g.height - 1), columns.clip(0, g.width - 1)
        occupied = snapshot.part_with(rows, columns).clearance_at(rows, columns) <= 0.5 * g.resolution
        poses = Rollout(np.zeros((rollout.x.size, 3)), *(a.reshape(-1, 1) for a in (rollout.x, rollout.y, rollout.yaw)))
        blocked = ~self._footprint.is_free(poses, snapshot).reshape(rollout.x.shape)
        return np.asarray((occupied | outside).sum(axis=-1) + 0.5 * blocked)


def escape_samples(parameters: ControllerParameters) -> NDArray[np.float64]:
    """Return slow moves in all directions that the base can take (C, 3)."""
    p = parameters
    turn = p.min_in_place_vel_theta
    samples = [(p.escape_vel, 0.0, 0.0)] if p.escape_vel else []
    samples += [(0.0, lateral, 0.0) for lateral in p.y_vels]
    samples += [(min(max(p.min_vel_x, SLOW), p.max_vel_x), 0.0, 0.0), (0.0, 0.0, turn), (0.0, 0.0, -turn)]
    return np.array(samples)
