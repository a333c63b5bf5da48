"""The mobile manipulator's URDF: the base of this package with two Pandas of pybullet_data and a camera on a mast.

It is composed whenever it is read: nothing of pybullet_data is copied.
"""

from __future__ import annotations

import copy
import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import pybullet_data

from pybullet_simulator.io.robot_file import ROOT, put_on_planar_joints, read_robot, robot_file
from pybullet_simulator.robot.manipulator import ARMS, MAST_CAMERA

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pybullet_simulator.robot.manipulator import ArmMount

_PACKAGE = "package://"
_MAST = 0.04  # m, its thickness
_PAD, _PAD_HEIGHT = (0.0176, 0.0143, 0.0176), 0.0362
"""m: what of a finger touches a block, and how far it is from the hand."""
_FINGER, _PAD_RISE = (0.0208, 0.0215, 0.0362), 0.004
"""m: the rest of a finger, and how far it is behind the pad's face."""


def manipulator_urdf() -> str:
    """Return the URDF as robot_state_publisher takes it: root base_link, meshes by `file://` and an absolute path.

    Links and joints of an arm begin with `left_` or `right_`: left_panda_joint1, right_panda_grasptarget.

    Raises:
        RobotFileError: the base's URDF cannot be used.
    """
    return ET.tostring(_compose(), encoding="unicode")


def planar_manipulator_urdf() -> str:
    """Return the URDF as PyBullet takes it: the root slides and turns in the plane.

    Raises:
        RobotFileError: the base's URDF cannot be used.
    """
    robot = _compose()
    for mesh in robot.iter("mesh"):
        mesh.set("filename", mesh.get("filename", "").removeprefix("file://"))
    put_on_planar_joints(robot)
    return ET.tostring(robot, encoding="unicode")


def _compose() -> ET.Element:
    robot = read_robot(robot_file())
    robot.set("name", "manipulator")
    for tag in ("link", "joint"):  # the base's own camera is low in front, where the table is
        robot.remove(_named(robot, tag, "camera_link"))
    robot.extend(_mast())
    path = Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"
    panda = ET.parse(path).getroot()  # noqa: S314 (comes with PyBullet)
    for mount in ARMS:
        robot.extend(_arm(panda, path.parent, mount))
    return robot


def _arm(panda: ET.Element, folder: Path, mount: ArmMount) -> Iterator[ET.Element]:
    """Yield the links and joints of an arm, and the joint on which it stands."""
    arm = copy.deepcopy(panda)
    prefix = mount.name + "_"
    for link in arm.findall("link"):
        link.set("name", prefix + link.get("name", ""))
        if link.get("name", "").endswith("finger"):
            _box_finger(link)
        _look_simple(link)
        for mesh in link.iter("mesh"):
            mesh.set("filename", (folder / mesh.get("filename", "").removeprefix(_PACKAGE)).as_uri())
        yield link
    for joint in arm.findall("joint"):
        joint.set("name", prefix + joint.get("name", ""))
        for name in ("parent", "child"):
            end = joint.find(name)
            if end is not None:
                end.set("link", prefix + end.get("link", ""))
        mimic = joint.find("mimic")
        if mimic is not None:
            mimic.set("joint", prefix + mimic.get("joint", ""))
        _limit(joint)
        yield joint
    yield _fixed(prefix + "panda_link0", ROOT, (mount.x, mount.y, mount.z))


def _box_finger(link: ET.Element) -> None:
    """Let a finger collide as boxes, by the measures of its mesh. A block's edge can get caught in the mesh."""
    side = -1.0 if "rightfinger" in link.get("name", "") else 1.0
    for collision in link.findall("collision"):
        link.remove(collision)
    for (x, y, z), distance, height in ((_PAD, 0.0, _PAD_HEIGHT), (_FINGER, _PAD_RISE, 0.0)):
        collision = ET.SubElement(link, "collision")
        ET.SubElement(collision, "origin", xyz=_text((0.0, side * (distance + y / 2.0), height + z / 2.0)))
        ET.SubElement(ET.SubElement(collision, "geometry"), "box", size=_text((x, y, z)))


def _look_simple(link: ET.Element) -> None:
    """Let a link look as it collides: 200 triangles instead of 15,000 make an image in a tenth of the time."""
    for visual in link.findall("visual"):
        link.remove(visual)
    for collision in link.findall("collision"):
        visual = copy.deepcopy(collision)
        visual.tag = "visual"
        for material in visual.findall("material"):
            visual.remove(material)
        name = link.get("name", "")
        colour = "0.25 0.25 0.27 1" if name.endswith("finger") else "0.92 0.92 0.92 1"
        material = ET.SubElement(visual, "material", name=f"{name}_colour")
        ET.SubElement(material, "color", rgba=colour)
        link.append(visual)


def _limit(joint: ET.Element) -> None:
    """Let a joint end where the data sheet says; the published file has that as its soft limits."""
    safety, limit = joint.find("safety_controller"), joint.find("limit")
    if safety is not None and limit is not None:
        limit.set("lower", safety.get("soft_lower_limit", ""))
        limit.set("upper", safety.get("soft_upper_limit", ""))


def _mast() -> Iterator[ET.Element]:
    """Yield the mast, the camera on it, and their joints; housing and mast are behind the lens."""
    camera = MAST_CAMERA
    top, foot = camera.z, ARMS[0].z
    mast = _box_link("mast_link", (_MAST, _MAST, top - foot), "0.15 0.15 0.16 1", 3.0)
    collision = ET.SubElement(mast, "collision")
    collision.append(copy.deepcopy(mast.find("visual/geometry")))  # type: ignore[arg-type]
    yield mast
    yield _fixed("mast_link", ROOT, (camera.x - 0.05, camera.y, (top + foot) / 2.0))
    yield _box_link("camera_link", (0.03, 0.12, 0.03), "0.75 0.12 0.10 1", 0.1, back=0.02)
    yield _fixed("camera_link", ROOT, (camera.x, camera.y, camera.z), (0.0, camera.pitch, 0.0))
    yield ET.Element("link", name="camera_optical_frame")
    yield _fixed("camera_optical_frame", "camera_link", (0.0, 0.0, 0.0), (-math.pi / 2.0, 0.0, -math.pi / 2.0))


def _box_link(name: str, size: tuple[float, float, float], colour: str, mass: float, back: float = 0.0) -> ET.Element:
    """Return a link that is a box, `back` m behind the link's origin."""
    link = ET.Element("link", name=name)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=str(mass))
    x, y, z = (mass * edge * edge / 12.0 for edge in size)
    ET.SubElement(inertial, "inertia", ixx=str(y + z), iyy=str(x + z), izz=str(x + y), ixy="0", ixz="0", iyz="0")
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", xyz=f"{-back} 0 0")
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(geometry, "box", size=_text(size))
    material = ET.SubElement(visual, "material", name=f"{name}_colour")
    ET.SubElement(material, "color", rgba=colour)
    return link


def _fixed(
    link: str, parent: str, xyz: tuple[float, float, float], rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> ET.Element:
    joint = ET.Element("joint", name=link, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=link)
    ET.SubElement(joint, "origin", xyz=_text(xyz), rpy=_text(rpy))
    return joint


def _named(robot: ET.Element, tag: str, name: str) -> ET.Element:
    return next(element for element in robot.findall(tag) if element.get("name") == name)


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(str(number) for number in numbers)
