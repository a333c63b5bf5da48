"""Where base and cell are, as messages tell it: with numbers that are none, and while the clock is set back."""

import math

import pytest
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from helpers.work_cell import HOME, tag_image
from metacontrol_manipulation.perception.camera import MAST_CAMERA
from metacontrol_manipulation.perception.localisation import CellTracker
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell, OwnTags, at_home
from nav_msgs.msg import Odometry
from robot_formulas.geometry import ORIGIN, Pose

BASE_AT_HOME = HOME.inverse()
"""In the cell frame."""


def odom(seconds, x=0.0, yaw_w=1.0, speed=0.0):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(seconds)
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, yaw_w
    message.twist.twist.linear.x = speed
    return message


def cell_pose(seconds, x=HOME.x):
    message = PoseWithCovarianceStamped()
    message.header.stamp = rospy.Time.from_sec(seconds)
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, 1.0
    return message


@pytest.fixture
def odometry(clock):
    """Odometry of a base that stands where it began, at 1000 s."""
    odometry = BaseOdometry()
    odometry._on_odometry(odom(1000.0))
    return odometry


@pytest.mark.parametrize(
    "numbers", [{"x": math.nan}, {"x": math.inf}, {"yaw_w": math.nan}, {"speed": math.nan}, {"speed": math.inf}]
)
def test_odometry_that_is_not_finite_is_ignored(odometry, numbers, caplog):
    tracker = CellTracker(at_home(BASE_AT_HOME))
    odometry._on_odometry(odom(1000.02, **numbers))
    assert (odometry.pose(), odometry.velocity) == (ORIGIN, (0.0, 0.0, 0.0))
    assert tracker.look(tag_image(MAST_CAMERA, HOME), MAST_CAMERA, odometry.pose()).ids == (0, 1)


def test_place_at_a_time_to_come_is_not_known(odometry):
    assert odometry.at(rospy.Time(1000)) == ORIGIN
    assert odometry.at(rospy.Time(1005)) is None


def test_cell_is_as_old_as_the_view_of_a_tag(odometry, clock):
    cell = GivenCell(odometry, patience=10.0)
    assert cell.age == math.inf
    with pytest.raises(RobotError, match="it is not known where the cell is"):
        cell.cell()
    cell._on_pose(cell_pose(1000.0))
    clock.set_to(1003.0)
    assert cell.age == 3.0
    assert cell.cell() == HOME


@pytest.mark.parametrize("stamp", [1002.0, 1e9])
def test_cell_of_the_future_is_ignored(odometry, stamp):
    odometry._on_odometry(odom(stamp))  # the clock of the base's driver is wrong in the same way
    cell = GivenCell(odometry, patience=10.0)
    cell._on_pose(cell_pose(stamp))
    assert cell.age == math.inf


def test_cell_is_infinitely_old_from_when_the_clock_is_set_back(odometry, clock):
    cell = GivenCell(odometry, patience=10.0)
    cell._on_pose(cell_pose(1000.0))
    for seconds in (5.0, 900.0):
        clock.set_to(seconds)
        assert cell.age == math.inf


def test_cell_in_the_former_frame_of_odometry_is_forgotten(odometry, clock):
    """Also where nobody asks for it until the clock is again where it was."""
    cell = GivenCell(odometry, patience=10.0)
    cell._on_pose(cell_pose(1000.0))
    clock.set_to(5.0)
    odometry._on_odometry(odom(5.0, x=0.3))
    clock.set_to(1001.0)
    odometry._on_odometry(odom(1001.0, x=0.3))
    assert cell.age == math.inf
    with pytest.raises(RobotError, match="it is not known where the cell is"):
        cell.cell()
    cell._on_pose(cell_pose(1001.0, x=1.0))
    assert cell.cell().x == pytest.approx(0.7)


def test_program_begins_at_home_again_when_the_clock_is_set_back(odometry):
    own = OwnTags(odometry, BASE_AT_HOME)
    own._tracker.known = at_home(Pose(-2.0, 0.0))
    odometry._on_odometry(odom(1000.1))
    assert own.cell().x == pytest.approx(2.0)
    odometry._on_odometry(odom(3.0))
    assert own.cell().x == pytest.approx(HOME.x)
