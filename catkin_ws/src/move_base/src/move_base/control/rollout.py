"""Rolls out velocities: where the base moves over a horizon, and whether its footprint stays free of obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from robot_formulas.geometry import Pose, Velocity, inscribed_radius

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.costmap.grid import Geometry
    from move_base.costmap.snapshot import Part, Snapshot

EDGE_SPACING = 0.1
"""Distance between the points that stand for the footprint's edge, m."""

EDGES_AT_ONCE = 2_000_000
"""Points of the edge, at all poses, that are looked at in one go: more of them would need more memory."""


@dataclass(frozen=True)
class Trajectory:
    """A velocity and where it leads.

    Attributes:
        velocity: the command.
        poses: x, y, yaw over the horizon (S, 3).
        cost: its score, m.
    """

    velocity: Velocity
    poses: NDArray[np.float64]
    cost: float


@dataclass(frozen=True)
class Rollout:
    """Sampled velocities (C, 3) and their poses x, y, yaw: three arrays (C, S)."""

    velocities: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    yaw: NDArray[np.float64]

    def only(self, kept: NDArray[np.bool_]) -> Rollout:
        """Return the marked ones (C,)."""
        return Rollout(self.velocities[kept], self.x[kept], self.y[kept], self.yaw[kept])

    def trajectory(self, index: int, cost: float) -> Trajectory:
        """Return one of them with its cost."""
        poses = np.stack([self.x[index], self.y[index], self.yaw[index]], axis=1)
        return Trajectory(Velocity(*(float(value) for value in self.velocities[index])), poses, cost)


def roll_out(velocities: NDArray[np.float64], robot: Pose, horizon: float, steps: int) -> Rollout:
    """Integrate constant velocities (C, 3) in closed form over the horizon (s), to so many poses."""
    times = _times(horizon, steps)
    turns = velocities[:, 2].tolist()
    rates = np.array(sorted(set(turns)))  # few: many velocities turn alike
    which = rates.searchsorted(turns)
    turned = rates[:, None] * times
    # sin(a)/a and (1 - cos(a))/a, whose limits at a = 0 are 1 and 0
    sinc = np.sinc(turned / np.pi).take(which, axis=0)
    cosc = (np.sinc(turned / (2.0 * np.pi)) * np.sin(turned / 2.0)).take(which, axis=0)
    forward = (velocities[:, :1] * sinc - velocities[:, 1:2] * cosc) * times
    left = (velocities[:, :1] * cosc + velocities[:, 1:2] * sinc) * times
    cos, sin = np.cos(robot.yaw), np.sin(robot.yaw)
    return Rollout(
        velocities,
        robot.x + cos * forward - sin * left,
        robot.y + sin * forward + cos * left,
        (robot.yaw + turned).take(which, axis=0),
    )


class Footprint:
    """A footprint: points along its edge (N, 2), its two radii, and the margin kept around it, m."""

    def __init__(self, corners: NDArray[np.float64], margin: float) -> None:
        self.margin = margin
        pieces = []
        for corner, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            count = max(1, int(np.ceil(np.hypot(*(following - corner)) / EDGE_SPACING)))
            fractions = np.arange(count)[:, None] / count
            pieces.append(corner + fractions * (following - corner))
        self.edge = np.concatenate(pieces)
        self._edge_x, self._edge_y = self.edge.T.copy()  # each in one piece
        self.inscribed = inscribed_radius(corners)
        self.circumscribed = float(np.hypot(*corners.T).max())

    def is_free(self, rollout: Rollout, snapshot: Snapshot) -> NDArray[np.bool_]:
        """Whether each trajectory keeps the footprint free of obstacles (C,); outside the costmap nothing is free.

        The clearance of the robot's centre decides most poses; the edge is looked at only in between.
        """
        g = snapshot.geometry
        rows, columns = g.cells_at(rollout.x, rollout.y)
        reach = math.ceil(self.circumscribed / g.resolution) + 1
        needed_rows = int(rows.min()) - reach, int(rows.max()) + reach
        needed_columns = int(columns.min()) - reach, int(columns.max()) + reach
        part = snapshot.part(needed_rows, needed_columns)
        amid = part.covers(needed_rows, needed_columns)  # no edge is outside the costmap
        clearance = part.clearance_at(rows, columns) if amid else _clearance(part, rows, columns, g)
        margin = self.margin + 0.5 * g.resolution  # clearances end at the middle of an obstacle's cell
        blocked: NDArray[np.bool_] = np.any(clearance <= self.inscribed + margin, axis=1)
        unsure = (clearance <= self.circumscribed + margin) & ~blocked[:, None]
        if unsure.any():
            cells = np.flatnonzero(unsure)
            size = max(1, EDGES_AT_ONCE // len(self.edge))
            for some in (cells[start : start + size] for start in range(0, len(cells), size)):
                which = some // unsure.shape[1]
                x, y, yaw = (axis.take(some)[:, None] for axis in (rollout.x, rollout.y, rollout.yaw))
                columns, rows = self._edge_cells(x, y, yaw, g)
                if not amid:
                    np.clip(columns, 0, g.width - 1, out=columns)
                    np.clip(rows, 0, g.height - 1, out=rows)
                touching = (part.clearance_at(rows, columns) <= margin).any(axis=1)
                blocked[which[touching]] = True
        return ~blocked

    def is_free_at(self, robot: Pose, snapshot: Snapshot) -> bool:
        """Whether the footprint is free of obstacles at one pose, as `is_free` has it."""
        g = snapshot.geometry
        scale = 1.0 / g.resolution
        row, column = math.floor((robot.y - g.origin_y) * scale), math.floor((robot.x - g.origin_x) * scale)
        if 0 <= row < g.height and 0 <= column < g.width:
            part = snapshot.part((row, row), (column, column))
            clearance = part.clearance[row - part.row, column - part.column]
            margin = self.margin + 0.5 * g.resolution
            if clearance <= self.inscribed + margin:
                return False
            if clearance > self.circumscribed + margin:
                return True
        pose = (np.array([[value]]) for value in (robot.x, robot.y, robot.yaw))
        return bool(self.is_free(Rollout(np.zeros((1, 3)), *pose), snapshot)[0])

    def _edge_cells(
        self, x: NDArray[np.float64], y: NDArray[np.float64], yaw: NDArray[np.float64], g: Geometry
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return columns and rows (P, N) of the edge at poses, three arrays (P, 1)."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        # In place: new arrays of this size would cost more than the numbers in them.
        edge_x, edge_y = cos * self._edge_x, sin * self._edge_x
        edge_x += x
        edge_x -= sin * self._edge_y
        edge_y += y
        edge_y += cos * self._edge_y
        edge_x -= g.origin_x
        edge_x *= 1.0 / g.resolution
        edge_y -= g.origin_y
        edge_y *= 1.0 / g.resolution
        return edge_x.astype(np.intp), edge_y.astype(np.intp)


@lru_cache(maxsize=64)
def _times(horizon: float, steps: int) -> NDArray[np.float64]:
    """Return the moments of a roll-out (steps,), s."""
    return np.linspace(horizon / steps, horizon, steps)


def _clearance(part: Part, rows: NDArray[np.intp], columns: NDArray[np.intp], g: Geometry) -> NDArray[np.float32]:
    """Return the clearance of cells, 0 m outside the costmap."""
    inside = (rows >= 0) & (rows < g.height) & (columns >= 0) & (columns < g.width)
    nearest = part.clearance_at(rows.clip(0, g.height - 1), columns.clip(0, g.width - 1))
    return np.where(inside, nearest, np.float32(0.0))
