"""The node that measures the power load goes on, whatever it is told."""

from unittest.mock import Mock

import pytest
import rospy
from metacontrol_sim.ros.battery_load_control import BatteryLoadControlNode
from metacontrol_sim.srv import IncreaseConsumptionFactorRequest
from nav_msgs.msg import Odometry


@pytest.fixture
def node(monkeypatch):
    """The node without topics, started at 10 s."""
    monkeypatch.setattr(rospy, "Publisher", Mock(side_effect=lambda *_, **__: Mock()))
    for name in ("Subscriber", "Service", "Timer"):
        monkeypatch.setattr(rospy, name, Mock())
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    at(monkeypatch, 10.0)
    return BatteryLoadControlNode()


def at(monkeypatch, seconds):
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time.from_sec(seconds))


def loads(node):
    return [call.args[0] for call in node._load.publish.call_args_list]


@pytest.mark.parametrize("speed", [1.7e308, -1.7e308, float("inf"), float("nan")])
def test_speed_that_is_none_is_ignored(node, monkeypatch, speed):
    odometry = Odometry()
    odometry.twist.twist.linear.x = speed
    node._on_odometry(odometry)
    at(monkeypatch, 11.0)
    node._on_tick(None)
    assert loads(node) == [0.2]


def test_factor_that_is_absurd_is_refused(node, monkeypatch):
    assert not node._on_increase_consumption(IncreaseConsumptionFactorRequest(1e308)).success
    at(monkeypatch, 11.0)
    node._on_tick(None)
    assert loads(node) == [0.2]


def test_load_that_can_not_be_told_does_not_end_the_timer(node, monkeypatch):
    node._meter.factor = float("nan")
    at(monkeypatch, 11.0)
    node._on_tick(None)
    node._meter.factor = 1.0
    at(monkeypatch, 12.0)
    node._on_tick(None)
    assert loads(node) == [0.2]


def test_topic_that_is_closed_does_not_end_the_timer(node, monkeypatch):
    node._load.publish.side_effect = rospy.ROSException("publish() to a closed topic")
    at(monkeypatch, 11.0)
    node._on_tick(None)
    assert len(loads(node)) == 1
