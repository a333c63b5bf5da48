"""A first catkin package around a project: it builds and lints clean before anything is changed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_NEEDED = ("mros1_reasoner", "rosgraph_monitor")
"""Packages of the meta-controller that the launch file and observers use."""
_CMAKE = """\
cmake_minimum_required(VERSION 3.13)
project({name} LANGUAGES NONE)

find_package(catkin REQUIRED)
catkin_python_setup()
catkin_package()

install(DIRECTORY config launch models DESTINATION ${{CATKIN_PACKAGE_SHARE_DESTINATION}})
"""
_SETUP = """\
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(**generate_distutils_setup(packages=find_packages("src"), package_dir={"": "src"}))
"""
_LAUNCH = """\
<launch>
  <!-- The meta-controller of {name}. The robot runs already, in the namespace in which the snapshot was made. -->
  <arg name="initial_configuration" default="{variant}" doc="what to deploy at the start; empty: nothing"/>
  <arg name="reasoner" default="true" doc="false: it watches, and never adapts"/>
  <include file="$(find mros1_reasoner)/launch/metacontrol.launch">
    <arg name="project" value="$(find {name})"/>
    <arg name="initial_configuration" value="$(arg initial_configuration)"/>
    <arg name="reasoner" value="$(arg reasoner)"/>
  </include>
</launch>
"""
_README = """\
# {name}

The models of a robot, and what its meta-controller needs. After each change of `models/`, run these in this folder:

    rosmodel check models/
    rosmodel generate all models/ -o .

Next steps:

1. Edit the lines marked CHANGE in `models/metacontrol.yaml`. Add a line for each variant to `models/{table}`, and its
   expected levels to `models/{levels}`.
2. `rosmodel generate observer` makes an observer of your own. Add the line that it prints to `package.xml`.
3. Build the workspace and source it. Start the robot, then see what is missing: `rosmodel doctor .`
4. `roslaunch {name} {name}.launch`
"""


def package_texts(name: str, packages: Iterable[str], variant: str, tables: tuple[str, str]) -> dict[str, str]:
    """Return the files of a package, by their paths in it, without those of its models.

    Args:
        name: of the package.
        packages: packages of the nodes that its launch files start.
        variant: the configuration to deploy first.
        tables: names of the tables of variants and of expected levels.
    """
    table, levels = tables
    return {
        "package.xml": _manifest(name, packages),
        "CMakeLists.txt": _CMAKE.format(name=name),
        "setup.py": _SETUP,
        f"src/{name}/__init__.py": f'"""Observers of {name}."""\n',
        f"launch/{name}.launch": _LAUNCH.format(name=name, variant=variant),
        "README.md": _README.format(name=name, table=table, levels=levels),
    }


def _manifest(name: str, packages: Iterable[str]) -> str:
    package = ET.Element("package", {"format": "2"})
    ET.SubElement(package, "name").text = name
    ET.SubElement(package, "version").text = "0.1.0"
    ET.SubElement(package, "description").text = f"The models of {name}, and the configuration of its meta-controller."
    ET.SubElement(package, "maintainer", {"email": "maintainer@example.com"}).text = "maintainer"
    ET.SubElement(package, "license").text = "TODO"
    ET.SubElement(package, "buildtool_depend").text = "catkin"
    for needed in sorted({*_NEEDED, *packages} - {name}):
        ET.SubElement(package, "exec_depend").text = needed
    exports = ET.SubElement(package, "export")
    exports.append(ET.Comment(' <rosgraph_monitor observer="MODULE:CLASS"/> for each observer of this package '))
    ET.indent(package, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(package, encoding="unicode") + "\n"
