"""A costmap at one moment, as planner and controller get it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from move_base.costmap.grid import INSCRIBED, UNKNOWN

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from move_base.costmap.grid import Geometry
    from move_base.costmap.inflation import Inflation

SLACK = 4
"""A part is inflated by so many cells more than asked for on each side: the robot moves on, and the next look-up finds
the part there already."""


@dataclass(frozen=True)
class Part:
    """A rectangle of a costmap; its arrays are never written to again.

    Attributes:
        row: of its first cell in the costmap's grid.
        column: see above.
        costs: 0..255 (h, w).
        clearance: distance from each cell's centre to the nearest obstacle cell's centre (h, w), m, never beyond
            the costmap's `clearance_limit`.
    """

    row: int
    column: int
    costs: NDArray[np.uint8]
    clearance: NDArray[np.float32]

    def covers(self, rows: tuple[int, int], columns: tuple[int, int]) -> bool:
        """Whether it holds all of these rows and columns, each from the first to the last."""
        height, width = self.costs.shape
        return (
            rows[0] >= self.row
            and columns[0] >= self.column
            and rows[1] < self.row + height
            and columns[1] < self.column + width
        )

    def costs_at(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Return the costs of cells, which must be in it."""
        return self.costs.take(self._flat(rows, columns))

    def clearance_at(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.float32]:
        """Return the clearance of cells, which must be in it, m."""
        return self.clearance.take(self._flat(rows, columns))

    def _flat(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.intp]:
        width = self.costs.shape[1]
        flat = rows * width
        flat += columns
        flat -= self.row * width + self.column
        return flat


@dataclass(frozen=True)
class Radii:
    """Radii of the footprint, m.

    Attributes:
        inscribed: of the padded footprint.
        circumscribed: of the padded footprint.
        pinched: inscribed radius of the footprint with half of its padding.
    """

    inscribed: float
    circumscribed: float
    pinched: float


class Snapshot:
    """A costmap at one moment. It is inflated when somebody looks, and only around where they look.

    Attributes:
        geometry: where the grid lies.
        radii: of the footprint.
    """

    def __init__(
        self,
        geometry: Geometry,
        costs: NDArray[np.uint8],
        inflation: Inflation,
        radii: Radii,
        whole: Part | None = None,
    ) -> None:
        """Keep what it is made of.

        Args:
            geometry: see above.
            costs: of all layers before inflation (H, W); nobody writes to them again.
            inflation: of the costmap.
            radii: see above.
            whole: all of it, where it is inflated already.
        """
        self.geometry = geometry
        self.radii = radii
        self._costs = costs
        self._inflation = inflation
        self._whole = whole
        self._part: Part | None = None

    @property
    def costs(self) -> NDArray[np.uint8]:
        """0..255 (H, W)."""
        return self._all.costs

    @property
    def clearance(self) -> NDArray[np.float32]:
        """Distance from each cell's centre to the nearest obstacle cell's centre (H, W), m."""
        return self._all.clearance

    @property
    def clearance_limit(self) -> float:
        """Larger distances are not told apart, m."""
        return self._inflation.limit

    def part(self, rows: tuple[int, int], columns: tuple[int, int]) -> Part:
        """Return a part that has these rows and columns, each from the first to the last, as far as the grid has them.

        The part lasts: as long as look-ups stay within it, nothing is inflated again.
        """
        rows, columns = _within(rows, self.geometry.height), _within(columns, self.geometry.width)
        if self._whole is not None:
            return self._whole
        if self._part is None or not self._part.covers(rows, columns):
            top, bottom = _within((rows[0] - SLACK, rows[1] + SLACK), self.geometry.height)
            left, right = _within((columns[0] - SLACK, columns[1] + SLACK), self.geometry.width)
            window = (slice(top, bottom + 1), slice(left, right + 1))
            self._part = Part(top, left, *self._inflation.apply_within(self._costs, *window))
        return self._part

    def part_with(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Part:
        """Return a part that has these cells, which must be in the grid."""
        return self.part((int(rows.min()), int(rows.max())), (int(columns.min()), int(columns.max())))

    def part_around(self, x: float, y: float, reach: float) -> Part:
        """Return a part that has all cells around a point, up to a distance (m) along each axis."""
        row, column = self.geometry.cell(x, y)
        cells = math.ceil(reach / self.geometry.resolution)
        return self.part((row - cells, row + cells), (column - cells, column + cells))

    @cached_property
    def pinched(self) -> NDArray[np.bool_]:
        """Known cells (H, W) where the robot fits with half of its padding, but not with all of it."""
        near: NDArray[np.bool_] = (self.costs == INSCRIBED) & (self.clearance > self.radii.pinched)
        return near & (self._costs != UNKNOWN)

    @property
    def _all(self) -> Part:
        if self._whole is None:
            self._whole = Part(0, 0, *self._inflation.apply(self._costs))
        return self._whole


def _within(ends: tuple[int, int], size: int) -> tuple[int, int]:
    """Return the first and the last index clipped to those that an axis has."""
    return min(max(ends[0], 0), size - 1), min(max(ends[1], 0), size - 1)
