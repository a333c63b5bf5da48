"""What moves the base: commands, the last of which stops it, and a watch that none stays in force unchecked."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Twist
from robot_formulas.geometry import STOP

from move_base.ros.messages import twist_of

if TYPE_CHECKING:
    from robot_formulas.geometry import Velocity

LONGEST_UNCHECKED = 0.5
"""ROS s for which a command stays in force without another one: the default `cmd_vel_timeout` of diff_drive_controller,
by which many bases stop of themselves."""

LOOK_PERIOD = 0.05
"""Wall s between two looks at the age of the command."""

WARN_PERIOD = 5.0
"""The same warning is repeated no sooner than this, s."""


class Base:
    """The base, as commands on cmd_vel move it; it may be used by any thread."""

    def __init__(self, controller_frequency: float) -> None:
        """Prepare the topic.

        Args:
            controller_frequency: Hz, of the commands.
        """
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._lock = threading.Lock()
        self._moving_since: float | None = None  # ROS s of the command in force; None: the base is to stand still
        self._closed = False
        self.reconfigure(controller_frequency)

    def reconfigure(self, controller_frequency: float) -> None:
        """Take another frequency of commands, Hz."""
        self._longest = max(LONGEST_UNCHECKED, 2.0 / controller_frequency)

    def start_watch(self) -> None:
        """Begin to watch the age of the command, in a thread of its own: the control loop may take long for a step."""
        threading.Thread(target=self._watch, daemon=True).start()

    def send(self, velocity: Velocity) -> None:
        """Send a command."""
        with self._lock:
            if not self._closed:
                self._publish(velocity)

    def stop_unchecked(self) -> bool:
        """Stop the base if its command is too old, or from a later time than now; return whether it was."""
        with self._lock:
            if self._moving_since is None or self._closed:
                return False
            age = rospy.get_time() - self._moving_since  # read here: a command may come while the lock is waited for
            if 0.0 <= age <= self._longest:
                return False
            self._publish(STOP)
            return True

    def close(self) -> None:
        """Stop the base: this is the last command of a node that ends."""
        with self._lock:
            self._closed = True
            with contextlib.suppress(rospy.ROSException):
                self._publish(STOP)

    def _publish(self, velocity: Velocity) -> None:
        self._publisher.publish(twist_of(velocity))
        self._moving_since = None if velocity == STOP else rospy.get_time()

    def _watch(self) -> None:
        while not rospy.is_shutdown():
            with contextlib.suppress(rospy.ROSException):  # the node ends just now
                if self.stop_unchecked():
                    rospy.logwarn_throttle(
                        WARN_PERIOD, f"The base is stopped: the control loop has sent nothing for {self._longest:g} s"
                    )
            time.sleep(LOOK_PERIOD)
