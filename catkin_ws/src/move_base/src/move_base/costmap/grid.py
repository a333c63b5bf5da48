"""Grids in the plane: where their cells lie, and what the values in them mean.

Cells are `grid[row, column]`; row grows with y, column with x. Costs are those of costmap_2d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
"""Costs: free, the robot's centre can't be here, an obstacle, not known."""

FARTHEST = 1e6
"""Coordinates beyond this (m) are a mistake: it is farther than anything drives."""


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
        """Return rows and columns of points (..., 2); they may lie outside the grid."""
        return self.cells_at(points[..., 0], points[..., 1])

    def cells_at(self, x: NDArray[np.floating], y: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of points by their coordinates, arrays of one shape."""
        scale = 1.0 / self.resolution
        columns = np.floor((x - self.origin_x) * scale).astype(np.intp)
        rows = np.floor((y - self.origin_y) * scale).astype(np.intp)
        return rows, columns

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return row and column of a point; they may lie outside the grid."""
        return (
            math.floor((y - self.origin_y) / self.resolution),
            math.floor((x - self.origin_x) / self.resolution),
        )

    def contains(self, x: float, y: float) -> bool:
        """Whether a point is in the grid; one that is not finite is not."""
        along_x, along_y = (x - self.origin_x) / self.resolution, (y - self.origin_y) / self.resolution
        return 0.0 <= along_x < self.width and 0.0 <= along_y < self.height

    def centres(self, rows: NDArray[np.integer], columns: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return the centres (N, 2) of cells in metres."""
        return np.stack(
            [
                (columns + 0.5) * self.resolution + self.origin_x,
                (rows + 0.5) * self.resolution + self.origin_y,
            ],
            axis=-1,
        )


def occupancy_values(costs: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Translate costs to the values of an OccupancyGrid as costmap_2d publishes them: 0, 1..98, 99, 100, -1."""
    table = np.zeros(256, dtype=np.int8)
    table[1:INSCRIBED] = 1 + 97 * (np.arange(1, INSCRIBED) - 1) // 251
    table[INSCRIBED], table[LETHAL], table[UNKNOWN] = 99, 100, -1
    return table[costs]


def changed_area(old: NDArray[np.uint8], new: NDArray[np.uint8]) -> tuple[slice, slice] | None:
    """Return rows and columns of the smallest rectangle outside of which two grids of one size are equal, or None."""
    rows, columns = np.nonzero(old != new)
    if not len(rows):
        return None
    return slice(int(rows.min()), int(rows.max()) + 1), slice(int(columns.min()), int(columns.max()) + 1)
