"""The robot as its drivers tell it, on a master of several robots."""

import pytest
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from metacontrol_manipulation.ros.robot import RosRobot

STOPPED, WORKS = DiagnosticStatus.ERROR, DiagnosticStatus.OK


@pytest.fixture
def robot():
    """A robot with two arms that work."""
    robot = RosRobot.__new__(RosRobot)
    robot._arms, robot._stopped = {"left": None, "right": None}, set()
    return robot


def tell(robot, level, publisher, hardware_id):
    array = DiagnosticArray(status=[DiagnosticStatus(level, "left_arm: safety", "", hardware_id, [])])
    array._connection_header = {"callerid": publisher}
    robot._on_diagnostics(array)


@pytest.mark.parametrize(
    ("namespace", "publisher", "hardware_id"),
    [("/", "/left_arm", "left_arm"), ("/r1/", "/r1/left_arm", "robot:/r1"), ("/r1/", "/r1/driver", "left_arm")],
)
def test_stop_of_an_arm_is_heeded_until_it_works_again(robot, monkeypatch, namespace, publisher, hardware_id):
    monkeypatch.setattr(rospy, "get_namespace", lambda: namespace)
    tell(robot, STOPPED, publisher, hardware_id)
    assert robot.working == {"right"}
    tell(robot, WORKS, publisher, hardware_id)
    assert robot.working == {"left", "right"}


@pytest.mark.parametrize("hardware_id", ["left_arm", "robot:/r2"])
def test_stop_of_another_robot_says_nothing_of_this_one(robot, monkeypatch, hardware_id):
    monkeypatch.setattr(rospy, "get_namespace", lambda: "/r1/")
    tell(robot, STOPPED, "/r2/left_arm", hardware_id)
    assert robot.working == {"left", "right"}
    tell(robot, STOPPED, "/r1/left_arm", "left_arm")
    tell(robot, WORKS, "/r2/left_arm", hardware_id)
    assert robot.working == {"right"}


def test_robot_without_a_namespace_heeds_no_arm_of_one_with_a_namespace(robot, monkeypatch):
    monkeypatch.setattr(rospy, "get_namespace", lambda: "/")
    tell(robot, STOPPED, "/r2/left_arm", "robot:/r2")
    assert robot.working == {"left", "right"}
