"""Which topics tell where a robot is and what it sees: they are known by their types and usual names. Pure."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
from metacontrol_bags import messages

from metacontrol_dashboard.state.grids import packed, yaw_of
from metacontrol_dashboard.state.pictures import picture

if TYPE_CHECKING:
    from collections.abc import Iterable

    from metacontrol_dashboard.state.feed import Feed

MAP, COSTMAP, POSE, WAY, GOAL, CAMERA = "map", "costmap", "pose", "way", "goal", "camera"

_WANTED = (
    # role, type, ends of the name, the most telling one first
    (MAP, "nav_msgs/OccupancyGrid", ("/map",)),
    (COSTMAP, "nav_msgs/OccupancyGrid", ("/global_costmap/costmap",)),
    (POSE, "nav_msgs/Odometry", ("/ground_truth/state",)),
    (POSE, "geometry_msgs/PoseWithCovarianceStamped", ("/amcl_pose", "/pose")),
    (WAY, "nav_msgs/Path", ("/NavfnROS/plan", "/global_plan", "/plan")),
    (GOAL, "move_base_msgs/MoveBaseActionGoal", ("/goal",)),
    (CAMERA, "sensor_msgs/Image", ("/image_rect_color", "/image_color", "/image_raw", "/image_rect", "/image")),
    (CAMERA, "sensor_msgs/CompressedImage", ("/compressed",)),
)
_NOT_SEEN = re.compile(r"(depth|infra|disparity|/ir/|thumb)", re.IGNORECASE)
"""In names of images that people do not look at where there is another one."""


def topics_of_places(topics: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return the topic of each role that there is one for.

    Args:
        topics: resolved names and types of all topics of the robot.
    """
    found: dict[str, str] = {}
    known = sorted((name, type_of(kind)) for name, kind in topics)
    for role, wanted, ends in _WANTED:
        for end in ends:
            names = [name for name, kind in known if kind == wanted and name.endswith(end)]
            if names and role not in found:
                found[role] = min(names, key=lambda name: (bool(_NOT_SEEN.search(name)), len(name)))
    return found


def type_of(name: str) -> str:
    """Return the name of a message type as ROS 1 has it: rosbags and bridges to ROS 2 write `package/msg/Type`."""
    return name.replace("/msg/", "/")


def take_place(feed: Feed, role: str, message: Any) -> None:
    """Have the state take what a message of a topic of places says; numbers that are not finite are left out."""
    if role in (MAP, COSTMAP):
        info = message.info
        grid = np.asarray(message.data, dtype=np.int8)
        if grid.size and grid.size == info.width * info.height:
            origin = info.origin
            place = origin.position.x, origin.position.y, yaw_of(origin.orientation)
            feed.take_map(role, packed(grid.reshape(info.height, info.width), float(info.resolution), *place))
    elif role == POSE:
        pose = message.pose.pose
        place = pose.position.x, pose.position.y, yaw_of(pose.orientation)
        if all(map(math.isfinite, place)):
            feed.take_pose(*place)
    elif role == WAY:
        points = [(p.pose.position.x, p.pose.position.y) for p in message.poses]
        feed.take_way([point for point in points if all(map(math.isfinite, point))])
    elif role == GOAL:
        position = message.goal.target_pose.pose.position
        if math.isfinite(position.x) and math.isfinite(position.y):
            feed.take_goal(position.x, position.y)
    elif role == CAMERA:
        feed.take_picture(picture(message))


def when(message: Any, received: float) -> float:
    """Return the stamp of a message in s; the time of reception where it has none."""
    return messages.header_stamp(message.header, received) if hasattr(message, "header") else received
