"""What `./mros setup --robot` installs is what the packages beside a robot need, and no more of ours."""

import ast
import re
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / "catkin_ws" / "src"
TOLERANT = {"matplotlib", "scipy", "py_trees", "smach"}
"""Modules that only figures, statistics of campaigns and missions of others need; who uses them imports them late."""


def listed(name):
    lines = (ROOT / "requirements" / name).read_text().splitlines()
    return {line.split("==")[0] for line in lines if line and not line.startswith("#")}


def plain(names):
    """Return names of distributions as PyPI compares them."""
    return {re.sub(r"[-_.]+", "-", name).lower() for name in names}


PACKAGES = listed("packages-robot.txt")


def test_list_has_all_packages_of_ours_that_its_packages_need():
    ours = {path.parent.name for path in SOURCES.glob("*/package.xml")}
    for package in sorted(PACKAGES):
        needed = set(re.findall(r"depend>([^<]+)<", (SOURCES / package / "package.xml").read_text()))
        assert needed & ours <= PACKAGES, package


def modules_of(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module


@pytest.mark.parametrize("package", sorted(PACKAGES))
def test_python_packages_are_among_those_of_a_robot(package):
    robot = plain(listed("python-robot.txt"))
    others = plain(listed("python.txt") | listed("python-dev.txt")) - robot
    distributions = packages_distributions()
    lacking = set()
    for path in (SOURCES / package / "src").rglob("*.py"):
        for module in {name.partition(".")[0] for name in modules_of(path)} - set(sys.stdlib_module_names) - TOLERANT:
            found = plain(distributions.get(module, []))
            if found & others and not found & robot:
                lacking.add((str(path.relative_to(SOURCES)), module))
    assert not lacking
