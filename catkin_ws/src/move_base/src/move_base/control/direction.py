"""The direction of driving: ahead, or backwards, where the parameters say so.

A robot that drives backwards is one whose base is turned round: what was behind is ahead. So the controller gets pose,
velocity and footprint turned by half a turn, and its answer is turned back.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from robot_formulas.geometry import Pose, Velocity, wrap

from move_base.control.dwa import DwaController

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from move_base.control.rollout import Trajectory
    from move_base.costmap.snapshot import Snapshot
    from move_base.parameters.parameters import MoveBaseParameters


class Controller:
    """The controller of a robot that drives ahead or backwards."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self._backwards = parameters.controller.backwards
        self._ahead = DwaController(_ahead(parameters))

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Take other parameters while the robot drives."""
        if parameters.controller.backwards != self._backwards:
            self._backwards = not self._backwards
            self._ahead.reset()  # its last command was in the other direction
        self._ahead.reconfigure(_ahead(parameters))

    def reset(self) -> None:
        """Forget the last command, for a new goal."""
        self._ahead.reset()

    def follow(
        self, robot: Pose, velocity: Velocity, path: NDArray[np.float64], to_goal: float, snapshot: Snapshot
    ) -> Trajectory | None:
        """Return the best trajectory along a path; see DwaController.follow."""
        if not self._backwards:
            return self._ahead.follow(robot, velocity, path, to_goal, snapshot)
        return _turned_trajectory(
            self._ahead.follow(_turned_pose(robot), _turned_velocity(velocity), path, to_goal, snapshot)
        )

    def turn(self, robot: Pose, angle: float, snapshot: Snapshot) -> Trajectory | None:
        """Return a turn on the spot by up to `angle` (rad, signed); see DwaController.turn."""
        if not self._backwards:
            return self._ahead.turn(robot, angle, snapshot)
        return _turned_trajectory(self._ahead.turn(_turned_pose(robot), angle, snapshot))


def _ahead(parameters: MoveBaseParameters) -> MoveBaseParameters:
    """Return the parameters of the base turned round, if it drives backwards."""
    p = parameters.controller
    if not p.backwards:
        return parameters
    turned = replace(
        p, max_vel_x=0.0 - p.min_vel_x, min_vel_x=0.0 - p.max_vel_x, y_vels=tuple(sorted(-speed for speed in p.y_vels))
    )
    footprint = tuple((0.0 - x, 0.0 - y) for x, y in parameters.local_costmap.footprint)
    return replace(parameters, controller=turned, local_costmap=replace(parameters.local_costmap, footprint=footprint))


def _turned_pose(pose: Pose) -> Pose:
    return Pose(pose.x, pose.y, wrap(pose.yaw + math.pi))


def _turned_velocity(velocity: Velocity) -> Velocity:
    return Velocity(0.0 - velocity.x, 0.0 - velocity.y, velocity.yaw)  # 0.0 -: a stop is not -0.0


def _turned_trajectory(trajectory: Trajectory | None) -> Trajectory | None:
    if trajectory is None:
        return None
    poses = trajectory.poses - (0.0, 0.0, math.pi)
    return replace(trajectory, velocity=_turned_velocity(trajectory.velocity), poses=poses)
