"""Whether a body can stand at a place of a map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from pybullet_simulator.world.grid import OCCUPIED, UNKNOWN

if TYPE_CHECKING:
    from pybullet_simulator.world.grid import Grid
    from pybullet_simulator.world.world import Box


def standing_problem(grid: Grid, body: Box) -> str | None:
    """Return why a body cannot stand where it is, None where it can.

    Args:
        grid: the map.
        body: what is to stand there, map frame.
    """
    if not grid.contains(body.x, body.y):
        return "is off the map"
    size, reach = grid.resolution, math.hypot(body.length, body.width) / 2.0 + grid.resolution
    near = [np.arange(int((at - reach) // size), int((at + reach) // size) + 1) for at in grid.from_map(body.x, body.y)]
    columns, rows = np.meshgrid(*near)
    touched = body.distance(*grid.to_map((columns + 0.5) * size, (rows + 0.5) * size)) < size / 2.0
    columns, rows = columns[touched], rows[touched]
    height, width = grid.cells.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return "is partly off the map"
    under = grid.cells[rows, columns]
    if (under == OCCUPIED).any():
        return "is in an obstacle"
    if (under == UNKNOWN).any():
        return "is where the map does not know the floor"
    return None
