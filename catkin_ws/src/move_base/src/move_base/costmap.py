"""Layered costmaps: static map, obstacles seen by sensors, inflation.

Cells are `grid[row, column]`; row grows with y, column with x. Costs are those of costmap_2d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from move_base.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from move_base.parameters import CostmapParameters, Layer
    from move_base.sensors import Observation

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
"""Costs: free, the robot's centre can't be here, an obstacle, not known."""

MAX_RAY_GAP = math.radians(3.0)
"""Neighbouring rays farther apart than this leave what lies between them as it was."""

CLOUD_BIN = math.radians(1.0)
"""Width of the sectors in which a cloud's nearest return bounds what is cleared: over twice a depth camera's column."""

MIN_RESOLUTION, MAX_RESOLUTION = 0.001, 10.0
"""Sides of a map's cells that make sense, m."""

SUBPIXEL_BITS = 4
"""Fixed-point digits of cv2's polygon corners: 1/16 cell."""


class CostmapError(ValueError):
    """A map can't be used; the message says why."""


@dataclass(frozen=True)
class Geometry:
    """Where a grid lies in its frame.

    Attributes:
        resolution: side of a cell, m.
        width: number of columns.
        height: number of rows.
        origin_x: x of the lower left corner, m.
        origin_y: y of the lower left corner, m.
    """

    resolution: float
    width: int
    height: int
    origin_x: float
    origin_y: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.height, self.width

    def cells(self, points: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Returns rows and columns of points (..., 2); they may lie outside the grid."""
        scale = 1.0 / self.resolution
        columns = np.floor((points[..., 0] - self.origin_x) * scale).astype(np.intp)
        rows = np.floor((points[..., 1] - self.origin_y) * scale).astype(np.intp)
        return rows, columns

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Returns row and column of a point; they may lie outside the grid."""
        return (
            math.floor((y - self.origin_y) / self.resolution),
            math.floor((x - self.origin_x) / self.resolution),
        )

    def contains(self, x: float, y: float) -> bool:
        """Whether a point is in the grid; one that is not finite is not."""
        along_x, along_y = (x - self.origin_x) / self.resolution, (y - self.origin_y) / self.resolution
        return 0.0 <= along_x < self.width and 0.0 <= along_y < self.height

    def centres(self, rows: NDArray[np.integer], columns: NDArray[np.integer]) -> NDArray[np.float64]:
        """Returns the centres (N, 2) of cells in metres."""
        return np.stack(
            [
                (columns + 0.5) * self.resolution + self.origin_x,
                (rows + 0.5) * self.resolution + self.origin_y,
            ],
            axis=-1,
        )


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


@dataclass(frozen=True)
class StaticMap:
    """An occupancy grid with its own origin.

    Attributes:
        geometry: the grid, before it is turned about its origin's corner.
        yaw: turn of the grid about the origin, radians.
        occupancy: -1 unknown, 0..100 (H, W), int8.
    """

    geometry: Geometry
    yaw: float
    occupancy: NDArray[np.int8]

    @classmethod
    def create(
        cls, data: Sequence[int], width: int, height: int, resolution: float, origin: tuple[float, float, float]
    ) -> StaticMap:
        """Checks the fields of a nav_msgs/OccupancyGrid.

        Raises:
            CostmapError: sizes do not fit, or values are not finite.
        """
        if not all(math.isfinite(value) for value in origin) or not MIN_RESOLUTION <= resolution <= MAX_RESOLUTION:
            raise CostmapError(f"the map's resolution ({resolution}) or origin ({origin}) makes no sense")
        if width <= 0 or height <= 0 or len(data) != width * height:
            raise CostmapError(f"the map announces {width} x {height} cells and holds {len(data)}")
        occupancy = np.asarray(data, dtype=np.int8).reshape(height, width)
        return cls(Geometry(resolution, width, height, origin[0], origin[1]), origin[2], occupancy)


class Costmap:
    """One costmap, built up from the layers of its parameters."""

    def __init__(self, parameters: CostmapParameters) -> None:
        self.parameters = parameters
        self.geometry = self._initial_geometry()
        self.reconfigure(parameters)
        self._static_layer = next((layer for layer in parameters.layers if layer.kind == "static"), None)
        self._static: StaticMap | None = None
        self._static_costs: NDArray[np.uint8] | None = None
        self._static_placed: tuple[Geometry, Pose] | None = None
        self._obstacles = np.zeros(self.geometry.shape, dtype=np.uint8)

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Takes another inflation, padding, rates; obstacles seen stay. Size, frame and other layers can't change."""
        self.parameters = parameters
        self._inflation = next((layer for layer in parameters.layers if layer.kind == "inflation"), None)
        self._obstacle_layers = [layer for layer in parameters.layers if layer.kind == "obstacle"]
        padded = parameters.padded_footprint()
        self.inscribed_radius = inscribed_radius(padded)
        self.circumscribed_radius = float(np.hypot(*padded.T).max())
        self._footprint = np.array(parameters.footprint)
        self._cost_table, self._table_scale = self._make_cost_table()

    @property
    def needs_map(self) -> bool:
        """Whether a static layer still waits for its map."""
        return self._static_layer is not None and self._static is None

    def set_map(self, static: StaticMap) -> None:
        """Takes a new static map; a costmap that does not roll takes on its size and resolution."""
        if self._static_layer is None:
            return
        self._static = static
        self._static_costs = None
        if not self.parameters.rolling_window:
            geometry = static.geometry if static.yaw == 0.0 else _bounding_geometry(static)
            if geometry != self.geometry:
                self.geometry = geometry
                self._obstacles = np.zeros(geometry.shape, dtype=np.uint8)
                self._cost_table, self._table_scale = self._make_cost_table()

    def update(
        self,
        robot: Pose,
        observations: Sequence[tuple[Observation, NDArray[np.float64]]],
        map_pose: Pose | None = None,
    ) -> Snapshot:
        """Rolls, clears, marks and inflates.

        Args:
            robot: pose of the base in the costmap's frame.
            observations: each with the 4 x 4 transform from its sensor to the costmap's frame.
            map_pose: pose of the static map's frame in the costmap's; None where they are the same frame.
        """
        if self.parameters.rolling_window:
            self._roll(robot)
        for observation, transform in observations:
            self._observe(observation, transform)
        if any(layer.footprint_clearing for layer in self._obstacle_layers):
            self._fill(robot.apply(self._footprint), FREE)
        return self._combine(map_pose or Pose(0.0, 0.0, 0.0))

    def clear(self, robot: Pose | None = None, keep_radius: float = 0.0) -> None:
        """Forgets the obstacles seen, except in a square of half-width `keep_radius` (m) around the robot."""
        kept = self._obstacles.copy() if robot is not None and keep_radius > 0.0 else None
        self._obstacles[:] = FREE
        if kept is not None and robot is not None:
            row, column = self.geometry.cell(robot.x, robot.y)
            reach = int(keep_radius / self.geometry.resolution)
            window = (slice(max(row - reach, 0), row + reach + 1), slice(max(column - reach, 0), column + reach + 1))
            self._obstacles[window] = kept[window]

    def static_cost(self, x: float, y: float) -> int:
        """Returns the static layer's own cost at a point (FREE without a static layer or outside of it)."""
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

    def _roll(self, robot: Pose) -> None:
        """Moves the window so that the robot is in its middle, by whole cells, keeping what overlaps."""
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
        """Frees the star-shaped area between the sensor and its returns.

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
        return self._inflate(costs)

    def _place_static(self, map_pose: Pose) -> None:
        """Resamples the static map into the grid, where grid or map moved since the last time."""
        if self._static is None or self._static_layer is None:
            return
        placement = (self.geometry, map_pose)
        if self._static_costs is not None and self._static_placed == placement:
            return
        self._static_costs = _resample(self._static, self._static_layer, self.geometry, map_pose)
        self._static_placed = placement

    def _inflate(self, costs: NDArray[np.uint8]) -> Snapshot:
        resolution = self.geometry.resolution
        unknown = costs == UNKNOWN
        cells = cv2.distanceTransform((costs != LETHAL).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        limit = (LETHAL - 1) / self._table_scale * resolution
        if not cells.size or float(cells.max()) > 1e6:  # no obstacle at all
            cells = np.full(costs.shape, limit / resolution, dtype=np.float32)
        if self._inflation is not None:
            steps = cv2.convertScaleAbs(cells, alpha=self._table_scale)
            inflated = np.asarray(cv2.LUT(steps, self._cost_table), dtype=np.uint8)
            if unknown.any():
                inflated[unknown & (inflated < INSCRIBED)] = UNKNOWN
            costs = inflated
        clearance = np.minimum(cells * np.float32(resolution), np.float32(limit))
        return Snapshot(self.geometry, costs, clearance, limit, self.inscribed_radius)

    def _make_cost_table(self) -> tuple[NDArray[np.uint8], float]:
        """Tabulates the published cost function over the distance, so that a look-up inflates the whole grid.

        Returns:
            256 costs, and the number of entries per cell of distance. The table reaches a cell beyond the larger of the
            inflation and the circumscribed radius.
        """
        resolution = self.geometry.resolution  # a static map's own, where the costmap does not roll
        radius = self._inflation.inflation_radius if self._inflation is not None else 0.0
        reach = max(radius, self.circumscribed_radius, self.inscribed_radius) / resolution + 2.0
        scale = 254.0 / reach
        distances = np.arange(256) / scale * resolution
        factor = self._inflation.cost_scaling_factor if self._inflation is not None else 0.0
        costs = (INSCRIBED - 1) * np.exp(-factor * (distances - self.inscribed_radius))
        costs = np.where(distances <= self.inscribed_radius, INSCRIBED, costs)
        costs = np.where((distances > radius) & (distances > 0.0), FREE, costs)
        costs[0] = LETHAL
        return costs.astype(np.uint8), scale


def inscribed_radius(corners: NDArray[np.float64]) -> float:
    """Returns the distance from the origin to the nearest edge of a polygon (N, 2)."""
    ends = np.roll(corners, -1, axis=0)
    edges = ends - corners
    along = np.clip(-(corners * edges).sum(1) / np.maximum((edges**2).sum(1), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(corners + along[:, None] * edges).T).min())


def occupancy_values(costs: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Translates costs to the values of an OccupancyGrid as costmap_2d publishes them: 0, 1..98, 99, 100, -1."""
    table = np.zeros(256, dtype=np.int8)
    table[1:INSCRIBED] = 1 + 97 * (np.arange(1, INSCRIBED) - 1) // 251
    table[INSCRIBED], table[LETHAL], table[UNKNOWN] = 99, 100, -1
    return table[costs]


def _overlap(shift: int, size: int) -> slice:
    """The part of an axis that is still inside after a move by `shift` cells."""
    return slice(max(shift, 0), size + min(shift, 0))


def _nearest_by_sector(
    angles: NDArray[np.floating], ranges: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Returns edges of the sectors that hold returns, and the nearest return of each, for `_clear_seen`."""
    sectors = np.floor(angles / CLOUD_BIN).astype(np.intp)
    order = np.argsort(sectors, kind="stable")
    kept, starts = np.unique(sectors[order], return_index=True)
    nearest = np.minimum.reduceat(ranges[order], starts)
    return (kept + 0.5) * CLOUD_BIN, nearest


def _bounding_geometry(static: StaticMap) -> Geometry:
    """The upright grid that holds a turned map."""
    g = static.geometry
    width, height = g.width * g.resolution, g.height * g.resolution
    corners = Pose(g.origin_x, g.origin_y, static.yaw).apply(
        np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.ceil((high - low) / g.resolution - 1e-9).astype(int)
    return Geometry(g.resolution, int(columns), int(rows), float(low[0]), float(low[1]))


def _resample(static: StaticMap, layer: Layer, target: Geometry, map_pose: Pose) -> NDArray[np.uint8]:
    """Returns the static map's costs on another grid; what the map does not cover is unknown (if tracked) or FREE."""
    outside = UNKNOWN if layer.track_unknown_space else FREE
    costs = np.where(static.occupancy >= layer.lethal_cost_threshold, LETHAL, FREE).astype(np.uint8)
    costs[static.occupancy < 0] = outside
    source = static.geometry
    identity = map_pose == Pose(0.0, 0.0, 0.0) and static.yaw == 0.0
    if identity and source == target:
        return costs
    # cell index of the target -> metres -> map -> the map's own grid -> cell index
    to_source = Pose(source.origin_x, source.origin_y, static.yaw).inverse().compose(map_pose.inverse())
    cos, sin = math.cos(to_source.yaw), math.sin(to_source.yaw)
    ratio = target.resolution / source.resolution
    corner = to_source.apply(
        np.array([[target.origin_x + 0.5 * target.resolution, target.origin_y + 0.5 * target.resolution]])
    )[0]
    warp = np.array(
        [
            [cos * ratio, -sin * ratio, corner[0] / source.resolution - 0.5],
            [sin * ratio, cos * ratio, corner[1] / source.resolution - 0.5],
        ]
    )
    return np.asarray(
        cv2.warpAffine(
            costs,
            warp,
            (target.width, target.height),
            flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=outside,
        ),
        dtype=np.uint8,
    )
