"""The tree of frames of a simulated robot, kept for some seconds: what tf is on ROS."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pybullet_simulator.robot.robot import Robot
    from robot_formulas.geometry import Pose

KEPT_S = 10.0
"""s; tf2's own default."""

_MAP, _ODOM, _BASE = "map", "odom", "base_link"
_IDENTITY = np.eye(4)
_TOLERANCE_S = 1e-6


class Frames:
    """Answers a navigator's questions for transforms."""

    def __init__(self, robot: Robot) -> None:
        """Take the robot's sensor frames."""
        mounts = (robot.front_laser.mount, robot.rear_laser.mount, robot.camera.mount)
        self._mounts = {mount.frame: mount.pose.matrix(mount.z) for mount in mounts}
        self._static = {_BASE, *self._mounts}
        self._known = {_MAP, _ODOM, *self._static}
        self._stamps: list[float] = []
        self._moments: list[_Moment] = []

    def add(self, stamp: float, map_to_odom: Pose, odometry: Pose) -> None:
        """Take where odom lies in map, and base_link in odom, at a time (s, later than the last)."""
        last = self._moments[-1].odom if self._moments else None
        odom = last if last is not None and last.pose == map_to_odom else _Odom(map_to_odom)
        self._stamps.append(stamp)
        self._moments.append(_Moment(odom, odometry))
        if stamp - self._stamps[0] > 2.0 * KEPT_S:  # now and then, not at each: that would cost more
            kept = bisect.bisect_left(self._stamps, stamp - KEPT_S)
            del self._stamps[:kept], self._moments[:kept]

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Return the 4 x 4 transform from source to target at a time (the newest for None), or None."""
        if not self._stamps or target not in self._known or source not in self._known:
            return None
        index = len(self._stamps) - 1
        if stamp is not None:
            if stamp > self._stamps[-1] + _TOLERANCE_S:
                return None
            index = bisect.bisect_right(self._stamps, stamp + _TOLERANCE_S) - 1
        if index < 0:
            return None
        moment = self._moments[index]
        if target == _ODOM:
            to_target = moment.odom.inverse
        else:
            to_target = _IDENTITY if target == _MAP else np.asarray(np.linalg.inv(self._in_map(target, moment)))
        transform: NDArray[np.float64] = to_target @ self._in_map(source, moment)
        return transform

    def newest(self, target: str, source: str) -> float | None:
        """Return the time of the newest transform in s, or None; frames that never move are current at any time."""
        if not self._stamps or target not in self._known or source not in self._known:
            return None
        return math.inf if target == source or {target, source} <= self._static else self._stamps[-1]

    def _in_map(self, frame: str, moment: _Moment) -> NDArray[np.float64]:
        """Return the transform from a frame to map."""
        if frame == _MAP:
            return _IDENTITY
        if frame == _ODOM:
            return moment.odom.in_map
        return moment.base if frame == _BASE else moment.base @ self._mounts[frame]


@dataclass
class _Odom:
    """Where odom lies in map, until the localisation corrects it."""

    pose: Pose

    @cached_property
    def in_map(self) -> NDArray[np.float64]:
        return self.pose.matrix()

    @cached_property
    def inverse(self) -> NDArray[np.float64]:
        inverse: NDArray[np.float64] = np.asarray(np.linalg.inv(self.in_map))
        return inverse


@dataclass
class _Moment:
    """Where the frames are at one time; few of these are asked for."""

    odom: _Odom
    odometry: Pose

    @cached_property
    def base(self) -> NDArray[np.float64]:
        """The transform from base_link to map."""
        return self.odom.in_map @ self.odometry.matrix()
