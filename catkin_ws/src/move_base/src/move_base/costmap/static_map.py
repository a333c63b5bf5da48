"""The static map: checked when it comes, and placed in a costmap's grid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import ORIGIN, Pose

from move_base.costmap.grid import FARTHEST, FREE, LETHAL, UNKNOWN, Geometry
from move_base.parameters.costmaps import MAX_CELLS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from move_base.parameters.parameters import Layer

MIN_RESOLUTION, MAX_RESOLUTION = 0.001, 10.0
"""Sides of a map's cells that make sense, m."""


class MapError(ValueError):
    """A map can't be used; the message says why."""


@dataclass(frozen=True)
class MapPart:
    """A part of an occupancy grid that has changed.

    Attributes:
        column: its first column.
        row: its first row.
        occupancy: the new values (H, W), int8.
        frame: that of the map it belongs to; empty: it belongs to the newest one.
    """

    column: int
    row: int
    occupancy: NDArray[np.int8]
    frame: str = ""

    @classmethod
    def create(cls, data: Sequence[int], column: int, row: int, width: int, height: int, frame: str = "") -> MapPart:
        """Check the fields of a map_msgs/OccupancyGridUpdate.

        Raises:
            MapError: sizes do not fit.
        """
        if width <= 0 or height <= 0 or column < 0 or row < 0 or len(data) != width * height:
            raise MapError(f"the update announces {width} x {height} cells and holds {len(data)}")
        return cls(column, row, np.asarray(data, dtype=np.int8).reshape(height, width), frame.removeprefix("/"))


@dataclass(frozen=True)
class StaticMap:
    """An occupancy grid with its own origin.

    Attributes:
        geometry: the grid, before it is turned about its origin's corner.
        yaw: turn of the grid about the origin, radians.
        occupancy: -1 unknown, 0..100 (H, W), int8.
        frame: where the grid lies; empty: in that of the costmap.
    """

    geometry: Geometry
    yaw: float
    occupancy: NDArray[np.int8]
    frame: str = ""

    @classmethod
    def create(
        cls,
        data: Sequence[int],
        width: int,
        height: int,
        resolution: float,
        origin: tuple[float, float, float],
        frame: str = "",
    ) -> StaticMap:
        """Check the fields of a nav_msgs/OccupancyGrid.

        Raises:
            MapError: sizes do not fit, or values make no sense.
        """
        if not all(abs(value) <= FARTHEST for value in origin) or not MIN_RESOLUTION <= resolution <= MAX_RESOLUTION:
            raise MapError(f"the map's resolution ({resolution}) or origin ({origin}) makes no sense")
        if width <= 0 or height <= 0 or len(data) != width * height:
            raise MapError(f"the map announces {width} x {height} cells and holds {len(data)}")
        occupancy = np.asarray(data, dtype=np.int8).reshape(height, width)
        geometry = Geometry(resolution, width, height, origin[0], origin[1])
        return cls(geometry, origin[2], occupancy, frame.removeprefix("/"))

    def updated(self, part: MapPart) -> StaticMap:
        """Return the map with a part of it replaced.

        Raises:
            MapError: the part is not within the map.
        """
        height, width = part.occupancy.shape
        rows, columns = slice(part.row, part.row + height), slice(part.column, part.column + width)
        if rows.stop > self.geometry.height or columns.stop > self.geometry.width:
            raise MapError("the update reaches beyond the map")
        occupancy = self.occupancy.copy()
        occupancy[rows, columns] = part.occupancy
        return replace(self, occupancy=occupancy)


def bounding_geometry(static: StaticMap, map_pose: Pose = ORIGIN) -> Geometry:
    """Return the upright grid that holds a map.

    Args:
        static: the map.
        map_pose: pose of the map's frame in that of the grid.

    Raises:
        MapError: the grid has too many cells.
    """
    g = static.geometry
    corner = map_pose @ Pose(g.origin_x, g.origin_y, static.yaw)
    geometry = replace(g, origin_x=corner.x, origin_y=corner.y)
    if corner.yaw != 0.0:
        width, height = g.width * g.resolution, g.height * g.resolution
        corners = corner.apply(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
        low, high = corners.min(axis=0), corners.max(axis=0)
        columns, rows = np.ceil((high - low) / g.resolution - 1e-9).astype(int)
        geometry = Geometry(g.resolution, int(columns), int(rows), float(low[0]), float(low[1]))
    if geometry.width * geometry.height > MAX_CELLS:
        raise MapError(f"a costmap of it has {geometry.width:,} x {geometry.height:,} cells, over {MAX_CELLS:,}")
    return geometry


def costs_of(static: StaticMap, layer: Layer) -> NDArray[np.uint8]:
    """Return the costs of a map's cells; occupancy counts as 0..255, as in costmap_2d, so an unknown cell is 255."""
    values = np.arange(256)
    table = np.where(values >= layer.lethal_cost_threshold, LETHAL, FREE)
    if not layer.trinary_costmap:
        scaled = values / max(layer.lethal_cost_threshold, 1) * LETHAL
        table = np.where(values >= layer.lethal_cost_threshold, LETHAL, scaled)
    table[layer.unknown_cost_value % 256] = UNKNOWN if layer.track_unknown_space else FREE
    return np.asarray(table.astype(np.uint8)[static.occupancy.view(np.uint8)])


def resample(
    costs: NDArray[np.uint8], static: StaticMap, layer: Layer, target: Geometry, map_pose: Pose
) -> NDArray[np.uint8]:
    """Return a static map's costs on another grid; what the map does not cover is unknown (if tracked) or FREE.

    Args:
        costs: of the map's cells, see `costs_of`.
        static: the map.
        layer: that has it.
        target: the other grid.
        map_pose: pose of the map's frame in that of the grid.
    """
    outside = UNKNOWN if layer.track_unknown_space else FREE
    source = static.geometry
    identity = map_pose == ORIGIN and static.yaw == 0.0
    if identity and source == target:
        return costs
    # cell index of the target -> metres -> map -> the map's own grid -> cell index
    to_source = Pose(source.origin_x, source.origin_y, static.yaw).inverse() @ map_pose.inverse()
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
