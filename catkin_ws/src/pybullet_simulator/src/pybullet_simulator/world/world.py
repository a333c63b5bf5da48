"""Worlds: a floor with boxes on it and people who walk there, and the map that is drawn of the boxes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from node_kit.one_line import OneLineError

from pybullet_simulator.world.grid import FREE, OCCUPIED, UNKNOWN, Grid, cover
from pybullet_simulator.world.walking import MAX_SPEED, MAX_WAY, MAX_WAYPOINTS, RADIUS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from pybullet_simulator.world.walking import Walker

KINDS = {"walls": "wall", "racks": "rack", "pillars": "pillar", "pallets": "pallet", "boxes": "box"}
"""Sections of a world file and the kind of what they list."""
MAPPED = "mapped"
"""Kind of the boxes that come from a map."""
MAPPED_HEIGHT = 2.0
"""m above the floor to which a map's occupied cells are extruded: more than any sensor looks at."""

MAX_BOXES = 500
"""In a world file; a factory of 20 x 20 m has 30. One that crosses 200 m takes 1.3 ms to read and to draw."""

_POINTS_AT_ONCE = 64
"""Of a way that are compared with the boxes near all of them: 16 m."""
_CORNERS = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))])
_TRIANGLES = np.array(
    [(4, 5, 6), (4, 6, 7)]
    + [face for i in range(4) for j in [(i + 1) % 4] for face in ((i, j, j + 4), (i, j + 4, i + 4))]
)
"""Corners of a unit box that stands on the floor, and its top and sides; nobody looks at it from below."""


