"""Drives the base to places beside the cell, by `cmd_vel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Twist
from node_kit.ros.patience import Patience

from metacontrol_manipulation.handling.driving import has_arrived, speeds

if TYPE_CHECKING:
    from collections.abc import Callable

    from robot_formulas.geometry import Pose

    from metacontrol_manipulation.ros.places import BaseOdometry, Place

_RATE = 20.0
_CORRECTIONS = 4
"""How often it may turn out at the end that the base has slipped."""


class Drive:
    """The base's drive."""

    def __init__(self, odometry: BaseOdometry, place: Place) -> None:
        """Prepare.

        Args:
            odometry: of the base.
            place: where the cell is.
        """
        self._odometry, self._place = odometry, place
        self._speed = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)

    def go(
        self,
        target: Pose,
        is_wanted: Callable[[], bool],
        may_move: Callable[[], bool] = lambda: True,
        *,
        patience: float,
    ) -> bool:
        """Drive, and return whether the base stands at its place.

        Args:
            target: pose of the base in the cell frame.
            is_wanted: whether to go on.
            may_move: whether the base may move now; else it waits.
            patience: s of ROS time for the way.

        Raises:
            RobotError: it is not known where the cell is.
        """
        time_left = Patience(patience)
        try:
            for _ in range(_CORRECTIONS):
                while is_wanted() and not rospy.is_shutdown():
                    to_go = self._place.cell() @ target
                    if has_arrived(to_go, self._odometry.velocity):
                        break
                    if time_left.is_over():
                        return False
                    self._command(*(speeds(to_go) if may_move() else (0.0, 0.0, 0.0)))
                    rospy.sleep(1.0 / _RATE)
                else:
                    return False
                self._place.renew()
                if has_arrived(self._place.cell() @ target, self._odometry.velocity):
                    return True
            return False
        finally:
            self._command(0.0, 0.0, 0.0)

    def _command(self, forward: float, left: float, turn: float) -> None:
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = forward, left, turn
        self._speed.publish(twist)
