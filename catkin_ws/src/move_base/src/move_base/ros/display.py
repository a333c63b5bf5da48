"""Publishes plans, trajectories, costmaps and footprints while somebody listens."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING

import numpy as np
import rospy
from geometry_msgs.msg import PolygonStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from robot_formulas.geometry import Pose

from move_base.costmap.grid import changed_area
from move_base.ros.messages import occupancy_grid, occupancy_update, path_of, polygon_of

if TYPE_CHECKING:
    import genpy

    from move_base.costmap.snapshot import Snapshot
    from move_base.navigation.result import Result
    from move_base.parameters.parameters import CostmapParameters, MoveBaseParameters
    from move_base.ros.frames import TfTransformer


class PathDisplay:
    """Topics of the plan, of the controller's part of it, and of the chosen trajectory."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self._global_frame = parameters.global_costmap.global_frame
        self._local_frame = parameters.local_costmap.global_frame
        local = parameters.controller.name
        self._plan = rospy.Publisher(f"~{parameters.global_planner}/plan", Path, queue_size=1)
        self._global_plan = rospy.Publisher(f"~{local}/global_plan", Path, queue_size=1)
        self._local_plan = rospy.Publisher(f"~{local}/local_plan", Path, queue_size=1)

    def publish(self, result: Result) -> None:
        """Publish what a step has decided."""
        now = rospy.Time.now()
        if result.new_plan is not None:
            self._plan.publish(path_of(result.new_plan.points, result.new_plan.headings(), self._global_frame, now))
        if result.path is not None and self._global_plan.get_num_connections():
            steps = np.diff(result.path, axis=0, append=result.path[-1:])
            headings = np.arctan2(steps[:, 1], steps[:, 0])
            self._global_plan.publish(path_of(result.path, headings, self._local_frame, now))
        if result.trajectory is not None and self._local_plan.get_num_connections():
            poses = result.trajectory.poses
            self._local_plan.publish(path_of(poses[:, :2], poses[:, 2], self._local_frame, now))


class CostmapDisplay:
    """Topics of one costmap, filled at publish_frequency.

    Who begins to listen gets the whole costmap. After it, only what has changed is sent, on the topic of the updates.
    """

    def __init__(self, name: str, parameters: CostmapParameters) -> None:
        self._parameters = parameters
        self._footprint = parameters.padded_footprint()
        self._newcomers = _Newcomers()
        self._costmap = rospy.Publisher(f"~{name}/costmap", OccupancyGrid, self._newcomers, queue_size=1)
        self._updates = rospy.Publisher(f"~{name}/costmap_updates", OccupancyGridUpdate, queue_size=1)
        topic = parameters.published_footprint
        self._polygon = rospy.Publisher(in_costmap(name, topic), PolygonStamped, queue_size=1)
        self._published = -math.inf
        self._sent: Snapshot | None = None

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Take other parameters."""
        self._parameters = parameters
        self._footprint = parameters.padded_footprint()

    def publish(self, now: float, snapshot: Snapshot | None, frames: TfTransformer) -> None:
        """Publish what is due at `now` (s)."""
        p = self._parameters
        if p.publish_frequency == 0.0 or snapshot is None:
            return
        if 0.0 <= now - self._published < 1.0 / p.publish_frequency:
            return
        self._published = now
        stamp = rospy.Time.from_sec(now)
        self._publish_costs(snapshot, stamp)
        if self._polygon.get_num_connections():
            matrix = frames.lookup(p.global_frame, p.robot_base_frame, None)
            if matrix is not None:
                corners = Pose.from_matrix(matrix).apply(self._footprint)
                self._polygon.publish(polygon_of(corners, p.global_frame, stamp))

    def _publish_costs(self, snapshot: Snapshot, stamp: genpy.Time) -> None:
        p = self._parameters
        newcomers = self._newcomers.take()
        if not self._costmap.get_num_connections() and not self._updates.get_num_connections():
            self._sent = None
            return
        if newcomers or self._sent is None or p.always_send_full_costmap or self._sent.geometry != snapshot.geometry:
            self._costmap.publish(occupancy_grid(snapshot, p.global_frame, stamp))
        else:
            area = changed_area(self._sent.costs, snapshot.costs)
            if area is not None:
                self._updates.publish(occupancy_update(snapshot, area, p.global_frame, stamp))
        self._sent = snapshot


class _Newcomers(rospy.SubscribeListener):
    """Knows whether somebody has begun to listen."""

    def __init__(self) -> None:
        super().__init__()
        self._came = threading.Event()

    def peer_subscribe(self, _topic: str, _publish: object, _peer_publish: object) -> None:
        """Note that somebody listens now."""
        self._came.set()

    def take(self) -> bool:
        """Return whether somebody has begun to listen since the last call."""
        came = self._came.is_set()
        self._came.clear()
        return came


def in_costmap(name: str, topic: str) -> str:
    """Return a topic's name relative to a costmap's namespace, as the original takes it."""
    return topic if topic.startswith(("/", "~")) else f"~{name}/{topic}"
