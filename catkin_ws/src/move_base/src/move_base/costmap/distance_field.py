"""Distances to the nearest obstacle, brought up to date where obstacles came or went."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class DistanceField:
    """The squared distance of each cell of a grid to the nearest obstacle, in cells, up to a limit.

    A whole grid is sooner transformed by OpenCV. A few obstacles that came or went are sooner looked at one by one:

    - Where an obstacle has gone, only those cells change that were as far from it as from their nearest obstacle. Each
      of them looks along its row: the distance to the nearest obstacle in each column is known (`_rises`).
    - Where an obstacle has come, the cells around it are as near as that, or nearer already.

    The grid is kept with a border, so that no look-up leaves it.
    """

    def __init__(self, obstacles: NDArray[np.bool_], squares: NDArray[np.float32], reach: int) -> None:
        """Start with a transformed grid.

        Args:
            obstacles: cells that are obstacles (H, W).
            squares: squared distances (H, W), whole numbers up to the square of reach + 1, which means "farther".
            reach: largest distance that is told apart, cells.
        """
        self._height, self._width = obstacles.shape
        self._reach = reach
        self._far = (reach + 1) ** 2
        self._border = 2 * reach
        self._stride = self._width + 2 * self._border
        kind = np.min_scalar_type(self._far)
        self._obstacles = self._bordered(obstacles, False).ravel()
        self._squares = self._bordered(squares.astype(kind), self._far).ravel()
        steps = np.arange(-reach, reach + 1)
        self._steps = steps
        self._step_squares = (steps * steps).astype(np.int32)
        around = self._step_squares[:, None] + self._step_squares
        rows, columns = np.nonzero(around < self._far)
        self._disc = (rows - reach) * self._stride + columns - reach
        self._disc_squares = around[rows, columns].astype(kind)

    @property
    def worthwhile(self) -> int:
        """Number of obstacles that may come and go at once before a transform of the whole grid is faster."""
        return 2 * self._height * self._width // len(self._disc)

    def change(self, came: NDArray[np.intp], gone: NDArray[np.intp]) -> NDArray[np.intp]:
        """Let obstacles come and go. Cells are given by their index in the flat grid.

        Args:
            came: cells that are obstacles now.
            gone: cells that were.

        Returns:
            The cells whose distances may have changed, some of them twice.
        """
        rises = self._rises
        came, gone = self._inwards(came), self._inwards(gone)
        self._obstacles[came] = True
        self._obstacles[gone] = False
        self._measure_columns(rises, np.concatenate([came, gone]))
        around = gone[:, None] + self._disc
        orphans = around[self._squares.take(around) == self._disc_squares]
        across = rises.take(orphans[:, None] + self._steps)
        across *= across
        across += self._step_squares
        self._squares[orphans] = np.minimum(across.min(axis=1), self._far)
        around = came[:, None] + self._disc
        nearer = self._disc_squares < self._squares.take(around)
        adopted = around[nearer]
        np.minimum.at(self._squares, adopted, np.broadcast_to(self._disc_squares, around.shape)[nearer])
        return self._outwards(np.concatenate([orphans, adopted]))

    def squares(self, cells: NDArray[np.intp]) -> NDArray[np.float32]:
        """Return the squared distances of cells, given by their index in the flat grid."""
        return self._squares.take(self._inwards(cells)).astype(np.float32)

    @cached_property
    def _rises(self) -> NDArray[np.int32]:
        """Distance of each cell to the nearest obstacle in its column, cells, up to reach + 1, with border and flat."""
        grid = np.where(self._obstacles, 0, self._reach + 1).astype(np.int32).reshape(-1, self._stride)
        for rows in (grid, grid[::-1]):
            for row, next_row in pairwise(rows):
                np.minimum(next_row, row + 1, out=next_row)
        return grid.ravel()

    def _measure_columns(self, rises: NDArray[np.int32], changed: NDArray[np.intp]) -> None:
        """Measure anew the columns around cells that have changed, as far as these can be felt."""
        reach = self._reach
        places = np.arange(4 * reach + 1)
        stretches = changed[:, None] + (places - 2 * reach) * self._stride
        obstacles = self._obstacles.take(stretches)
        far = 2 * len(places)
        before = np.maximum.accumulate(np.where(obstacles, places, -far), axis=1)
        after = np.minimum.accumulate(np.where(obstacles, places, far)[:, ::-1], axis=1)[:, ::-1]
        nearest = np.minimum(np.minimum(places - before, after - places), reach + 1)
        felt = slice(reach, 3 * reach + 1)
        rises[stretches[:, felt]] = nearest[:, felt]

    def _bordered(self, grid: NDArray[np.generic], value: float) -> NDArray[np.generic]:
        return np.pad(grid, self._border, constant_values=value)

    def _inwards(self, cells: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the indices of cells in the grid with its border."""
        rows, columns = np.divmod(cells, self._width)
        return (rows + self._border) * self._stride + columns + self._border

    def _outwards(self, cells: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the indices in the grid of those cells that are not in its border."""
        rows, columns = np.divmod(cells, self._stride)
        rows -= self._border
        columns -= self._border
        inside = (rows >= 0) & (rows < self._height) & (columns >= 0) & (columns < self._width)
        return (rows * self._width + columns)[inside]
