"""The tree of frames of a simulated robot, kept for some seconds: what tf is on ROS."""

from __future__ import annotations

import bisect
import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pybullet_simulator.robot.robot import Robot
    from robot_formulas.geometry import Pose

KEPT_S = 10.0
"""s; tf2's own default."""

_MAP, _ODOM, _BASE = "map", "odom", "base_link"
_TOLERANCE_S = 1e-6


class Frames:
    """Answers a navigator's questions for transforms."""

    def __init__(self, robot: Robot) -> None:
        """Take the robot's sensor frames."""
        mounts = (robot.front_laser.mount, robot.rear_laser.mount, robot.camera.mount)
        self._mounts = {mount.frame: mount.pose.matrix(mount.z) for mount in mounts}
        self._stamps: list[float] = []
        self._poses: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []

    def add(self, stamp: float, map_to_odom: Pose, odometry: Pose) -> None:
        """Take where odom lies in map, and base_link in odom, at a time (s, later than the last)."""
        placed = tuple(pose.matrix() for pose in (map_to_odom, odometry))
        self._stamps.append(stamp)
        self._poses.append((placed[0], placed[1]))
        if stamp - self._stamps[0] > 2.0 * KEPT_S:  # now and then, not at each: that would cost more
            kept = bisect.bisect_left(self._stamps, stamp - KEPT_S)
            del self._stamps[:kept], self._poses[:kept]

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Return the 4 x 4 transform from source to target at a time (the newest for None), or None."""
        if not self._stamps:
            return None
        index = len(self._stamps) - 1
        if stamp is not None:
            if stamp > self._stamps[-1] + _TOLERANCE_S:
                return None
            index = bisect.bisect_right(self._stamps, stamp + _TOLERANCE_S) - 1
        if index < 0:
            return None
        ends = [self._in_map(frame, index) for frame in (target, source)]
        if ends[0] is None or ends[1] is None:
            return None
        transform: NDArray[np.float64] = np.linalg.inv(ends[0]) @ ends[1]
        return transform

    def newest(self, target: str, source: str) -> float | None:
        """Return the time of the newest transform in s, or None; frames that never move are current at any time."""
        known = {_MAP, _ODOM, _BASE, *self._mounts}
        if not self._stamps or not {target, source} <= known:
            return None
        static = {_BASE, *self._mounts}
        return math.inf if target == source or {target, source} <= static else self._stamps[-1]

    def _in_map(self, frame: str, index: int) -> NDArray[np.float64] | None:
        """Return the transform from a frame to map."""
        map_to_odom, odom_to_base = self._poses[index]
        if frame == _MAP:
            return np.eye(4)
        if frame == _ODOM:
            return map_to_odom
        base: NDArray[np.float64] = map_to_odom @ odom_to_base
        if frame == _BASE:
            return base
        mount = self._mounts.get(frame)
        return None if mount is None else base @ mount
