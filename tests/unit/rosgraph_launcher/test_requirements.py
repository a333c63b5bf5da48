"""What a robot must have for the launcher: ROS, psutil and nothing else."""

import ast
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

SOURCES = Path(__file__).parents[3] / "catkin_ws" / "src"
OF_ROS = {"catkin_pkg", "diagnostic_msgs", "genpy", "psutil", "rosgraph", "roslaunch", "rospkg", "rospy", "yaml"}
"""What `ros-noetic-ros-base` of Ubuntu 20.04 and the Debian packages of ROS bring, and psutil."""
OURS = {"metacontrol_msgs", "node_kit", "rosgraph_launcher"}


@pytest.mark.parametrize("package", ["node_kit", "rosgraph_launcher"])
def test_modules_import_nothing_that_a_robot_lacks(package):
    found = set()
    for path in (SOURCES / package / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition(".")[0])
    assert found - set(sys.stdlib_module_names) - {"sitecustomize"} <= OF_ROS | OURS


def test_packages_need_no_other_package_of_the_project():
    for package in OURS:
        needed = {dependency.name for dependency in parse_package(str(SOURCES / package)).exec_depends}
        assert needed & {path.name for path in SOURCES.iterdir()} <= OURS
