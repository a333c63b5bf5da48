"""Layered costmaps: static map, obstacles seen by sensors, inflation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import ORIGIN, Pose, inscribed_radius

from move_base.costmap.grid import FREE, LETHAL, Geometry
from move_base.costmap.inflation import Inflation
from move_base.costmap.static_map import bounding_geometry, resample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from move_base.costmap.sensors import Observation
    from move_base.costmap.static_map import StaticMap
    from move_base.parameters.parameters import CostmapParameters

MAX_RAY_GAP = math.radians(3.0)
"""Neighbouring rays farther apart than this leave what lies between them as it was."""

CLOUD_BIN = math.radians(1.0)
"""Width of the sectors in which a cloud's nearest return bounds what is cleared: over twice a depth camera's column."""

SUBPIXEL_BITS = 4
"""Fixed-point digits of cv2's polygon corners: 1/16 cell."""


@dataclass(frozen=True)
class Snapshot:
    """A costmap at one moment; its arrays are never written to again.

    Attributes:
        geometry: where the grid lies.
        costs: 0..255 (H, W).
        clearance: distance from each cell's centre to the nearest obstacle cell's centre (H, W), m, never beyond
            `clearance_limit`.
        clearance_limit: larger distances are not told apart, m.
        inscribed_radius: of the padded footprint, m.
    """

    geometry: Geometry
    costs: NDArray[np.uint8]
    clearance: NDArray[np.float32]
    clearance_limit: float
    inscribed_radius: float


