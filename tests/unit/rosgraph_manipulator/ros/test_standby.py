"""Which nodes launchers are told to be ready for."""

import pytest
import rospy
from node_kit.io.background import NoThreadError
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions, Repair
from rosgraph_manipulator.io.launch_files import LaunchFile
from rosgraph_manipulator.ros.standby import Standby


class Launchers:
    def __init__(self):
        self.told, self.error = [], None

    def stand_by(self, nodes):
        if self.error:
            raise self.error
        self.told.append({node.name: node for node in nodes})


@pytest.fixture
def launchers():
    return Launchers()


@pytest.fixture
def standby(launchers):
    """Two variants of one node, a function whose launch file is broken, and a driver."""

    def read(configuration):
        path = configuration.launch_file
        if path == "broken":
            raise DeploymentError("broken: no such file")
        name = {"slow": "/nav", "fast": "/nav"}.get(path, f"/{path}")
        node = NodeDescription(name, "/", "p", "x", parameters={"speed": path})
        return LaunchFile(SystemDescription({name: node}))

    configurations = {name: Configuration(name, f"f_{name}", name) for name in ("slow", "broken", "fast")}
    repairs = {"eye": Repair("eye", driver=Configuration("repair_of_eye", "repair_of_eye", "eye"))}
    return Standby(ManipulatorOptions(configurations, repairs=repairs), launchers, read)


def look(standby, times=10):
    for _ in range(times):
        standby.look()


def test_nodes_of_all_configurations_and_drivers_are_told_once(standby, launchers):
    look(standby)
    (told,) = launchers.told
    assert set(told) == {"/nav", "/eye"}
    assert told["/nav"].parameters == {}  # variants that differ in parameters alone are the same process


def test_one_launch_file_is_read_at_a_time(standby, launchers):
    look(standby, 4)
    assert launchers.told == []
    look(standby, 1)
    assert len(launchers.told) == 1


def test_launchers_are_told_again_after_each_change(standby, launchers):
    look(standby)
    standby.changed()
    look(standby)
    assert len(launchers.told) == 2


def test_launchers_that_can_not_be_told_now_are_told_at_the_next_look(standby, launchers, monkeypatch):
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    launchers.error = NoThreadError(RuntimeError("can't start new thread"))
    look(standby)
    launchers.error = None
    look(standby)
    assert len(launchers.told) == 1