class WorldError(OneLineError, ValueError):
    """A world file that cannot be read, or an entry in it that makes no sense."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands on the floor.

    Attributes:
        name: unique within the world; boxes from a map share one.
        kind: wall, rack, pillar, pallet, box or mapped.
        x: centre in the map frame, m.
        y: centre in the map frame, m.
        length: extent along its own x axis, m.
        width: extent along its own y axis, m.
        height: m above the floor.
        yaw: rad.
    """

    name: str
    kind: str
    x: float
    y: float
    length: float
    width: float
    height: float
    yaw: float = 0.0

    @property
    def mapped(self) -> bool:
        """Whether it comes from a map."""
        return self.kind == MAPPED

    def distance(self, x: Any, y: Any) -> Any:
        """Return the distance in m of points (floats or arrays, map frame) to the box's outline, 0 inside."""
        return _distance(self.x, self.y, self.length, self.width, self.yaw, x, y)

    def points(self, spacing: float = 0.1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points of the floor under it, edges included, at most `spacing` m apart: x and y in the map frame."""
        along = np.linspace(-self.length / 2.0, self.length / 2.0, math.ceil(self.length / spacing) + 1)
        across = np.linspace(-self.width / 2.0, self.width / 2.0, math.ceil(self.width / spacing) + 1)
        along, across = (axis.ravel() for axis in np.meshgrid(along, across))
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + cos * along - sin * across, self.y + sin * along + cos * across


@dataclass(frozen=True)
class World:
    """A floor (map frame, m), the boxes on it and the people who walk there.

    Attributes:
        name: for messages.
        x_min: of the floor, or of the rectangle around a turned map.
        x_max: as x_min.
        y_min: as x_min.
        y_max: as x_min.
        boxes: what the map shows.
        walkers: what it does not.
        grid: the map that the world was made from, None where the map is drawn from the boxes.
    """

    name: str
    x_min: float
    x_max: float
    y_min: float
    y_max: float
    boxes: tuple[Box, ...]
    walkers: tuple[Walker, ...] = ()
    grid: Grid | None = None

    def nearest(self, x: float, y: float) -> tuple[Box | None, float]:
        """Return the closest box and its distance in m (0 inside it); (None, inf) on an empty floor."""
        if not self.boxes:
            return None, math.inf
        distances = self._distances(x, y)
        index = int(np.argmin(distances))
        return self.boxes[index], float(distances[index])

    def under(self, box: Box) -> Box | None:
        """Return a box of the world that shares a part of the floor with another one, None where none does."""
        for x, y in zip(*box.points(), strict=True):
            other, distance = self.nearest(float(x), float(y))
            if distance <= 0.0:
                return other
        return None

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point of the map frame lies on the floor."""
        if self.grid is not None:
            return self.grid.contains(x, y)
        return self.x_min <= x <= self.x_max and self.y_min <= y <= self.y_max

    def first_within(self, radius: float, points: NDArray[np.float64]) -> tuple[float, float] | None:
        """Return the first of some points that is closer to a box than a radius in m, None where none is.

        Args:
            radius: m.
            points: (n, 2), map frame; those that follow each other are best close to each other.
        """
        if not self.boxes:
            return None
        centre_x, centre_y, length, width, yaw = self._columns
        reach = np.hypot(length, width) / 2.0 + radius
        for begin in range(0, len(points), _POINTS_AT_ONCE):
            x, y = points[begin : begin + _POINTS_AT_ONCE].T[:, :, np.newaxis]
            spread = np.hypot(x - x[0], y - y[0]).max()
            near = np.hypot(centre_x - x[0], centre_y - y[0]) <= reach + spread
            distances = _distance(centre_x[near], centre_y[near], length[near], width[near], yaw[near], x, y)
            within = (distances < radius).any(axis=1)
            if within.any():
                index = int(np.argmax(within))
                return float(x[index, 0]), float(y[index, 0])
        return None

    def _distances(self, x: float, y: float) -> NDArray[np.float64]:
        """Return the distance of a point to every box, m."""
        centre_x, centre_y, length, width, yaw = self._columns
        distances: NDArray[np.float64] = _distance(centre_x, centre_y, length, width, yaw, x, y)
        return distances

    @cached_property
    def _columns(self) -> NDArray[np.float64]:
        """Centre x, y, length, width and yaw of all boxes: (5, n)."""
        return np.array([(box.x, box.y, box.length, box.width, box.yaw) for box in self.boxes]).T


def overlap(one: Box, other: Box) -> bool:
    """Tell whether two boxes share a part of the floor."""
    return bool((one.distance(*other.points()) <= 0.0).any() or (other.distance(*one.points()) <= 0.0).any())


def way_problem(world: World, walker: Walker) -> str | None:
    """Return why a person cannot walk their way, None where they can."""
    if len(walker.waypoints) < 2 or not all(math.isfinite(number) for point in walker.waypoints for number in point):
        return "waypoints: give two or more [x, y], of finite numbers"
    if len(walker.waypoints) > MAX_WAYPOINTS or walker.length > MAX_WAY:
        return (
            f"waypoints: are {len(walker.waypoints)} on {walker.length:.0f} m; "
            f"give at most {MAX_WAYPOINTS} on {MAX_WAY:.0f} m"
        )
    if not 0.0 < walker.speed <= MAX_SPEED:
        return f"speed: is {walker.speed:g}; give more than 0 and at most {MAX_SPEED:g} m/s"
    for x, y in walker.waypoints:
        if not world.contains(x, y):
            return f"waypoint ({x:g}, {y:g}) is off the floor"
    if place := world.first_within(RADIUS, walker.places(RADIUS)):
        box, _ = world.nearest(*place)
        if box is not None:
            return f"the way leads into {box.name!r} at ({place[0]:.2g}, {place[1]:.2g})"
    return None


def rasterise(world: World, resolution: float = 0.05, margin: float = 0.5) -> Grid:
    """Return the map of a world: the one it was made from, else one drawn of its boxes.

    In a drawn map, what lies off the floor and within no box is unknown; a cell that a box touches is occupied.

    Args:
        world: the world to draw.
        resolution: m per cell of a drawn map.
        margin: border around the floor in m of a drawn map.
    """
    if world.grid is not None:
        return world.grid
    columns = math.ceil((world.x_max - world.x_min + 2.0 * margin) / resolution - 1e-9)
    rows = math.ceil((world.y_max - world.y_min + 2.0 * margin) / resolution - 1e-9)
    origin_x, origin_y = world.x_min - margin, world.y_min - margin
    x = origin_x + (np.arange(columns) + 0.5) * resolution
    y = origin_y + (np.arange(rows) + 0.5) * resolution
    along, across = (x > world.x_min) & (x < world.x_max), (y > world.y_min) & (y < world.y_max)
    cells = np.where(across[:, np.newaxis] & along, np.int8(FREE), np.int8(UNKNOWN))
    steps = np.zeros((rows, columns + 1), dtype=np.int32)  # boxes that begin at a cell, less those that have ended
    for box in world.boxes:
        inner, first, end, edge, column = _split(box, x, y, resolution / 2.0)
        steps[inner, first] += 1
        steps[inner, end] -= 1
        touched = box.distance(x[column], y[edge]) < resolution / 2.0 - 1e-6
        cells[edge[touched], column[touched]] = OCCUPIED
    cells[np.cumsum(steps, axis=1, out=steps)[:, :-1] > 0] = OCCUPIED
    return Grid(cells, resolution, origin_x, origin_y)


def extrude(grid: Grid, name: str) -> World:
    """Return the world of a map: boxes that cover its occupied cells exactly."""
    first_rows, first_columns, rows, columns = cover(grid.cells == OCCUPIED).T
    size = grid.resolution
    x, y = grid.to_map((first_columns + columns / 2.0) * size, (first_rows + rows / 2.0) * size)
    places = zip(x.tolist(), y.tolist(), (columns * size).tolist(), (rows * size).tolist(), strict=True)
    boxes = tuple(
        Box("map", MAPPED, x, y, length, width, MAPPED_HEIGHT, grid.origin_yaw) for x, y, length, width in places
    )
    length, width = grid.size
    corner_x, corner_y = grid.to_map(np.array([0.0, length, length, 0.0]), np.array([0.0, 0.0, width, width]))
    return World(
        name,
        float(corner_x.min()),
        float(corner_x.max()),
        float(corner_y.min()),
        float(corner_y.max()),
        boxes,
        grid=grid,
    )


def box_mesh(boxes: Sequence[Box]) -> tuple[list[list[float]], list[int]]:
    """Return vertices (x, y, z in m, map frame) and triangles (three indices each, counter-clockwise) of boxes."""
    columns = np.array([(box.x, box.y, box.length, box.width, box.height, box.yaw) for box in boxes])
    x, y, length, width, height, yaw = (column[:, np.newaxis] for column in columns.T)
    along, across = length * _CORNERS[:, 0], width * _CORNERS[:, 1]
    cos, sin = np.cos(yaw), np.sin(yaw)
    vertices = np.stack(
        (x + cos * along - sin * across, y + sin * along + cos * across, height * _CORNERS[:, 2]), axis=-1
    )
    indices = _TRIANGLES + len(_CORNERS) * np.arange(len(boxes))[:, np.newaxis, np.newaxis]
    return vertices.reshape(-1, 3).tolist(), indices.ravel().tolist()


def _split(
    box: Box, x: NDArray[np.floating], y: NDArray[np.floating], margin: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Split the cells near a box into those within it and those around its edge, so that only the latter are measured.

    Args:
        box: map frame.
        x: of the centres of the columns, ascending, m.
        y: of the centres of the rows, ascending, m.
        margin: m around the box that belong to its edge.

    Returns:
        Rows; in each of them the first column within the box and the one behind the last; rows and columns of the
        cells around the edge.
    """
    reach = (abs(math.sin(box.yaw)) * box.length + abs(math.cos(box.yaw)) * box.width) / 2.0 + 2.0 * margin
    rows = np.arange(*np.searchsorted(y, (box.y - reach, box.y + reach)))
    outer_first, outer_end = _span(box, x, y[rows], margin)
    first, end = _span(box, x, y[rows], 0.0)
    first = np.clip(first, outer_first, outer_end)
    end = np.clip(end, first, outer_end)
    counts = np.concatenate((first - outer_first, outer_end - end))
    begin = np.concatenate((outer_first, end)) - (np.cumsum(counts) - counts)
    edge_columns = np.arange(counts.sum()) + np.repeat(begin, counts)
    return rows, first, end, np.repeat(np.tile(rows, 2), counts), edge_columns


def _span(
    box: Box, x: NDArray[np.floating], y: NDArray[np.floating], margin: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return for each row the first column within a box made larger by a margin (m), and the one behind the last."""
    cos, sin = math.cos(box.yaw), math.sin(box.yaw)
    sides = ((cos, sin * (y - box.y), box.length), (-sin, cos * (y - box.y), box.width))
    begin, end = np.full(len(y), -math.inf), np.full(len(y), math.inf)
    with np.errstate(over="ignore"):
        for slope, offset, size in sides:
            half = size / 2.0 + margin
            cuts = np.sort(np.stack((-half - offset, half - offset)) / (slope or 1e-300), axis=0)  # 0: far away
            begin, end = np.maximum(begin, cuts[0]), np.minimum(end, cuts[1])
    first = np.searchsorted(x, box.x + begin)
    return first, np.maximum(first, np.searchsorted(x, box.x + end, side="right"))


def _distance(centre_x: Any, centre_y: Any, length: Any, width: Any, yaw: Any, x: Any, y: Any) -> Any:
    """Return the distance of points to boxes, 0 inside; every argument a float or an array."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    along, across = np.subtract(x, centre_x), np.subtract(y, centre_y)
    outside_x = np.maximum(np.abs(cos * along + sin * across) - np.divide(length, 2.0), 0.0)
    outside_y = np.maximum(np.abs(cos * across - sin * along) - np.divide(width, 2.0), 0.0)
    return np.hypot(outside_x, outside_y)
