"""Synthetic bags of missions, with messages as ROS serialises them."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration, Decision, FunctionGrounding, MissionEvent
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from nav_msgs.msg import OccupancyGrid, Odometry
from rosbags.rosbag1 import Writer
from std_msgs.msg import Float32, Int32
from visualization_msgs.msg import Marker, MarkerArray

if TYPE_CHECKING:
    from pathlib import Path

GOAL_ID = "/mission-1-10.000"


class BagBuilder:
    """Collects messages with their times and writes them in order."""

    def __init__(self) -> None:
        self.messages = []

    def add(self, stamp, topic, message):
        if hasattr(message, "header"):
            message.header.stamp = rospy.Time.from_sec(stamp)
        self.messages.append((stamp, topic, message))

    def event(self, stamp, kind, name="", **values):
        pairs = [KeyValue(key, str(value)) for key, value in values.items()]
        self.add(stamp, "/mission/event", MissionEvent(kind=kind, name=name, values=pairs))

    def diagnostic(self, stamp, message, key, value, name="", hardware_id=""):
        status = DiagnosticStatus(
            name=name, message=message, hardware_id=hardware_id, values=[KeyValue(key, str(value))]
        )
        self.add(stamp, "/diagnostics", DiagnosticArray(status=[status]))

    def configuration(self, stamp, configuration, state):
        functions = [FunctionGrounding("f_navigate", configuration, state)]
        self.add(stamp, "/rosgraph_manipulator/active_configuration", ActiveConfiguration(functions=functions))

    def decision(self, stamp, state, trigger, *, change, **fields):
        before, after = change
        message = Decision(id="d1", state=state, objective="o_navigate", trigger=trigger, **fields)
        message.from_configuration, message.to_configuration = before, after
        self.add(stamp, "/mros1_reasoner/decision", message)

    def quality(self, stamp, name, level):
        self.add(stamp, f"/ground_truth/{name}", Float32(level))

    def pose(self, stamp, x, y):
        message = Odometry()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        self.add(stamp, "/ground_truth/state", message)

    def contacts(self, stamp, count):
        self.add(stamp, "/ground_truth/contacts", Int32(count))

    def obstacles(self, stamp, *places):
        markers = [Marker(action=Marker.DELETEALL)]
        for number, (x, y) in enumerate(places):
            marker = Marker(type=Marker.CUBE, ns=f"obstacle_{number}")
            marker.pose.position.x, marker.pose.position.y = x, y
            markers.append(marker)
        self.messages.append((stamp, "/ground_truth/obstacles", MarkerArray(markers)))

    def goal(self, stamp):
        self.add(stamp, "/move_base/goal", MoveBaseActionGoal(goal_id=GoalID(id=GOAL_ID)))

    def result(self, stamp, status, text=""):
        message = MoveBaseActionResult(status=GoalStatus(goal_id=GoalID(id=GOAL_ID), status=status, text=text))
        self.add(stamp, "/move_base/result", message)

    def map(self, stamp, width, height, resolution=0.5):
        message = OccupancyGrid(data=[100 if cell % width in (0, width - 1) else 0 for cell in range(width * height)])
        message.info.width, message.info.height, message.info.resolution = width, height, resolution
        message.info.origin.position.x, message.info.origin.position.y = -2.0, -3.0
        self.add(stamp, "/map", message)

    def write(self, path: Path, compression: str = "none", chunk_bytes: int = 1 << 20) -> Path:
        """Write a bag, compressed by bz2 or lz4 or not, in chunks of about this size."""
        writer = Writer(path)
        if compression != "none":
            writer.set_compression(Writer.CompressionFormat[compression.upper()])
        writer.chunk_threshold = chunk_bytes
        with writer:
            connections = {}
            for stamp, topic, message in sorted(self.messages, key=lambda entry: entry[0]):
                if topic not in connections:
                    connections[topic] = writer.add_connection(
                        topic, message._type.replace("/", "/msg/"), msgdef=message._full_text, md5sum=message._md5sum
                    )
                buffer = io.BytesIO()
                message.serialize(buffer)
                writer.write(connections[topic], round(stamp * 1e9), buffer.getvalue())
        return path


def adapting_mission() -> BagBuilder:
    """Ten seconds: the laser dies at 14 s, is reported at 14.2, decided at 14.3, a camera variant stands at 15."""
    bag = BagBuilder()
    bag.map(9.0, 24, 12)
    bag.configuration(9.0, "f2_v2_r2", "STABLE")
    bag.event(
        10.0,
        "MISSION_START",
        "r1",
        route="r1",
        seed=3,
        metacontrol="true",
        failure="front_laser",
        power_factor=1.0,
        initial_configuration="f2_v2_r2",
        goal="8 0 0",
        commit="abc",
        nfr_safety=0.6,
        nfr_energy=0.62,
    )
    bag.goal(10.01)
    for tick in range(101):
        stamp = 10.0 + tick / 10
        bag.pose(stamp, min(8.0, 0.8 * tick / 10), 0.0)
    for stamp, level in ((9.5, 0.2), (16.0, 0.8), (16.4, 0.2)):
        bag.quality(stamp, "safety", level)
        bag.diagnostic(stamp + 0.1, "QA status", "safety", level)
    for stamp, level in ((9.5, 0.3), (12.0, 0.5)):
        bag.quality(stamp, "energy", level)
    bag.diagnostic(9.9, "QA status", "energy", 0.3)
    bag.diagnostic(15.0, "QA stale", "energy", "imu is silent")
    bag.diagnostic(17.0, "QA status", "energy", 0.7)
    bag.contacts(9.0, 1)
    bag.contacts(18.0, 2)
    for stamp, status in ((13.9, "TRUE"), (14.2, "FALSE"), (14.4, "FALSE")):
        bag.diagnostic(stamp, "Component status", "front_laser", status)
    for stamp, percent, megabytes in ((11.0, 10.0, 90.0), (12.0, 30.0, 110.0)):
        bag.diagnostic(stamp, "CPU Usage", "/reasoner", percent)
        bag.diagnostic(stamp, "Memory Usage", "reasoner", megabytes)
    bag.event(14.0, "PERTURBATION", "component:front_laser", share=0.4, pid=4321)
    bag.decision(14.3, "DECIDED", "component:front_laser", change=("f2_v2_r2", "f2_v1_r3_k"))
    bag.configuration(14.35, "f2_v1_r3_k", "RECONFIGURING")
    bag.configuration(14.95, "f2_v1_r3_k", "STABLE")
    executed = rospy.Time.from_sec(15.0)
    bag.decision(15.01, "EXECUTED", "component:front_laser", change=("f2_v2_r2", "f2_v1_r3_k"), stamp_executed=executed)
    bag.result(20.0, GoalStatus.SUCCEEDED)
    bag.event(20.0, "MISSION_END", "r1", outcome="reached", reason="goal reached", wall_duration_s=5.0)
    bag.pose(20.5, 8.0, 1.0)
    return bag


@pytest.fixture
def bag() -> BagBuilder:
    return BagBuilder()


@pytest.fixture
def mission_bag() -> BagBuilder:
    return adapting_mission()
