"""Inflation by the published cost function, and the distance to the nearest obstacle that comes with it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from move_base.costmap.distance_field import DistanceField
from move_base.costmap.grid import FREE, INSCRIBED, LETHAL, UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.parameters.parameters import Layer


class Inflation:
    """Costs around obstacles, for one footprint on a grid of one resolution; without a layer only distances.

    Attributes:
        limit: larger distances are not told apart, m.
    """

    def __init__(self, layer: Layer | None, resolution: float, inscribed: float, circumscribed: float) -> None:
        """Tabulate the cost function over the distance, so that a look-up inflates the whole grid.

        The table of 256 costs reaches a cell beyond the larger of the inflation and the circumscribed radius.

        Args:
            layer: the inflation layer, if there is one.
            resolution: of the grid, m.
            inscribed: radius of the padded footprint, m.
            circumscribed: the same, m.
        """
        self._resolution = resolution
        self._costs = layer is not None
        self._least_known = FREE + 1 if layer is not None and layer.inflate_unknown else INSCRIBED
        radius = layer.inflation_radius if layer is not None else 0.0
        factor = layer.cost_scaling_factor if layer is not None else 0.0
        reach = max(radius, circumscribed, inscribed) / resolution + 2.0
        self._reach = math.ceil(reach)  # cells
        self._scale = 254.0 / reach  # entries per cell of distance
        self.limit = (LETHAL - 1) / self._scale * resolution
        distances = np.arange(256) / self._scale * resolution
        costs = (INSCRIBED - 1) * np.exp(-factor * np.maximum(distances - inscribed, 0.0))
        costs = np.where(distances <= inscribed, INSCRIBED, costs)
        costs = np.where((distances > radius) & (distances > 0.0), FREE, costs)
        costs[0] = LETHAL
        self._table = costs.astype(np.uint8)

    @property
    def reach(self) -> int:
        """No obstacle farther away than this counts, cells."""
        return self._reach

    def apply(self, costs: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return the inflated costs (H, W), and each cell's distance to the nearest obstacle (H, W), m."""
        return self.look_up(costs, self.squares(costs))

    def apply_within(
        self, costs: NDArray[np.uint8], rows: slice, columns: slice
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return the same for a part of the grid."""
        top, left = max(rows.start - self._reach, 0), max(columns.start - self._reach, 0)
        window = costs[top : rows.stop + self._reach, left : columns.stop + self._reach]
        part = (slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left))
        inflated, clearance = self.apply(np.ascontiguousarray(window))
        return np.ascontiguousarray(inflated[part]), np.ascontiguousarray(clearance[part])

    def squares(self, costs: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return each cell's squared distance to the nearest obstacle, cells; larger than the reach are as one more."""
        cells = cv2.distanceTransform((costs != LETHAL).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        np.minimum(cells, np.float32(self._reach + 1), out=cells)  # without any obstacle they are huge
        cells *= cells  # a whole number; in cv2 the last bit of its root depends on the place in the row
        return np.rint(cells, out=cells)

    def look_up(
        self, costs: NDArray[np.uint8], squares: NDArray[np.float32]
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return inflated costs and distances (m) of cells with these costs and squared distances, in arrays alike."""
        cells = np.sqrt(squares)
        clearance = np.minimum(cells * np.float32(self._resolution), np.float32(self.limit))
        if not self._costs:
            return costs, clearance
        unknown = costs == UNKNOWN
        steps = cv2.convertScaleAbs(cells, alpha=self._scale)
        inflated = np.asarray(cv2.LUT(steps, self._table), dtype=np.uint8).reshape(costs.shape)
        if unknown.any():
            inflated[unknown & (inflated < self._least_known)] = UNKNOWN
        return inflated, clearance


class IncrementalInflation:
    """Inflates the costs of a grid again and again, and looks only at what has changed where that is little."""

    def __init__(self, inflation: Inflation) -> None:
        """Begin without any costs."""
        self._inflation = inflation
        self._last: tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]] | None = None
        self._field: DistanceField | None = None

    def update(self, costs: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return what `Inflation.apply` returns; nobody may write to the costs again."""
        inflated = self._inflate_changes(costs) or self._inflate_all(costs)
        self._last = costs, *inflated
        return inflated

    def _inflate_all(self, costs: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        squares = self._inflation.squares(costs)
        self._field = DistanceField(costs == LETHAL, squares, self._inflation.reach)
        return self._inflation.look_up(costs, squares)

    def _inflate_changes(self, costs: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float32]] | None:
        """Return the same where little has changed, else None."""
        if self._last is None or self._field is None or self._last[0].shape != costs.shape:
            return None
        before, inflated, clearance = self._last
        changed = np.flatnonzero(costs != before)
        if not len(changed):
            return inflated, clearance
        came, went = costs.take(changed) == LETHAL, before.take(changed) == LETHAL
        if np.count_nonzero(came != went) > self._field.worthwhile:
            return None
        moved = self._field.change(changed[came & ~went], changed[went & ~came])
        cells = np.concatenate([moved, changed])
        inflated, clearance = inflated.copy(), clearance.copy()
        looked_up = self._inflation.look_up(costs.take(cells), self._field.squares(cells))
        inflated.put(cells, looked_up[0])
        clearance.put(cells, looked_up[1])
        return inflated, clearance
