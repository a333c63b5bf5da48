"""Where the base is, by its odometry, and where the cell is: by tags that a program finds itself, or as it is told."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Protocol

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from node_kit.ros.patience import Patience
from pybullet_simulator.robot.manipulator import HOME
from robot_formulas.geometry import Pose, yaw_of

from metacontrol_manipulation.perception.localisation import AHEAD, CellTracker, Localisation, Track
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.images import read_pixels, take_image

if TYPE_CHECKING:
    from collections.abc import Callable

    from node_kit.parameters import ParameterTree

GOOD = 0.008
"""m: with a larger error, a block that is in its place would look as if it were not."""
_PATIENCE = 10.0
"""s of ROS time for the first odometry, and for an image."""
_GLANCE = 1.0
"""s of ROS time in which a tag is found in some image, if it can be."""


class Place(Protocol):
    """Where the cell is."""

    def cell(self) -> Pose:
        """Return the pose of the cell frame in base_link, now."""

    def is_seen(self) -> bool:
        """Return whether it is known well enough where the cell is, after some time for that."""

    def renew(self) -> None:
        """Look again while the base stands.

        Raises:
            RobotError: it is not known well enough where the cell is.
        """


class BaseOdometry:
    """Where the base is in odom, and how fast it moves."""

    def __init__(self) -> None:
        """Begin to listen."""
        self._lock = threading.Lock()
        self._track = Track()
        self._to_forget: list[Callable[[], None]] = []
        self.velocity = (0.0, 0.0, 0.0)
        """Forward and left in m/s, turn in rad/s."""
        self._input = rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=10, tcp_nodelay=True)

    def pose(self) -> Pose:
        """Return the newest pose; wait for the first one.

        Raises:
            RobotError: there is none.
        """
        patience = Patience(_PATIENCE)
        while True:
            with self._lock:
                latest = self._track.latest
            if latest is not None:
                return latest
            if rospy.is_shutdown() or patience.is_over():
                raise RobotError(f"nothing comes on odom for {_PATIENCE:g} s: see whether the base's driver runs")
            rospy.rostime.wallsleep(0.02)

    def at(self, stamp: rospy.Time) -> Pose | None:
        """Return the pose at a time of the last seconds; None before the first one, and for a time to come."""
        with self._lock:
            pose, is_known = self._track.at(stamp.to_sec()), self._track.latest is not None
        if pose is None and is_known:
            rospy.logwarn_throttle(
                10.0, "odom is older than an image or a cell_pose: see the base's driver and the clocks"
            )
        return pose

    def when_set_back(self, forget: Callable[[], None]) -> None:
        """Have something done when the clock was set back: the frame odom may have begun anew.

        Args:
            forget: forgets places in the former frame odom; is called in a thread of rospy's.
        """
        self._to_forget.append(forget)

    def _on_odometry(self, message: Odometry) -> None:
        twist, stamp, pose = message.twist.twist, message.header.stamp.to_sec(), pose_of(message.pose.pose)
        velocity = twist.linear.x, twist.linear.y, twist.angular.z
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw, *velocity))):
            rospy.logwarn_throttle(10.0, "odom ignored: a number is not finite: see the base's driver")
            return
        with self._lock:
            is_set_back = self._track.is_set_back(stamp)
        if is_set_back:
            rospy.logwarn("the clock was set back: it has to be seen anew where the cell is")
            for forget in self._to_forget:
                forget()
        with self._lock:
            self._track.add(stamp, pose)
            self.velocity = velocity


class OwnTags:
    """The cell as the program itself finds it. At the start it knows where the base stands when it is at home."""

    def __init__(self, odometry: BaseOdometry, home: Pose) -> None:
        """Begin.

        Args:
            odometry: of the base; the frame odom begins where the base stood at home.
            home: pose of the base in the cell frame when it is at home.
        """
        self._odometry, self._home = odometry, home
        self._begin()
        odometry.when_set_back(self._begin)

    def _begin(self) -> None:
        self._tracker = CellTracker(at_home(self._home))

    def cell(self) -> Pose:
        """Return the pose of the cell frame in base_link, now."""
        return self._known(self._odometry.pose()).seen_from(self._odometry.pose())

    def is_seen(self) -> bool:
        """Return True: odometry tells it where no tag is seen."""
        return True

    def renew(self) -> None:
        """Take an image, and find the tags in it.

        Raises:
            RobotError: there is no image, or no tag is found and the base has moved.
        """
        image, camera = take_image("camera/image_raw", _PATIENCE)
        base = self._odometry.at(image.header.stamp) or self._odometry.pose()
        self._tracker.look(read_pixels(image), camera, base)
        if self._known(self._odometry.pose()).deviation > GOOD:
            raise RobotError("the base has moved, and no tag of the cell is found: see light and camera")

    def _known(self, base: Pose) -> Localisation:
        known = self._tracker.known
        assert known is not None  # noqa: S101 (it began with what is known)
        return known.moved(base)


class GivenCell:
    """The cell as another node tells it on `cell_pose`."""

    def __init__(
        self, odometry: BaseOdometry, patience: float, max_age: float = math.inf, home: Pose | None = None
    ) -> None:
        """Begin to listen.

        Args:
            odometry: of the base.
            patience: s of ROS time to wait for a pose.
            max_age: s of ROS time after which a pose is no longer well known, though the wheels have not turned: a
                base may be pushed, or the cell.
            home: pose of the base in the cell frame where the frame odom begins. With it, something is known before a
                tag is seen: not well enough to handle blocks, but to go out of the way.
        """
        self._odometry, self._patience, self._max_age = odometry, patience, max_age
        self._news = threading.Condition()
        self._known: Localisation | None = None
        self._expected = at_home(home) if home else None
        self._stamp = -math.inf
        odometry.when_set_back(self._forget)
        self._input = rospy.Subscriber("cell_pose", PoseWithCovarianceStamped, self._on_pose, queue_size=1)

    @property
    def age(self) -> float:
        """Time since a tag was seen last, s; infinite where none was since the start, or the clock was set back."""
        age = float(rospy.get_time() - self._stamp)
        return age if age >= -AHEAD else math.inf

    def wait(self) -> None:
        """Wait until the cell was told.

        Raises:
            RobotError: it is not, for some time.
        """
        self._wait(lambda: self._known is not None)

    def cell(self) -> Pose:
        """Return the pose of the cell frame in base_link, now; before it was told, as odometry has it.

        Raises:
            RobotError: it was not told since the start, or since the clock was set back, and home is not known.
        """
        known = self._known or self._expected
        if known is None:
            raise RobotError("it is not known where the cell is: wait until a tag is seen")
        return known.moved(self._odometry.pose()).seen_from(self._odometry.pose())

    def is_seen(self) -> bool:
        """Return whether it is known well enough where the cell is, after some time for that."""
        patience = Patience(_GLANCE)
        with self._news:
            while not self._is_good():
                if rospy.is_shutdown() or patience.is_over():
                    return False
                self._news.wait(0.05)
        return True

    def renew(self) -> None:
        """Wait until it is well known where the cell is.

        Raises:
            RobotError: it is not, for some time.
        """
        self._wait(self._is_good)

    def _is_good(self) -> bool:
        known = self._known
        if known is None or self.age > self._max_age:
            return False
        return known.moved(self._odometry.pose()).deviation <= GOOD

    def _wait(self, is_known: Callable[[], bool]) -> None:
        patience = Patience(self._patience)
        with self._news:
            while not is_known():
                if rospy.is_shutdown() or patience.is_over():
                    raise RobotError(
                        f"no tag of the cell is seen for {self._patience:g} s: see light, camera and localizer"
                    )
                self._news.wait(0.1)

    def _forget(self) -> None:
        with self._news:
            self._known, self._stamp = None, -math.inf

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        if message.header.stamp.to_sec() > rospy.get_time() + AHEAD:
            rospy.logwarn_throttle(10.0, "cell_pose ignored: its stamp is in the future: see the clocks of the hosts")
            return
        base = self._odometry.at(message.header.stamp)
        if base is None:
            return
        cell, variances = pose_of(message.pose.pose), (message.pose.covariance[0], message.pose.covariance[35])
        if not all(map(math.isfinite, (cell.x, cell.y, cell.yaw, *variances))) or min(variances) < 0.0:
            rospy.logwarn_throttle(10.0, "cell_pose ignored: it is not finite, or a variance is below 0")
            return
        with self._news:
            self._known = Localisation(cell, base, math.sqrt(variances[0]), math.sqrt(variances[1]))
            self._stamp = message.header.stamp.to_sec()
            self._news.notify_all()


def at_home(home: Pose) -> Localisation:
    """Return what is known while the base stands at home (its pose in the cell frame), where the frame odom begins."""
    return Localisation(home.inverse(), Pose(0.0, 0.0), 0.002, 0.002)


def home_of(parameters: ParameterTree) -> Pose:
    """Return where the base is at home, from the parameters `~home_x`, `~home_y` (m) and `~home_yaw` (rad).

    Raises:
        ParameterError: one is no number.
    """
    usual = {"x": HOME.x, "y": HOME.y, "yaw": HOME.yaw}
    return Pose(*(parameters.number(f"home_{key}", value) for key, value in usual.items()))


def pose_of(pose: object) -> Pose:
    """Return the plane part of a geometry_msgs/Pose."""
    return Pose(pose.position.x, pose.position.y, yaw_of(pose.orientation.z, pose.orientation.w))  # type: ignore[attr-defined]
