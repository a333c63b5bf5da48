"""The URDF and the numbers of robot.py tell of the same robot, and PyBullet takes it."""

import xml.etree.ElementTree as ET

import pytest
from pybullet_simulator.io.robot_file import RobotFileError, planar_urdf, robot_file
from pybullet_simulator.robot.robot import Robot

URDF = ET.parse(robot_file()).getroot()  # noqa: S314
JOINTS = {joint.get("name"): joint for joint in URDF.iter("joint")}


def numbers(text):
    return [float(number) for number in (text or "0 0 0").split()]


@pytest.mark.parametrize("device", ["front_laser", "rear_laser", "camera"])
def test_sensors_sit_where_the_robot_has_them(device):
    mount = getattr(Robot(), device).mount
    joint = JOINTS[mount.frame]
    origin = joint.find("origin")
    assert joint.get("type") == "fixed" and joint.find("parent").get("link") == "base_link"
    assert numbers(origin.get("xyz")) == pytest.approx([mount.x, mount.y, mount.z])
    assert numbers(origin.get("rpy")) == pytest.approx([0.0, 0.0, mount.yaw])


def test_footprint_and_mass_are_the_robots():
    robot, chassis = Robot(), URDF.find("link[@name='chassis_link']")
    collision = chassis.find("collision")
    height = robot.height - robot.ground_clearance
    size = numbers(collision.find("geometry/box").get("size"))
    assert size == pytest.approx([robot.length, robot.width, height])
    assert numbers(collision.find("origin").get("xyz")) == pytest.approx([0, 0, robot.ground_clearance + height / 2])
    assert float(chassis.find("inertial/mass").get("value")) == robot.mass
    assert len(list(URDF.iter("collision"))) == 1


def test_four_wheels_stand_on_the_floor():
    wheels = [link for link in URDF.iter("link") if link.get("name").endswith("_wheel")]
    assert len(wheels) == 4
    for wheel in wheels:
        radius = float(wheel.find("visual/geometry/cylinder").get("radius"))
        assert numbers(JOINTS[wheel.get("name")].find("origin").get("xyz"))[2] == pytest.approx(radius)


def test_planar_robot_hangs_on_two_slides_and_a_turn():
    robot = ET.fromstring(planar_urdf(robot_file()))  # noqa: S314
    links = {link.get("name") for link in robot.iter("link")}
    children = {joint.find("child").get("link") for joint in robot.iter("joint")}
    assert links - children == {"plane"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot", "is not XML"),
        ("<robot name='a'/>", "has no link base_link"),
        ("<!DOCTYPE robot [<!ENTITY a 'b'>]><robot name='a'><link name='base_link'/></robot>", "document type"),
        (
            "<robot><link name='base_link'/>" + "<a>" * 1000 + "</a>" * 1000 + "</robot>",
            "more than 100 elements within",
        ),
        ("<robot><link name='base_link'/>" + "<link/>" * 150_000 + "</robot>", "bytes are too many"),
    ],
)
def test_bad_urdf_is_refused(tmp_path, text, said):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(RobotFileError, match=said):
        planar_urdf(path)
    with pytest.raises(RobotFileError, match="No such file or directory: check the path"):
        planar_urdf(tmp_path / "none.urdf")
