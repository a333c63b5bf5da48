"""The root launch files: which world they take, and what the monitor is told of the window."""

from pathlib import Path

import pytest
import yaml
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

PACKAGE = Path(__file__).parents[3] / "catkin_ws/src/metacontrol_sim"
ROOTS = ["metacontrol_sim_reasoner.launch", "MVP_metacontrol_world.launch"]


def parameters(file, *arguments):
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load(str(PACKAGE / "launch" / file), config, argv=list(arguments), verbose=False)
    return {name: parameter.value for name, parameter in config.params.items()}


@pytest.mark.parametrize("file", [*ROOTS, "robot.launch"])
@pytest.mark.parametrize(
    ("arguments", "world"),
    [
        ((), str(PACKAGE / "worlds/factory.yaml")),
        (("map_file:=/maps/office.yaml",), "/maps/office.yaml"),
        (("world:=/worlds/hall.yaml",), "/worlds/hall.yaml"),
    ],
)
def test_world_is_the_file_that_was_named(file, arguments, world):
    assert parameters(file, *arguments)["/simulator/world"] == world


@pytest.mark.parametrize("file", ROOTS)
def test_monitor_expects_what_the_window_listens_to_only_where_there_is_one(file):
    assert "/rosgraph_monitor/ignore_ports" not in parameters(file)
    ignored = parameters(file, "gui:=true")["/rosgraph_monitor/ignore_ports"]
    text = (PACKAGE.parent / "pybullet_simulator/src/pybullet_simulator/ros/window.py").read_text()
    assert len(ignored) == 8
    assert [name for name in ignored if f'"{name.removeprefix("*/")}"' not in text] == []


@pytest.mark.parametrize("file", ROOTS)
def test_mission_without_surroundings_has_all_other_observers(file):
    described = yaml.safe_load((PACKAGE / "models/metacontrol.yaml").read_text())
    names = [observer["name"] for observer in described["observers"]]
    others = [o["name"] for o in described["observers"] if o["quality_attribute"] not in described["environment"]]
    assert len(others) < len(names)
    assert parameters(file)["/rosgraph_monitor/observers"] == names
    assert parameters(file, "environment:=false")["/rosgraph_monitor/observers"] == others


def test_published_reasoner_has_no_surroundings():
    observers = parameters("metacontrol_sim_reasoner.launch", "as_published:=true")["/rosgraph_monitor/observers"]
    assert "LightObserver" not in observers
