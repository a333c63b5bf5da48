"""The mobile manipulator's URDF is whole, and as good for robot_state_publisher as for PyBullet."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from pybullet_simulator.io.manipulator_file import manipulator_urdf, planar_manipulator_urdf
from pybullet_simulator.robot.manipulator import ARMS, MAST_CAMERA

URDF = ET.fromstring(manipulator_urdf())  # noqa: S314
JOINTS = {joint.get("name"): joint for joint in URDF.iter("joint")}


def ends(robot):
    links = {link.get("name") for link in robot.findall("link")}
    parents = {joint.find("parent").get("link") for joint in robot.findall("joint")}
    children = [joint.find("child").get("link") for joint in robot.findall("joint")]
    return links, parents, children


def test_it_is_one_tree_from_base_link():
    links, parents, children = ends(URDF)
    assert len(links) == len(URDF.findall("link")) and len(children) == len(set(children))
    assert parents <= links and set(children) <= links
    assert links - set(children) == {"base_link"}


@pytest.mark.parametrize("mount", ARMS, ids=lambda mount: mount.name)
def test_arms_stand_where_they_are_mounted(mount):
    joint = JOINTS[f"{mount.name}_panda_link0"]
    assert joint.find("parent").get("link") == "base_link"
    assert [float(number) for number in joint.find("origin").get("xyz").split()] == [mount.x, mount.y, mount.z]
    assert {f"{mount.name}_panda_joint{number}" for number in range(1, 8)} < set(JOINTS)
    assert f"{mount.name}_panda_grasptarget" in ends(URDF)[0]
    assert JOINTS[f"{mount.name}_panda_finger_joint2"].find("mimic").get("joint") == f"{mount.name}_panda_finger_joint1"


def test_joints_end_where_the_data_sheet_says():
    limits = [JOINTS[f"left_panda_joint{number}"].find("limit") for number in range(1, 8)]
    assert [float(limit.get("lower")) for limit in limits] == [
        -2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973,
    ]  # fmt: skip
    assert [float(limit.get("velocity")) for limit in limits] == [2.175] * 4 + [2.61] * 3
    assert [float(limit.get("effort")) for limit in limits] == [87.0] * 4 + [12.0] * 3


def test_camera_is_on_the_mast_and_looks_down():
    origin = JOINTS["camera_link"].find("origin")
    assert origin.get("xyz") == f"{MAST_CAMERA.x} {MAST_CAMERA.y} {MAST_CAMERA.z}"
    assert [float(number) for number in origin.get("rpy").split()] == [0.0, MAST_CAMERA.pitch, 0.0]
    assert JOINTS["camera_optical_frame"].find("parent").get("link") == "camera_link"


def test_meshes_are_files_of_pybullet_data_for_both_readers():
    meshes = [mesh.get("filename") for mesh in URDF.iter("mesh")]
    assert len(meshes) == 2 * 2 * 9  # two arms, seen and felt; fingers are boxes
    assert all(name.startswith("file:///") and "/pybullet_data/" in name for name in meshes)
    planar = ET.fromstring(planar_manipulator_urdf())  # noqa: S314
    assert all(Path(mesh.get("filename")).is_file() for mesh in planar.iter("mesh"))
    links, _, children = ends(planar)
    assert links - set(children) == {"plane"}
