"""Occupancy grids to ROS messages and back. No rospy, and no PyBullet: missions use these too."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from nav_msgs.msg import OccupancyGrid
from robot_formulas.geometry import quaternion_of, yaw_of

from pybullet_simulator.world.grid import Grid

if TYPE_CHECKING:
    import genpy


class GridMessageError(ValueError):
    """A nav_msgs/OccupancyGrid that makes no sense."""


def occupancy_grid(grid: Grid, now: genpy.Time) -> OccupancyGrid:
    """Return the map."""
    message = OccupancyGrid()
    message.header.stamp = message.info.map_load_time = now
    message.header.frame_id = "map"
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x, message.info.origin.position.y = grid.origin_x, grid.origin_y
    orientation = message.info.origin.orientation
    orientation.z, orientation.w = quaternion_of(grid.origin_yaw)
    message.data = grid.cells.ravel().tolist()
    return message


def read_grid(message: OccupancyGrid) -> Grid:
    """Return the grid of a map.

    Raises:
        GridMessageError: its size does not fit its data, or its origin is not finite.
    """
    info, origin = message.info, message.info.origin
    yaw = yaw_of(origin.orientation.z, origin.orientation.w)
    if not all(map(math.isfinite, (info.resolution, origin.position.x, origin.position.y, yaw))) or (
        info.resolution <= 0.0 or len(message.data) != info.width * info.height or not message.data
    ):
        raise GridMessageError(
            f"map of {info.width} x {info.height} cells of {info.resolution} m has {len(message.data)} values at "
            f"({origin.position.x}, {origin.position.y})"
        )
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    return Grid(cells, float(info.resolution), origin.position.x, origin.position.y, yaw)
