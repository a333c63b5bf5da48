"""The node that listens to a mission: `python -m soak.observer` writes what it hears to its output, a line each.

A line on its input, the name of a configuration, is requested from the manipulator.
"""

from __future__ import annotations

import os
import struct
import sys
import threading
import time
from typing import Any

import rospy
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    MissionEvent,
    MvpReconfigurationActionGoal,
    MvpReconfigurationGoal,
)
from nav_msgs.msg import Odometry
from node_kit.io.xml_rpc import CallError, Client

from soak.observed import Beat, Event, Pose, Scan, Told, Trouble, line

CAMERA = "camera/depth/points"
DRIVERS = ("/front_laser", "/rear_laser", "/camera")
_POSE_PERIOD = 0.1  # s, ROS time, between two poses that are written
_WORK_S = 0.01
"""CPU s of the work by which the observer measures how busy the machine is; longer than a scheduler's favour lasts."""
_STAMP = struct.Struct("<4xII")
"""Of a message that begins with a header."""


def main() -> None:
    """Listen until the output or the master is gone."""
    _wait_for_time()
    rospy.init_node("soak_observer", disable_signals=True)
    observer = Observer()
    threading.Thread(target=observer.obey, daemon=True).start()
    while not rospy.is_shutdown() and os.getppid() != 1:
        began, work = time.monotonic(), time.thread_time()
        while time.thread_time() - work < _WORK_S:
            pass
        observer.write("beats", Beat(time.monotonic(), round((time.monotonic() - began) / _WORK_S, 2)))
        time.sleep(1.0)


def _wait_for_time() -> None:
    master = Client(os.environ["ROS_MASTER_URI"], "/soak_observer")
    while os.getppid() != 1:
        try:
            if master.call("getParam", "/use_sim_time"):
                return
        except CallError:
            pass
        time.sleep(0.2)
    sys.exit(1)


class Observer:
    """Writes what it hears."""

    def __init__(self) -> None:
        """Listen to all but the camera, which works only while somebody listens."""
        self._lock = threading.Lock()
        self._posed = -1.0
        self._told: set[str] = set()
        self._camera: rospy.Subscriber | None = None
        self._request = rospy.Publisher(
            "rosgraph_manipulator_action_server/goal", MvpReconfigurationActionGoal, queue_size=5
        )
        rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, self._on_configuration)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)
        rospy.Subscriber("mission/event", MissionEvent, self._on_event)
        rospy.Subscriber("ground_truth/state", Odometry, self._on_pose)
        for topic in ("front/scan", "rear/scan"):
            rospy.Subscriber(topic, rospy.AnyMsg, self._on_scan, callback_args=topic)

    def write(self, what: str, content: Any) -> None:
        """Write an observation; end where nobody reads it."""
        with self._lock:
            try:
                sys.stdout.write(line(what, content) + "\n")
                sys.stdout.flush()
            except OSError:
                os._exit(1)

    def obey(self) -> None:
        """Request the configurations that come on the input; end with it."""
        for text in sys.stdin:
            goal = MvpReconfigurationActionGoal(goal=MvpReconfigurationGoal(text.strip()))
            goal.header.stamp = rospy.Time.now()
            goal.goal_id = GoalID(goal.header.stamp, f"soak {time.monotonic()}")
            self._request.publish(goal)
        os._exit(0)

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        if not _is_from(message, "/rosgraph_manipulator"):
            return
        functions = {one.function: (one.configuration, one.state) for one in message.functions}
        self.write("told", Told(time.monotonic(), rospy.get_time(), functions))
        wanted = any(one.configuration.endswith("_k") for one in message.functions)
        if wanted and self._camera is None:
            self._camera = rospy.Subscriber(CAMERA, rospy.AnyMsg, self._on_scan, callback_args=CAMERA)
        elif not wanted and self._camera is not None:
            self._camera.unregister()
            self._camera = None

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = " ".join(f"{pair.key}={pair.value}" for pair in status.values)
            failed = status.level > 0 or "FALSE" in values
            text = f"{status.name}: {status.message} {values}"
            if failed and text not in self._told:
                self._told.add(text)
                self.write("troubles", Trouble(time.monotonic(), text))

    def _on_event(self, message: MissionEvent) -> None:
        values = {pair.key: pair.value for pair in message.values}
        self.write("events", Event(time.monotonic(), message.kind, values))

    def _on_pose(self, message: Odometry) -> None:
        stamp = message.header.stamp.to_sec()
        if 0.0 <= stamp - self._posed < _POSE_PERIOD:
            return
        self._posed = stamp
        twist = message.twist.twist.linear
        self.write("poses", Pose(time.monotonic(), stamp, round((twist.x**2 + twist.y**2) ** 0.5, 3)))

    def _on_scan(self, message: rospy.AnyMsg, topic: str) -> None:
        if not _is_from(message, *DRIVERS):
            return
        seconds, nanoseconds = _STAMP.unpack_from(message._buff)
        self.write("scans", Scan(time.monotonic(), topic, round(seconds + nanoseconds / 1e9, 3)))


def _is_from(message: Any, *nodes: str) -> bool:
    """Tell whether a message comes from one of these nodes: a stranger's wrong data are no observation."""
    return message._connection_header.get("callerid") in nodes


if __name__ == "__main__":
    main()
