"""Converts data of the core to ROS messages and back; no node is needed for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped, Quaternion, Twist
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from robot_formulas.geometry import quaternion_of, transform_of

from move_base.costmap.grid import FARTHEST, occupancy_values

if TYPE_CHECKING:
    import genpy
    import numpy as np
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose, Velocity

    from move_base.costmap.snapshot import Snapshot


def goal_problem(target: PoseStamped) -> str:
    """Return why a pose can't be a goal, or an empty text."""
    position, orientation = target.pose.position, target.pose.orientation
    values = (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)
    if not all(abs(value) <= FARTHEST for value in values):
        return f"the goal's pose is not finite, or over {FARTHEST / 1000:g} km away"
    length = math.sqrt(sum(value * value for value in values[3:]))
    if abs(length - 1.0) > 0.1:
        return f"the goal's quaternion has length {length:.2f}, must be 1"
    if not target.header.frame_id.strip("/"):
        return "the goal has no frame_id"
    return ""


def matrix_of(position: Any, q: Quaternion) -> NDArray[np.float64]:
    """Return the homogeneous 4 x 4 transform of a position and a unit quaternion."""
    return transform_of((position.x, position.y, position.z), (q.x, q.y, q.z, q.w))


def twist_of(velocity: Velocity) -> Twist:
    """Return a velocity as the command for it."""
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.angular.z = velocity.x, velocity.y, velocity.yaw
    return twist


def pose_stamped(pose: Pose, frame: str, stamp: genpy.Time) -> PoseStamped:
    """Return a pose in a frame."""
    stamped = PoseStamped()
    stamped.header.stamp = stamp
    stamped.header.frame_id = frame
    stamped.pose.position.x, stamped.pose.position.y = pose.x, pose.y
    stamped.pose.orientation = Quaternion(0.0, 0.0, *quaternion_of(pose.yaw))
    return stamped


def path_of(points: NDArray[np.float64], headings: NDArray[np.float64], frame: str, stamp: genpy.Time) -> Path:
    """Return points (N, 2) with headings (N,) as a path."""
    path = Path()
    path.header.stamp = stamp
    path.header.frame_id = frame
    for (x, y), yaw in zip(points.tolist(), headings.tolist(), strict=True):
        stamped = PoseStamped(header=path.header)
        stamped.pose.position.x, stamped.pose.position.y = x, y
        stamped.pose.orientation = Quaternion(0.0, 0.0, *quaternion_of(yaw))
        path.poses.append(stamped)
    return path


def polygon_of(corners: NDArray[np.float64], frame: str, stamp: genpy.Time) -> PolygonStamped:
    """Return corners (N, 2) as a polygon."""
    polygon = PolygonStamped()
    polygon.header.stamp = stamp
    polygon.header.frame_id = frame
    polygon.polygon.points = [Point32(x, y, 0.0) for x, y in corners.tolist()]
    return polygon


def occupancy_grid(snapshot: Snapshot, frame: str, stamp: genpy.Time) -> OccupancyGrid:
    """Return a costmap with the values that costmap_2d publishes."""
    grid = OccupancyGrid()
    g = snapshot.geometry
    grid.header.stamp = stamp
    grid.header.frame_id = frame
    grid.info.resolution, grid.info.width, grid.info.height = g.resolution, g.width, g.height
    grid.info.origin.position.x, grid.info.origin.position.y = g.origin_x, g.origin_y
    grid.info.origin.orientation.w = 1.0
    grid.data = occupancy_values(snapshot.costs).ravel().tolist()
    return grid


def occupancy_update(
    snapshot: Snapshot, area: tuple[slice, slice], frame: str, stamp: genpy.Time
) -> OccupancyGridUpdate:
    """Return a part of a costmap, rows and columns, with the values that costmap_2d publishes."""
    rows, columns = area
    update = OccupancyGridUpdate()
    update.header.stamp = stamp
    update.header.frame_id = frame
    update.x, update.y = columns.start, rows.start
    update.width, update.height = columns.stop - columns.start, rows.stop - rows.start
    update.data = occupancy_values(snapshot.costs[area]).ravel().tolist()
    return update
