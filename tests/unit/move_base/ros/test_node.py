"""What the node does with odd messages and an odd clock, and with parameters that are just being changed."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from geometry_msgs.msg import Point32, Polygon
from move_base.costmap.sensors import MAX_RAYS
from move_base.parameters.costmaps import MOST_CORNERS
from move_base.ros.move_base import MoveBaseNode
from nav_msgs.msg import Odometry
from robot_formulas.geometry import STOP, Velocity


@pytest.fixture
def warnings(monkeypatch):
    warnings = []
    for name in ("logwarn_throttle", "logwarn_throttle_identical"):
        monkeypatch.setattr(rospy, name, lambda _period, text: warnings.append(text))
    monkeypatch.setattr(rospy, "logwarn", warnings.append)
    return warnings


@pytest.fixture
def node():
    node = object.__new__(MoveBaseNode)
    node._velocity = STOP
    node._lock, node._tree_lock = threading.RLock(), threading.Lock()
    node._reconfigured = None
    return node


@pytest.mark.parametrize("speed", [float("nan"), 1e300])
def test_odometry_that_no_base_has_is_ignored(node, warnings, speed):
    message = Odometry()
    message.twist.twist.linear.y = speed
    node._on_odometry(message)
    assert node._velocity == STOP
    assert warnings == ["Odometry ignored: its velocity is not finite, or over 100 m/s"]
    message.twist.twist.linear.y = 0.2
    node._on_odometry(message)
    assert node._velocity == Velocity(0.0, 0.2, 0.0)


def test_footprint_with_very_many_corners_is_ignored_before_anything_waits_for_it(node, warnings):
    node._reconfigure = None  # it is not asked
    node._on_footprint("local_costmap", Polygon([Point32()] * (MOST_CORNERS + 1)))
    assert warnings == ["Footprint ignored: it has 1001 corners, more than 1000"]


def test_footprint_in_millimetres_is_ignored(node, warnings, tree):
    node._tree = tree()
    corners = [Point32(x, y, 0.0) for x, y in ((480.0, 400.0), (-480.0, 400.0), (0.0, -400.0))]
    node._on_footprint("local_costmap", Polygon(corners))
    (warning,) = warnings
    assert "local_costmap/footprint is [[480.0, 400.0]" in warning
    assert node._reconfigured is None


def test_control_loop_does_not_wait_for_parameters_that_are_being_changed(node):
    node._tree_lock = SimpleNamespace(acquire=lambda *, blocking=True: blocking)  # another thread has it
    assert not node._take_parameters()


def test_base_is_stopped_when_the_clock_is_set_back(node, warnings):
    sent, times = [], []
    node._base = SimpleNamespace(send=sent.append)
    node._frames = SimpleNamespace(clear=lambda: None)
    node._goals = node._navigator = SimpleNamespace(reset_time=times.append)
    node._clock_set_back(5.0)
    assert (sent, times) == ([STOP], [5.0, 5.0])


def test_scan_with_very_many_rays_is_ignored(node, warnings):
    source = SimpleNamespace(data_type="LaserScan", topic="scan")
    node._on_sensor(source, SimpleNamespace(ranges=[1.0] * (MAX_RAYS + 1)))
    assert warnings == ["scan: message ignored: the scan has 20001 ranges, more than 20000"]
