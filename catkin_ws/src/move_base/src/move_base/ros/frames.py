"""The tree of frames, as the core asks for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
import tf2_ros
from robot_formulas.geometry import Pose

from move_base.costmap.grid import FARTHEST
from move_base.ros.messages import matrix_of

if TYPE_CHECKING:
    from geometry_msgs.msg import PoseStamped
    from numpy.typing import NDArray

    from move_base.costmap.surroundings import Transformer

TF_CACHE = 10.0
"""Transforms kept, s: tf2's own default."""

_SECONDS = (1 << 31) - 60
"""s: tf2 ends the process, by an exception or by a violation of memory, where a stamp has 2^31 or more (in 2038).
A minute less, because nanoseconds may add seconds."""

_UNKNOWN = (tf2_ros.TransformException, ValueError)
"""What tf2 raises where it does not know a frame; a ValueError if the name has a character that C can't take."""


class TfTransformer:
    """The navigator's access to /tf."""

    def __init__(self) -> None:
        self.buffer = tf2_ros.Buffer(cache_time=rospy.Duration.from_sec(TF_CACHE), debug=False)
        self._listener = _Listener(self.buffer)

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Return the 4 x 4 transform at a time (s), the newest for None, or None."""
        if stamp is not None and not 0.0 <= stamp < _SECONDS:
            return None
        when = rospy.Time() if stamp is None else rospy.Time.from_sec(stamp)
        try:
            transform = self.buffer.lookup_transform_core(target, source, when).transform
        except _UNKNOWN:
            return None
        matrix = matrix_of(transform.translation, transform.rotation)
        return matrix if (np.abs(matrix) <= FARTHEST).all() else None  # tf2 takes infinity for a number

    def newest(self, target: str, source: str) -> float | None:
        """Return the time of the newest transform in s, or None. Frames that never move are current at any time."""
        try:
            stamp: float = self.buffer.get_latest_common_time(target, source).to_sec()
        except _UNKNOWN:
            return None
        return stamp or math.inf

    def clear(self) -> None:
        """Forget everything, after the clock was set back."""
        self.buffer.clear()


def pose_in(target: str, stamped: PoseStamped, frames: Transformer) -> Pose | None:
    """Return a pose's projection on the plane of a frame, or None where the pose's own frame is not known there.

    The pose is transformed in space first: its frame may be tilted, as that of a camera is.
    """
    pose = matrix_of(stamped.pose.position, stamped.pose.orientation)
    frame = stamped.header.frame_id.removeprefix("/")
    if frame == target:
        return Pose.from_matrix(pose)
    matrix = frames.lookup(target, frame, None)
    return None if matrix is None else Pose.from_matrix(matrix @ pose)


class _Listener(tf2_ros.TransformListener):
    """A listener that leaves out what tf2 can't hold, and what would shut out all that comes after it.

    tf2 ignores what is older by `TF_CACHE` than the newest transform of a frame: one message from farther in the future
    would leave the robot without that frame until then.
    """

    def callback(self, data: Any) -> None:
        """Take transforms."""
        now = rospy.get_time()  # 0: simulated time has not begun
        super().callback(_before(min(_SECONDS, now + TF_CACHE) if now else _SECONDS, data))

    def static_callback(self, data: Any) -> None:
        """Take transforms that never change."""
        super().static_callback(_before(_SECONDS, data))


def _before(latest: float, data: Any) -> Any:
    """Return a message with those of its transforms whose stamps are before a time, s."""
    kept = [transform for transform in data.transforms if transform.header.stamp.to_sec() < latest]
    if len(kept) == len(data.transforms):
        return data
    publisher = data._connection_header.get("callerid", "somebody")
    rospy.logwarn_throttle(
        10.0, f"tf: transforms of {publisher} are ignored: they are stamped {TF_CACHE:g} s or more ahead of the clock"
    )
    rest = type(data)(kept)
    rest._connection_header = data._connection_header
    return rest
