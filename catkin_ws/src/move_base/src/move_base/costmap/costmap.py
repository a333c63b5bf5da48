"""Layered costmaps: static map, obstacles seen by sensors, inflation."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import ORIGIN, Pose, inscribed_radius

from move_base.costmap.grid import FREE, LETHAL, UNKNOWN, Geometry
from move_base.costmap.inflation import IncrementalInflation, Inflation
from move_base.costmap.snapshot import Part, Radii, Snapshot
from move_base.costmap.static_map import MapError, bounding_geometry, costs_of, resample
from move_base.parameters.parameters import OBSTACLE_KINDS

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from numpy.typing import NDArray

    from move_base.costmap.sensors import Observation
    from move_base.costmap.static_map import MapPart, StaticMap
    from move_base.parameters.parameters import CostmapParameters, Layer

MAX_RAY_GAP = math.radians(3.0)
"""Neighbouring rays farther apart than this leave what lies between them as it was."""

CLOUD_BIN = math.radians(1.0)
"""Width of the sectors in which a cloud's nearest return bounds what is cleared: over twice a depth camera's column."""

SUBPIXEL_BITS = 4
"""Fixed-point digits of cv2's polygon corners: 1/16 cell."""

MAX_COORDINATE = (1 << 31) - 1
"""The largest coordinate of such a corner, 1/16 cell."""

BEYOND = 1.01
"""Rays end at this multiple of the distance to the grid's farthest corner: the edge between two of them, up to
MAX_RAY_GAP apart, is then still beyond the grid."""


