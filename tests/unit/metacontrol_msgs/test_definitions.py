"""The definitions' md5 sums, by which nodes tell whether they mean the same message: none changes by accident."""

import hashlib
import importlib
from pathlib import Path

import pytest

SUMS = dict(line.split() for line in (Path(__file__).parent / "md5sums.txt").read_text().splitlines())
MODULES = ("metacontrol_msgs.msg", "metacontrol_msgs.srv", "metacontrol_sim.srv", "simulator_msgs.srv")


def defined() -> dict[str, str]:
    """Return the md5 sum of every message, service and action of ours, by its type."""
    classes = [vars(importlib.import_module(module)).values() for module in MODULES]
    # A service's request and response are no types of their own.
    return {
        c._type: c._md5sum
        for found in classes
        for c in found
        if hasattr(c, "_md5sum") and not c.__name__.endswith(("Request", "Response"))
    }


def test_definitions_are_as_published():
    assert defined() == SUMS


@pytest.mark.parametrize(
    ("name", "definition"),
    [
        ("metacontrol_msgs/MvpReconfigurationGoal", "string desired_configuration_name"),
        ("metacontrol_msgs/MvpReconfigurationResult", "int8 result"),
        ("metacontrol_msgs/MvpReconfigurationFeedback", ""),
        ("metacontrol_msgs/LoadObserver", "string name" + "bool ok"),  # controller_manager_msgs/LoadController
        ("metacontrol_msgs/UnloadObserver", "string name" + "bool ok"),  # controller_manager_msgs/UnloadController
        # controller_manager_msgs/ListControllerTypes
        ("metacontrol_msgs/ListObservers", "string[] types\nstring[] base_classes"),
    ],
)
def test_published_definitions_are_kept(name, definition):
    assert hashlib.md5(definition.encode()).hexdigest() == SUMS[name]  # noqa: S324


@pytest.mark.parametrize("service", ["DeleteObstacle", "SetLight", "SpawnObstacle"])
def test_services_of_the_simulator_can_be_called_by_both_names(service):
    """`metacontrol_sim/SpawnObstacle` is the published name, `simulator_msgs/SpawnObstacle` the simulator's own."""
    assert SUMS[f"metacontrol_sim/{service}"] == SUMS[f"simulator_msgs/{service}"]
