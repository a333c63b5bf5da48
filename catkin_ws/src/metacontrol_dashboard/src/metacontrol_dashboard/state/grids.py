"""Maps and costmaps, made small enough to send. Pure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MOST_CELLS = 300
"""Along each side; a larger map is thinned out."""
_FREE, _LIKELY, _OCCUPIED = 1, 50, 99
"""Values of a nav_msgs/OccupancyGrid from which a cell counts as something else."""


def packed(grid: NDArray[np.int8], resolution: float, x: float, y: float, yaw: float = 0.0) -> dict[str, Any]:
    """Return a grid, row 0 first, as runs of equal cells: 0 unknown, 1 free, 2 perhaps, 3 likely, 4 occupied.

    Args:
        grid: values of a nav_msgs/OccupancyGrid.
        resolution: m of a cell.
        x: of the grid's origin in the map, m.
        y: the same.
        yaw: of the grid, rad.
    """
    step = max(1, math.ceil(max(grid.shape) / _MOST_CELLS))
    if step > 1:  # of the cells that become one, the worst counts
        for axis, side in enumerate(grid.shape):
            grid = np.maximum.reduceat(grid, range(0, side, step), axis=axis)
    shade = np.digitize(grid, [0, _FREE, _LIKELY, _OCCUPIED]).astype(int).ravel()
    ends = np.flatnonzero(np.diff(shade)) + 1
    starts = np.concatenate(([0], ends))
    lengths = np.diff(np.concatenate((starts, [shade.size])))
    runs = [int(number) for pair in zip(shade[starts], lengths, strict=True) for number in pair] if shade.size else []
    size = {"rows": int(grid.shape[0]), "columns": int(grid.shape[1]), "resolution": resolution * step}
    return size | {"x": x, "y": y, "yaw": yaw, "runs": runs}


def yaw_of(orientation: Any) -> float:
    """Return the yaw of a geometry_msgs/Quaternion, rad."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