class Costmap:
    """One costmap, built up from the layers of its parameters."""

    def __init__(self, parameters: CostmapParameters) -> None:
        self.parameters = parameters
        self.geometry = self._initial_geometry()
        self._maps: dict[str, StaticMap] = {}  # by layer
        self._map_costs: dict[str, tuple[StaticMap, NDArray[np.uint8]]] = {}  # by layer, on the map's own grid
        self._static_costs: dict[str, NDArray[np.uint8]] = {}  # by layer
        self._static_placed: dict[str, tuple[Geometry, Pose]] = {}
        self._obstacles = self._no_obstacles()
        self.reconfigure(parameters)

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Take other parameters; frames and layers can't change. Obstacles stay, unless the grid is another one."""
        old, self.parameters = self.parameters, parameters
        self._map_costs.clear()
        if _grid(old) != _grid(parameters) and not self._has_size_of_map():
            self.geometry = self._initial_geometry()
            self._obstacles = self._no_obstacles()
        padded = parameters.padded_footprint()
        self.inscribed_radius = inscribed_radius(padded)
        self.circumscribed_radius = float(np.hypot(*padded.T).max())
        self._footprint = np.array(parameters.footprint)
        pinched = 0.5 * (inscribed_radius(self._footprint) + self.inscribed_radius)
        self._static_layers = parameters.layers_of("static")
        self._obstacle_layers = parameters.layers_of(*OBSTACLE_KINDS)
        self._radii = Radii(self.inscribed_radius, self.circumscribed_radius, pinched)
        self._make_inflation()

    @property
    def needs_map(self) -> bool:
        """Whether a static layer still waits for its map."""
        return self.missing_map() != ""

    @property
    def map_frames(self) -> set[str]:
        """The frames of the maps of all static layers."""
        return {self._maps[layer.name].frame for layer in self._static_layers if layer.name in self._maps}

    def missing_map(self) -> str:
        """Return the topic of a map that a static layer still waits for, or an empty text."""
        return next((layer.map_topic for layer in self._static_layers if layer.name not in self._maps), "")

    def takes_map(self, topic: str) -> bool:
        """Tell whether a layer takes a map from a topic now."""
        return bool(self._layers_for(topic))

    def set_map(self, static: StaticMap, topic: str = "", map_pose: Pose = ORIGIN) -> None:
        """Take a new static map. A costmap that does not roll takes its size and resolution from its first layer's map.

        Args:
            static: the map.
            topic: where it comes from; empty: it is for all static layers.
            map_pose: pose of the map's frame in the costmap's.

        Raises:
            MapError: the costmap would have too many cells; nothing has changed.
        """
        layers = self._layers_for(topic)
        geometry = self.geometry
        if not self.parameters.rolling_window and self._all_static_layers()[:1] == layers[:1] != []:
            geometry = bounding_geometry(static, map_pose)
        for layer in layers:
            self._maps[layer.name] = static
            self._static_costs.pop(layer.name, None)
        if geometry != self.geometry:
            self.geometry = geometry
            self._obstacles = self._no_obstacles()
            self._make_inflation()

    def update_map(self, part: MapPart, topic: str) -> None:
        """Replace a part of the map from a topic, for the layers that subscribe to updates.

        Raises:
            MapError: the part is not within the map, or belongs to one of another frame; nothing has changed.
        """
        layers = [layer for layer in self._layers_with_updates() if layer.map_topic == topic]
        maps = {layer.name: self._maps[layer.name] for layer in layers if layer.name in self._maps}
        updated = {}
        for name, static in maps.items():
            if part.frame not in {"", static.frame}:
                raise MapError(f"it is for a map in {part.frame!r}, the one in use is in {static.frame!r}")
            updated[name] = static.updated(part)
        for name, static in updated.items():
            self._maps[name] = static
            self._static_costs.pop(name, None)

    def takes_updates(self, topic: str) -> bool:
        """Tell whether a layer subscribes to parts of the map from a topic."""
        return any(layer.map_topic == topic for layer in self._layers_with_updates())

    def obstacles(self, layer: str) -> NDArray[np.uint8]:
        """Return the obstacles that a layer holds (H, W): LETHAL or FREE."""
        return self._obstacles[layer]

    def update(
        self,
        robot: Pose,
        observations: Sequence[tuple[Observation, NDArray[np.float64]]],
        map_poses: Mapping[str, Pose] | None = None,
    ) -> Snapshot:
        """Roll, clear, mark and inflate.

        Args:
            robot: pose of the base in the costmap's frame.
            observations: each with the 4 x 4 transform from its sensor to the costmap's frame.
            map_poses: by frame of a static map, its pose in the costmap's, where they are not the same frame.
        """
        if self.parameters.rolling_window:
            self._roll(robot)
        for observation, transform in observations:
            self._observe(observation, transform)
        for layer in self._obstacle_layers:
            if layer.footprint_clearing_enabled:
                self._clear_footprint(self._obstacles[layer.name], robot.apply(self._footprint))
        return self._combine(map_poses or {})

    def clear(
        self,
        robot: Pose | None = None,
        keep_radius: float = 0.0,
        *,
        layers: Collection[str] | None = None,
        inside: bool = False,
    ) -> None:
        """Forget the obstacles seen, except in a square around the robot.

        Args:
            robot: pose in the costmap's frame; None: nothing is kept.
            keep_radius: half the side of the square, m.
            layers: names of the layers to clear; None: all.
            inside: forget what is in the square, and keep what is outside of it.
        """
        for name, obstacles in self._obstacles.items():
            if layers is not None and name not in layers:
                continue
            if robot is None:
                obstacles[:] = FREE
                continue
            row, column = self.geometry.cell(robot.x, robot.y)
            reach = int(keep_radius / self.geometry.resolution)
            window = (slice(max(row - reach, 0), row + reach + 1), slice(max(column - reach, 0), column + reach + 1))
            kept = np.zeros_like(obstacles)
            if inside:
                kept[:] = obstacles
                kept[window] = FREE
            elif keep_radius > 0.0:
                kept[window] = obstacles[window]
            obstacles[:] = kept

    def static_cost(self, x: float, y: float) -> int:
        """Return the static layers' own cost at a point (FREE without a static layer or outside of it)."""
        if not self.geometry.contains(x, y):
            return FREE
        cell = self.geometry.cell(x, y)
        costs = [int(self._static_costs[layer.name][cell]) for layer in self._placed_layers()]
        return costs[-1] if costs else FREE

    def _placed_layers(self) -> list[Layer]:
        return [layer for layer in self._static_layers if layer.name in self._static_costs]

    def _no_obstacles(self) -> dict[str, NDArray[np.uint8]]:
        names = [layer.name for layer in self.parameters.layers if layer.kind in OBSTACLE_KINDS]
        return {name: np.zeros(self.geometry.shape, dtype=np.uint8) for name in names}

    def _has_size_of_map(self) -> bool:
        return bool(self._maps) and not self.parameters.rolling_window

    def _all_static_layers(self) -> list[Layer]:
        return [layer for layer in self.parameters.layers if layer.kind == "static"]

    def _layers_for(self, topic: str) -> list[Layer]:
        """Return the layers that take a map from a topic now."""
        layers = [layer for layer in self._all_static_layers() if topic in {"", layer.map_topic}]
        return [layer for layer in layers if not (layer.first_map_only and layer.name in self._maps)]

    def _layers_with_updates(self) -> list[Layer]:
        return [layer for layer in self._all_static_layers() if layer.subscribe_to_updates]

    def _initial_geometry(self) -> Geometry:
        p = self.parameters
        return Geometry(
            p.resolution,
            max(1, round(p.width / p.resolution)),
            max(1, round(p.height / p.resolution)),
            p.origin_x,
            p.origin_y,
        )

    def _make_inflation(self) -> None:
        layer = next(iter(self.parameters.layers_of("inflation")), None)
        radii = self.inscribed_radius, self.circumscribed_radius
        self._inflation = Inflation(layer, self.geometry.resolution, *radii)
        self._incremental = IncrementalInflation(self._inflation)

    def _roll(self, robot: Pose) -> None:
        """Move the window so that the robot is in its middle, by whole cells, keeping what overlaps."""
        g = self.geometry
        origin_x = math.floor((robot.x - 0.5 * g.width * g.resolution) / g.resolution) * g.resolution
        origin_y = math.floor((robot.y - 0.5 * g.height * g.resolution) / g.resolution) * g.resolution
        right = round((origin_x - g.origin_x) / g.resolution)
        up = round((origin_y - g.origin_y) / g.resolution)
        if right == 0 and up == 0:
            return
        overlaps = abs(right) < g.width and abs(up) < g.height
        for name, obstacles in self._obstacles.items():
            rolled = np.zeros_like(obstacles)
            if overlaps:
                target = (_overlap(-up, g.height), _overlap(-right, g.width))
                origin = (_overlap(up, g.height), _overlap(right, g.width))
                rolled[target] = obstacles[origin]
            self._obstacles[name] = rolled
        self.geometry = replace(g, origin_x=origin_x, origin_y=origin_y)

    def _observe(self, observation: Observation, transform: NDArray[np.float64]) -> None:
        source = observation.source
        obstacles = self._obstacles[source.layer]
        points = observation.points @ transform[:3, :3].T.astype(np.float32)
        points += transform[:3, 3].astype(np.float32)
        height = points[:, 2]
        in_band = np.flatnonzero((height >= source.min_obstacle_height) & (height <= source.max_obstacle_height))
        x, y = points[:, 0].take(in_band), points[:, 1].take(in_band)
        origin = transform[:2, 3]
        away_x, away_y = x - np.float32(origin[0]), y - np.float32(origin[1])
        ranges = np.hypot(away_x, away_y)
        if source.clearing and len(in_band):
            angles = np.arctan2(away_y, away_x)
            profile = (np.unwrap(angles), ranges) if observation.ordered else _nearest_by_sector(angles, ranges)
            self._clear_seen(obstacles, origin, profile, source.raytrace_range)
        if source.marking:
            seen = np.flatnonzero(observation.hits.take(in_band) & (ranges <= source.obstacle_range))
            rows, columns = self.geometry.cells_at(x.take(seen), y.take(seen))
            inside = (rows >= 0) & (rows < self.geometry.height) & (columns >= 0) & (columns < self.geometry.width)
            obstacles[rows[inside], columns[inside]] = LETHAL

    def _clear_seen(
        self,
        obstacles: NDArray[np.uint8],
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
        reach = min(reach, BEYOND * self._farthest_from(origin))
        bound = np.minimum(np.minimum(ranges[:-1], ranges[1:]) - self.geometry.resolution, reach)
        bound = np.where(np.abs(np.diff(angles)) <= MAX_RAY_GAP, np.maximum(bound, 0.0), 0.0)
        corners = np.empty((2 * len(bound) + 1, 2))
        corners[0] = origin
        for axis, along in ((0, np.cos(angles)), (1, np.sin(angles))):
            corners[1::2, axis] = origin[axis] + bound * along[:-1]
            corners[2::2, axis] = origin[axis] + bound * along[1:]
        self._fill(obstacles, corners)

    def _farthest_from(self, point: NDArray[np.float64]) -> float:
        """Return the distance from a point to the farthest corner of the grid, m."""
        g = self.geometry
        away = (
            np.abs(point - (g.origin_x, g.origin_y)),
            np.abs(point - g.centres(np.array(g.height), np.array(g.width))),
        )
        return float(np.hypot(*np.maximum(*away))) + g.resolution

    def _clear_footprint(self, obstacles: NDArray[np.uint8], corners: NDArray[np.float64]) -> None:
        """Free what the robot covers, even in part, as in costmap_2d: what is left would count as touched."""
        self._fill(obstacles, corners)
        rows, columns = _cells_along(self.geometry, corners)
        inside = (rows >= 0) & (rows < self.geometry.height) & (columns >= 0) & (columns < self.geometry.width)
        obstacles[rows[inside], columns[inside]] = FREE

    def _fill(self, obstacles: NDArray[np.uint8], corners: NDArray[np.float64]) -> None:
        """Free a polygon, but not each cell that its edge runs through."""
        g = self.geometry
        scaled = corners - (g.origin_x, g.origin_y)
        scaled /= g.resolution
        scaled -= 0.5  # cv2 counts from the centre of the first cell
        scaled *= 1 << SUBPIXEL_BITS
        np.rint(scaled, out=scaled)
        if np.abs(scaled).max() > MAX_COORDINATE:
            return  # another polygon, with its corners moved, might free what this one does not
        cv2.fillPoly(obstacles, [scaled.astype(np.int32)], FREE, shift=SUBPIXEL_BITS)

    def _combine(self, map_poses: Mapping[str, Pose]) -> Snapshot:
        self._place_static(map_poses)
        costs = np.zeros(self.geometry.shape, dtype=np.uint8)
        for layer in self.parameters.layers:  # in the order of the list, as in costmap_2d
            if not layer.enabled:
                continue
            if layer.name in self._static_costs:
                static = self._static_costs[layer.name]
                costs = _larger(costs, static) if layer.use_maximum else static.copy()
            elif layer.name in self._obstacles:
                costs[self._obstacles[layer.name] == LETHAL] = LETHAL
        whole = None
        if not self.parameters.rolling_window:  # the grid stays, and the planner looks at all of it
            whole = Part(0, 0, *self._incremental.update(costs))
        return Snapshot(self.geometry, costs, self._inflation, self._radii, whole)

    def _place_static(self, map_poses: Mapping[str, Pose]) -> None:
        """Resample the static maps into the grid, where grid or map moved since the last time."""
        for layer in self._static_layers:
            static = self._maps.get(layer.name)
            if static is None:
                continue
            map_pose = map_poses.get(static.frame, ORIGIN)
            placement = (self.geometry, map_pose)
            if layer.name in self._static_costs and self._static_placed[layer.name] == placement:
                continue
            known, costs = self._map_costs.get(layer.name, (None, None))
            if costs is None or known is not static:
                costs = costs_of(static, layer)
                self._map_costs[layer.name] = static, costs
            self._static_costs[layer.name] = resample(costs, static, layer, self.geometry, map_pose)
            self._static_placed[layer.name] = placement


def _grid(parameters: CostmapParameters) -> tuple[float, ...]:
    """Return what the grid's size and place follow from."""
    p = parameters
    return p.width, p.height, p.resolution, p.origin_x, p.origin_y


def _larger(costs: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the larger costs; an unknown cell takes the other cost."""
    known = np.where(other == UNKNOWN, costs, np.maximum(costs, other))
    return np.where(costs == UNKNOWN, other, known).astype(np.uint8)


def _cells_along(geometry: Geometry, corners: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of all cells that the edges of a polygon (N, 2) run through."""
    points = []
    ends = (corners - (geometry.origin_x, geometry.origin_y)) / geometry.resolution
    for start, end in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        along = end - start
        crossings = [np.array([0.0, 1.0])]  # shares of the way at which the edge comes into another cell
        for axis in (0, 1):
            low, high = sorted((start[axis], end[axis]))
            crossings.append((np.arange(math.ceil(low), math.floor(high) + 1) - start[axis]) / (along[axis] or 1.0))
        shares = np.sort(np.concatenate(crossings).clip(0.0, 1.0))
        points.append(start + (0.5 * (shares[:-1] + shares[1:]))[:, None] * along)
    columns, rows = np.floor(np.concatenate(points)).astype(np.intp).T
    return rows, columns


def _overlap(shift: int, size: int) -> slice:
    """Return the part of an axis that is still inside after a move by `shift` cells."""
    return slice(max(shift, 0), size + min(shift, 0))


def _nearest_by_sector(
    angles: NDArray[np.floating], ranges: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return edges of the sectors that hold returns, and the nearest return of each, for `_clear_seen`."""
    sectors = np.floor(angles / CLOUD_BIN).astype(np.int16)  # numpy sorts short numbers much faster
    order = np.argsort(sectors, kind="stable")
    sectors = sectors[order]
    starts = np.flatnonzero(np.append(True, sectors[1:] != sectors[:-1]))
    return (sectors[starts] + 0.5) * CLOUD_BIN, np.minimum.reduceat(ranges[order], starts)
