"""The root launch files: which world they take, what the monitor is told of the window, and what ends a bad start."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from helpers.waiting import DEADLINE_S
from metacontrol_experiments.lockstep.system import parameter_tree
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

PACKAGE = Path(__file__).parents[3] / "catkin_ws/src/metacontrol_sim"
ROOTS = ["metacontrol_sim_reasoner.launch", "MVP_metacontrol_world.launch"]


MANAGED = ("managed.launch", "manager:=rules")
MANIPULATOR = """
import json, sys
import rospy
from node_kit.ros.lifetime import Lifetime
from rosgraph_manipulator.ros import manipulator

own = json.loads(sys.argv.pop())
Lifetime.start = lambda *_, **__: None
rospy.get_param = lambda name, default=None: own.get(name.lstrip("~"), default)
manipulator.main()
"""
"""The node, with parameters and without a master."""


def loaded(file, *arguments, package=PACKAGE):
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load(str(package / "launch" / file), config, argv=list(arguments), verbose=False)
    return config


def parameters(file, *arguments, package=PACKAGE):
    params = loaded(file, *arguments, package=package).params
    return {name: parameter.value for name, parameter in params.items()}


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


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        *(("metacontrol_sim", (file,)) for file in (*ROOTS, "robot.launch")),
        ("metacontrol_experiments", MANAGED),
        ("metacontrol_manipulation", ("robot.launch",)),
    ],
)
def test_simulator_that_refuses_to_start_ends_the_whole_launch(package, arguments):
    nodes = loaded(*arguments, package=PACKAGE.parent / package).nodes
    assert [(node.required, node.respawn) for node in nodes if node.name == "simulator"] == [(True, False)]


@pytest.mark.parametrize(
    ("package", "arguments"),
    [*(("metacontrol_sim", (file,)) for file in ROOTS), ("metacontrol_experiments", MANAGED)],
)
def test_variant_to_begin_with_that_does_not_exist_is_told_in_one_line(package, arguments):
    given = parameters(*arguments, "nav_profile:=f9_v9_r9", package=PACKAGE.parent / package)
    own = parameter_tree({name.removeprefix("/rosgraph_manipulator/"): value for name, value in given.items()})
    words = [sys.executable, "-c", MANIPULATOR, json.dumps(own)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    said = "rosgraph_manipulator: parameter '~initial_configuration' is 'f9_v9_r9'; known are: f1_v1_r1, "
    assert (done.returncode, done.stderr.count("\n"), done.stderr[: len(said)]) == (2, 1, said)
