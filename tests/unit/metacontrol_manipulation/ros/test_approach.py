"""The node that moves the base to places beside the cell: goals that are none, and a cell that is lost on the way."""

import math
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import rospy
from metacontrol_manipulation.ros.approach import CELL, Approach
from metacontrol_manipulation.ros.drive import Drive
from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell
from move_base_msgs.msg import MoveBaseGoal
from nav_msgs.msg import Odometry
from robot_formulas.geometry import Pose

NAN, INF = math.nan, math.inf


def goal(x=0.0, y=0.0, z=0.0, w=1.0):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = CELL
    pose = goal.target_pose.pose
    pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w = x, y, z, w
    return goal


@pytest.fixture
def node(clock):
    """The node while the cell is 1 m ahead."""
    node = Approach.__new__(Approach)
    node._patience = 10.0
    node._server = Mock(is_preempt_requested=lambda: False)
    node._odometry = BaseOdometry()
    tell(node, 1000.0)
    node._cell = GivenCell(node._odometry, 10.0)
    node._drive = Drive(node._odometry, node._cell)
    node._cell._known, node._cell._stamp = SimpleNamespace(moved=lambda base: node.known), 1000.0
    node.known = SimpleNamespace(seen_from=lambda base: Pose(1.0, 0.0), deviation=0.0)
    return node


def tell(node, seconds):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(seconds)
    message.pose.pose.orientation.w = 1.0
    node._odometry._on_odometry(message)


def speeds(node):
    return [call.args[0].linear.x for call in node._drive._speed.publish.call_args_list]


@pytest.mark.parametrize("bad", [{"x": NAN}, {"y": INF}, {"z": NAN}, {"w": NAN}])
def test_goal_that_is_not_finite_is_refused(node, bad):
    node._move(goal(**bad))
    (_, text) = node._server.set_aborted.call_args.args
    assert text == "the goal is not finite: give numbers for its position and yaw"
    assert not speeds(node)


def test_base_stands_when_the_clock_is_set_back_on_the_way(node, clock, monkeypatch):
    def set_back(_seconds):
        assert len(speeds(node)) < 100, "it drives on"
        clock.set_to(5.0)
        tell(node, 5.0)

    monkeypatch.setattr(rospy, "sleep", set_back)
    node._move(goal())
    assert len(speeds(node)) == 2
    assert speeds(node)[0] > 0.0
    assert speeds(node)[-1] == 0.0
    assert "it is not known where the cell is" in node._server.set_aborted.call_args.args[1]


def test_clock_that_is_set_back_while_the_node_sleeps_ends_the_goal_in_one_line(node, monkeypatch):
    monkeypatch.setattr(rospy, "sleep", Mock(side_effect=rospy.exceptions.ROSTimeMovedBackwardsException(995.0)))
    node._move(goal())
    assert speeds(node)[-1] == 0.0
    assert "moved backwards" in node._server.set_aborted.call_args.args[1]


def test_goal_waits_for_the_first_view_of_a_tag(node, monkeypatch):
    known, node._cell._known = node._cell._known, None
    monkeypatch.setattr(node._cell, "wait", lambda: setattr(node._cell, "_known", known))
    node._move(goal(x=-1.0))
    node._server.set_succeeded.assert_called_once()


def test_way_ends_after_its_time_also_where_the_clock_is_set_back(node, clock, monkeypatch):
    steps = []

    def sleep(seconds):
        steps.append(seconds)
        assert len(steps) < 1000, "it drives on"
        clock.set_to(5.0 if len(steps) == 1 else rospy.get_time() + seconds)

    monkeypatch.setattr(rospy, "sleep", sleep)
    assert not node._drive.go(Pose(0.0, 0.0), lambda: True, patience=10.0)
    assert len(steps) == pytest.approx(200, abs=5)
