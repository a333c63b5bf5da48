"""Occupancy grids, and the rectangles that cover their occupied cells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from node_kit.one_line import OneLineError

if TYPE_CHECKING:
    from numpy.typing import NDArray

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Cell values of nav_msgs/OccupancyGrid."""
MAX_RECTANGLES = 50_000
"""That cover a grid: several times those of an untidy building; each takes some microseconds to find."""


class GridError(OneLineError, ValueError):
    """A grid that needs too many rectangles."""


@dataclass(frozen=True)
class Grid:
    """An occupancy grid in the map frame.

    Attributes:
        cells: (rows along its y, columns along its x) int8: FREE, OCCUPIED, UNKNOWN or a probability in per cent.
        resolution: m per cell.
        origin_x: outer corner of cell (0, 0), m.
        origin_y: outer corner of cell (0, 0), m.
        origin_yaw: of the grid's own axes about that corner, rad.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float
    origin_yaw: float = 0.0

    @property
    def size(self) -> tuple[float, float]:
        """Extent along its own x and y axes, m."""
        rows, columns = self.cells.shape
        return columns * self.resolution, rows * self.resolution

    def to_map(self, along: Any, across: Any) -> tuple[Any, Any]:
        """Return map coordinates (m) of points given along the grid's own axes from its origin (m)."""
        cos, sin = math.cos(self.origin_yaw), math.sin(self.origin_yaw)
        return self.origin_x + cos * along - sin * across, self.origin_y + sin * along + cos * across

    def from_map(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return coordinates along the grid's own axes (m from its origin) of points of the map frame (m)."""
        cos, sin = math.cos(self.origin_yaw), math.sin(self.origin_yaw)
        right, up = x - self.origin_x, y - self.origin_y
        return cos * right + sin * up, cos * up - sin * right

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point of the map frame lies on the grid."""
        along, across = self.from_map(x, y)
        length, width = self.size
        return bool(0.0 <= along <= length and 0.0 <= across <= width)


def cover(occupied: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return rectangles that cover the true cells exactly, each cell once.

    Greedy, along the rows or along the columns, whichever needs fewer: a run of cells is extended over the rows that
    follow for as long as all of it is occupied.

    Args:
        occupied: (rows, columns).

    Returns:
        (n, 4): first row, first column, rows, columns.

    Raises:
        GridError: it takes more than MAX_RECTANGLES.
    """
    along_rows, along_columns = _sweep(occupied), _sweep(occupied.T)
    if along_columns is not None and (along_rows is None or len(along_columns) < len(along_rows)):
        return along_columns[:, (1, 0, 3, 2)]
    if along_rows is None:
        raise GridError(f"the occupied cells need more than {MAX_RECTANGLES:,} rectangles; clear the map of specks")
    return along_rows


def _sweep(occupied: NDArray[np.bool_]) -> NDArray[np.int64] | None:
    """Return the rectangles of `cover` that grow from runs along the rows, None where they are too many."""
    rows, columns = occupied.shape
    depth = np.zeros((rows + 1, columns), dtype=np.int32)  # occupied cells in a column from a cell on
    for row in range(rows - 1, -1, -1):
        depth[row] = (depth[row + 1] + 1) * occupied[row]
    left = np.zeros((rows, columns + 2), dtype=np.int8)
    left[:, 1:-1] = occupied
    found: list[tuple[int, int, int, int]] = []
    for row in range(rows):
        # What a rectangle from above covers is gone here; what is left below it reaches as deep as `depth` says.
        edges = np.flatnonzero(np.diff(left[row]))
        if len(found) + edges.size // 2 > MAX_RECTANGLES:
            return None
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            height = int(depth[row, begin:end].min())
            left[row : row + height, begin + 1 : end + 1] = 0
            found.append((row, begin, height, end - begin))
    return np.array(found, dtype=np.int64).reshape(-1, 4)