class Costmap:
    """One costmap, built up from the layers of its parameters."""

    def __init__(self, parameters: CostmapParameters) -> None:
        self.parameters = parameters
        self.geometry = self._initial_geometry()
        self.reconfigure(parameters)
        self._static_layer = next(iter(parameters.layers_of("static")), None)
        self._static: StaticMap | None = None
        self._static_costs: NDArray[np.uint8] | None = None
        self._static_placed: tuple[Geometry, Pose] | None = None
        self._obstacles = np.zeros(self.geometry.shape, dtype=np.uint8)

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Change inflation, padding or rates. Obstacles stay; size, frame and other layers can't change."""
        self.parameters = parameters
        self._clears_footprint = any(layer.footprint_clearing for layer in parameters.layers_of("obstacle"))
        padded = parameters.padded_footprint()
        self.inscribed_radius = inscribed_radius(padded)
        self.circumscribed_radius = float(np.hypot(*padded.T).max())
        self._footprint = np.array(parameters.footprint)
        self._inflation = self._make_inflation()

    @property
    def needs_map(self) -> bool:
        """Whether a static layer still waits for its map."""
        return self._static_layer is not None and self._static is None

    def set_map(self, static: StaticMap) -> None:
        """Take a new static map. A costmap that does not roll takes its size and resolution from the map."""
        if self._static_layer is None:
            return
        self._static = static
        self._static_costs = None
        if not self.parameters.rolling_window:
            geometry = static.geometry if static.yaw == 0.0 else bounding_geometry(static)
            if geometry != self.geometry:
                self.geometry = geometry
                self._obstacles = np.zeros(geometry.shape, dtype=np.uint8)
                self._inflation = self._make_inflation()

    def update(
        self,
        robot: Pose,
        observations: Sequence[tuple[Observation, NDArray[np.float64]]],
        map_pose: Pose | None = None,
    ) -> Snapshot:
        """Roll, clear, mark and inflate.

        Args:
            robot: pose of the base in the costmap's frame.
            observations: each with the 4 x 4 transform from its sensor to the costmap's frame.
            map_pose: pose of the static map's frame in the costmap's; None where they are the same frame.
        """
        if self.parameters.rolling_window:
            self._roll(robot)
        for observation, transform in observations:
            self._observe(observation, transform)
        if self._clears_footprint:
            self._fill(robot.apply(self._footprint), FREE)
        return self._combine(map_pose or ORIGIN)

    def clear(self, robot: Pose | None = None, keep_radius: float = 0.0) -> None:
        """Forget the obstacles seen, except in a square of half-width `keep_radius` (m) around the robot."""
        kept = self._obstacles.copy() if robot is not None and keep_radius > 0.0 else None
        self._obstacles[:] = FREE
        if kept is not None and robot is not None:
            row, column = self.geometry.cell(robot.x, robot.y)
            reach = int(keep_radius / self.geometry.resolution)
            window = (slice(max(row - reach, 0), row + reach + 1), slice(max(column - reach, 0), column + reach + 1))
            self._obstacles[window] = kept[window]

    def static_cost(self, x: float, y: float) -> int:
        """Return the static layer's own cost at a point (FREE without a static layer or outside of it)."""
        if self._static_costs is None or not self.geometry.contains(x, y):
            return FREE
        return int(self._static_costs[self.geometry.cell(x, y)])

    def _initial_geometry(self) -> Geometry:
        p = self.parameters
        return Geometry(
            p.resolution,
            max(1, round(p.width / p.resolution)),
            max(1, round(p.height / p.resolution)),
            p.origin_x,
            p.origin_y,
        )

    def _make_inflation(self) -> Inflation:
        layer = next(iter(self.parameters.layers_of("inflation")), None)
        return Inflation(layer, self.geometry.resolution, self.inscribed_radius, self.circumscribed_radius)

    def _roll(self, robot: Pose) -> None:
        """Move the window so that the robot is in its middle, by whole cells, keeping what overlaps."""
        g = self.geometry
        origin_x = math.floor((robot.x - 0.5 * g.width * g.resolution) / g.resolution) * g.resolution
        origin_y = math.floor((robot.y - 0.5 * g.height * g.resolution) / g.resolution) * g.resolution
        right = round((origin_x - g.origin_x) / g.resolution)
        up = round((origin_y - g.origin_y) / g.resolution)
        if right == 0 and up == 0:
            return
        rolled = np.zeros_like(self._obstacles)
        if abs(right) < g.width and abs(up) < g.height:
            target = (_overlap(-up, g.height), _overlap(-right, g.width))
            origin = (_overlap(up, g.height), _overlap(right, g.width))
            rolled[target] = self._obstacles[origin]
        self._obstacles = rolled
        self.geometry = replace(g, origin_x=origin_x, origin_y=origin_y)

    def _observe(self, observation: Observation, transform: NDArray[np.float64]) -> None:
        source = observation.source
        points = observation.points @ transform[:3, :3].T.astype(np.float32) + transform[:3, 3].astype(np.float32)
        in_band = (points[:, 2] >= source.min_obstacle_height) & (points[:, 2] <= source.max_obstacle_height)
        points, hits = points[in_band, :2], observation.hits[in_band]
        origin = transform[:2, 3]
        offsets = points - origin.astype(np.float32)
        ranges = np.hypot(offsets[:, 0], offsets[:, 1])
        if source.clearing and len(points):
            angles = np.arctan2(offsets[:, 1], offsets[:, 0])
            profile = (np.unwrap(angles), ranges) if observation.ordered else _nearest_by_sector(angles, ranges)
            self._clear_seen(origin, profile, source.raytrace_range)
        if source.marking:
            rows, columns = self.geometry.cells(points[hits & (ranges <= source.obstacle_range)])
            inside = (rows >= 0) & (rows < self.geometry.height) & (columns >= 0) & (columns < self.geometry.width)
            self._obstacles[rows[inside], columns[inside]] = LETHAL

    def _clear_seen(
        self,
        origin: NDArray[np.float64],
        profile: tuple[NDArray[np.floating], NDArray[np.floating]],
        reach: float,
    ) -> None:
        """Free the star-shaped area between the sensor and its returns.

        Between two rays the nearer return bounds the area, so nothing behind an edge is cleared; the last cell before a
        return stays, since neighbouring rays fall into neighbouring cells.
        """
        angles, ranges = profile
        if len(ranges) < 2:
            return
        bound = np.minimum(np.minimum(ranges[:-1], ranges[1:]) - self.geometry.resolution, reach)
        bound = np.where(np.abs(np.diff(angles)) <= MAX_RAY_GAP, np.maximum(bound, 0.0), 0.0)
        corners = np.empty((2 * len(bound) + 1, 2))
        corners[0] = origin
        corners[1::2, 0] = origin[0] + bound * np.cos(angles[:-1])
        corners[1::2, 1] = origin[1] + bound * np.sin(angles[:-1])
        corners[2::2, 0] = origin[0] + bound * np.cos(angles[1:])
        corners[2::2, 1] = origin[1] + bound * np.sin(angles[1:])
        self._fill(corners, FREE)

    def _fill(self, corners: NDArray[np.float64], cost: int) -> None:
        g = self.geometry
        scaled = (
            corners - (g.origin_x, g.origin_y)
        ) / g.resolution - 0.5  # cv2 counts from the centre of the first cell
        fixed = np.round(scaled * (1 << SUBPIXEL_BITS)).astype(np.int32)
        cv2.fillPoly(self._obstacles, [fixed], cost, shift=SUBPIXEL_BITS)

    def _combine(self, map_pose: Pose) -> Snapshot:
        self._place_static(map_pose)
        if self._static_costs is None:
            costs = self._obstacles.copy()
        else:
            costs = self._static_costs.copy()
            costs[self._obstacles == LETHAL] = LETHAL
        costs, clearance = self._inflation.apply(costs)
        return Snapshot(self.geometry, costs, clearance, self._inflation.limit, self.inscribed_radius)

    def _place_static(self, map_pose: Pose) -> None:
        """Resample the static map into the grid, where grid or map moved since the last time."""
        if self._static is None or self._static_layer is None:
            return
        placement = (self.geometry, map_pose)
        if self._static_costs is not None and self._static_placed == placement:
            return
        self._static_costs = resample(self._static, self._static_layer, self.geometry, map_pose)
        self._static_placed = placement


def _overlap(shift: int, size: int) -> slice:
    """Return the part of an axis that is still inside after a move by `shift` cells."""
    return slice(max(shift, 0), size + min(shift, 0))


def _nearest_by_sector(
    angles: NDArray[np.floating], ranges: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return edges of the sectors that hold returns, and the nearest return of each, for `_clear_seen`."""
    sectors = np.floor(angles / CLOUD_BIN).astype(np.intp)
    order = np.argsort(sectors, kind="stable")
    kept, starts = np.unique(sectors[order], return_index=True)
    nearest = np.minimum.reduceat(ranges[order], starts)
    return (kept + 0.5) * CLOUD_BIN, nearest
