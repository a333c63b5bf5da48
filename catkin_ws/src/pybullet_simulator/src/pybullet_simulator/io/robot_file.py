"""The robot's URDF, as robot_state_publisher takes it, made into one that PyBullet can slide over a floor."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg
from node_kit.io.input_files import InputFileError, read_text
from node_kit.one_line import OneLineError

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = "base_link"
JOINTS = ("slide_x", "slide_y", "turn")
"""Joints from the map to the robot's root, in the order in which they follow each other."""

MAX_SIZE = 500_000
"""Bytes of the largest URDF: 50 times that of this package; a megabyte of empty links takes more than 1 s."""
MAX_DEPTH = 100
"""Elements within each other: a URDF has 5, extensions some more; ElementTree writes them by recursion."""

_FAR = "1e9"
_SLIDE_MASS = "1"
_LOOKS_MASS = "0.001"  # kg; to a link without inertia PyBullet gives 1 kg


class RobotFileError(OneLineError, ValueError):
    """A URDF that cannot be used; the message names the file."""


def robot_file() -> Path:
    """Return the path of the robot's URDF.

    Raises:
        RobotFileError: the package is not found.
    """
    try:
        return Path(rospkg.RosPack().get_path("pybullet_simulator")) / "urdf" / "ridgeback.urdf"
    except rospkg.ResourceNotFound as error:
        raise RobotFileError("package pybullet_simulator not found; source the workspace's devel/setup.bash") from error


def planar_urdf(path: Path) -> str:
    """Return a URDF with two sliding joints and a turning one between the map and the robot's root.

    Raises:
        RobotFileError: as `read_robot`.
    """
    robot = read_robot(path)
    put_on_planar_joints(robot)
    return ET.tostring(robot, encoding="unicode")


def read_robot(path: Path) -> ET.Element:
    """Return the URDF of a robot whose root is base_link.

    Raises:
        RobotFileError: the file cannot be read, is too large or nested too deep, is no URDF with the link base_link,
            or declares entities.
    """
    try:
        text = read_text(path, MAX_SIZE)
        if "<!DOCTYPE" in text:
            raise RobotFileError(f"{path}: declares a document type; a URDF needs none")
        robot = ET.fromstring(text, ET.XMLParser(target=_ShallowBuilder()))  # noqa: S314 (entities are refused above)
    except InputFileError as error:
        raise RobotFileError(str(error)) from error
    except ET.ParseError as error:
        raise RobotFileError(f"{path}: is not XML: {error}") from error
    except RecursionError as error:
        raise RobotFileError(f"{path}: more than {MAX_DEPTH} elements within each other; correct the URDF") from error
    if ROOT not in {link.get("name") for link in robot.iter("link")}:
        raise RobotFileError(f"{path}: has no link {ROOT}")
    return robot


def put_on_planar_joints(robot: ET.Element) -> None:
    """Let the root of a URDF slide and turn in the plane; links for looks get a mass as good as none."""
    for link in robot.findall("link"):
        if link.find("inertial") is None:
            link.append(_inertial(_LOOKS_MASS, "1e-6"))
    robot.extend(_slides())


class _ShallowBuilder(ET.TreeBuilder):
    """Builds elements; raises RecursionError where they are nested too deep."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        """Begin an element."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise RecursionError
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ET.Element:
        """End an element."""
        self._depth -= 1
        return super().end(tag)


def _slides() -> Iterator[ET.Element]:
    """Yield the links and joints that let the root move in the plane."""
    slide_x, slide_y, turn = JOINTS
    joints = (
        (slide_x, "prismatic", "1 0 0", "plane", slide_x),
        (slide_y, "prismatic", "0 1 0", slide_x, slide_y),
        (turn, "continuous", "0 0 1", slide_y, ROOT),
    )
    for link in ("plane", slide_x, slide_y):
        element = ET.Element("link", name=link)
        element.append(_inertial(_SLIDE_MASS, "1"))
        yield element
    for name, kind, axis, parent, child in joints:
        joint = ET.Element("joint", name=name, type=kind)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        ET.SubElement(joint, "axis", xyz=axis)
        ET.SubElement(joint, "limit", lower="-" + _FAR, upper=_FAR, effort=_FAR, velocity=_FAR)
        yield joint


def _inertial(mass: str, moment: str) -> ET.Element:
    inertial = ET.Element("inertial")
    ET.SubElement(inertial, "mass", value=mass)
    ET.SubElement(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0")
    return inertial
