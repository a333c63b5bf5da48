"""Publishes plans, trajectories, costmaps and footprints while somebody listens."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import rospy
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import OccupancyGrid, Path
from robot_formulas.geometry import Pose

from move_base.ros.messages import occupancy_grid, path_of, polygon_of

if TYPE_CHECKING:
    from move_base.costmap.costmap import Snapshot
    from move_base.navigation.result import Result
    from move_base.parameters.parameters import CostmapParameters
    from move_base.ros.frames import TfTransformer


class PathDisplay:
    """Topics of the plan, of the controller's part of it, and of the chosen trajectory."""

    def __init__(self, global_frame: str, local_frame: str) -> None:
        self._global_frame = global_frame
        self._local_frame = local_frame
        self._plan = rospy.Publisher("~NavfnROS/plan", Path, queue_size=1)
        self._global_plan = rospy.Publisher("~TrajectoryPlannerROS/global_plan", Path, queue_size=1)
        self._local_plan = rospy.Publisher("~TrajectoryPlannerROS/local_plan", Path, queue_size=1)

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
    """Topics of one costmap, filled at publish_frequency."""

    def __init__(self, name: str, parameters: CostmapParameters) -> None:
        self._parameters = parameters
        self._footprint = parameters.padded_footprint()
        self._costmap = rospy.Publisher(f"~{name}/costmap", OccupancyGrid, queue_size=1)
        self._polygon = rospy.Publisher(f"~{name}/footprint", PolygonStamped, queue_size=1)
        self._published = -math.inf

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
        if self._costmap.get_num_connections():
            self._costmap.publish(occupancy_grid(snapshot, p.global_frame, stamp))
        if self._polygon.get_num_connections():
            matrix = frames.lookup(p.global_frame, p.robot_base_frame, None)
            if matrix is not None:
                corners = Pose.from_matrix(matrix).apply(self._footprint)
                self._polygon.publish(polygon_of(corners, p.global_frame, stamp))
