"""What a start by launch file leaves on a parameter server that an earlier start has used."""

import re
from pathlib import Path

import pytest
import yaml
from mros1_reasoner.io import parameters as reasoner
from ros_model.io.files import resolve
from rosgraph_launcher.ros import launcher
from rosgraph_manipulator.configuration.configurations import KEYS
from rosgraph_manipulator.ros import manipulator
from rosgraph_monitor.ros import parameters as monitor
from roslaunch.config import ROSLaunchConfig
from roslaunch.launch import _unify_clear_params
from roslaunch.xmlloader import XmlLoader
from rosmaster.paramserver import ParamDictionary

ROOT = Path(__file__).resolve().parents[2]
MANIPULATOR = "rosgraph_manipulator/launch/manipulator.launch"
MONITOR = "rosgraph_monitor/launch/monitor.launch"


class _Server:
    """The master's parameters, changed as roslaunch changes them at its start."""

    def __init__(self):
        self._parameters = ParamDictionary(None)

    def start(self, file, *arguments):
        config = ROSLaunchConfig()
        XmlLoader().load(str(resolve(f"package://{file}")), config, argv=list(arguments), verbose=False)
        for name in _unify_clear_params(config.clear_params):
            if self._parameters.has_param(name):
                self._parameters.delete_param(name)
        for parameter in config.params.values():
            self.set(parameter.key, parameter.value)

    def set(self, name, value):
        self._parameters.set_param(name, value)

    def get(self, name):
        return self._parameters.get_param(name) if self._parameters.has_param(name) else None


@pytest.fixture
def server():
    return _Server()


@pytest.fixture
def config(tmp_path):
    """Return a function that writes a file of parameters, and returns it as an argument of a launch file."""

    def write(content):
        path = tmp_path / "parameters.yaml"
        path.write_text(yaml.safe_dump(content))
        return f"config:={path}"

    return write


@pytest.mark.parametrize(
    ("file", "node"),
    [
        (MANIPULATOR, "/rosgraph_manipulator"),
        (MONITOR, "/rosgraph_monitor"),
        ("rosgraph_monitor/launch/aggregator.launch", "/diagnostic_aggregator"),
        ("mros1_reasoner/launch/run.launch", "/reasoner"),
        ("metacontrol_experiments/launch/manager.launch", "/mission_manager"),
    ],
)
def test_setting_that_a_file_has_no_longer_does_not_stay(server, config, file, node):
    others = ["manager:=none"] if "manager" in file else []
    functions = {"f_navigate": {"save_action": "move_base", "kill_nodes": ["/x"]}, "f_arm": {"kill_nodes": ["/y"]}}
    before = {key: {"a": 1, "b": {"c": 2}} for key in KEYS} | {"functions": functions}
    server.start(file, config(before), *others)
    after = {"configurations": {"a": 1}, "functions": {"f_navigate": {"kill_nodes": ["/x"]}}}
    server.start(file, config(after), *others)
    assert {key: server.get(f"{node}/{key}") for key in KEYS if server.get(f"{node}/{key}") is not None} == after


def test_what_a_manipulator_has_left_for_the_next_one_stays(server, config):
    left = {"journal": {"wanted": "a"}, "overwritten": {"before": [], "absent": ["/x"]}}
    for name, value in left.items():
        server.set(f"/rosgraph_manipulator/{name}", value)
    server.set("/rosgraph_launcher/addresses", ["here"])
    server.start(MANIPULATOR, config({"configurations": {"a": 1}}))
    assert {name: server.get(f"/rosgraph_manipulator/{name}") for name in left} == left
    assert server.get("/rosgraph_launcher/addresses") == ["here"]


def test_what_an_operator_has_set_for_the_manipulator_stays(server, config):
    server.set("/rosgraph_manipulator/ready_timeout", 60)
    server.start(MANIPULATOR, config({"configurations": {"a": 1}}))
    assert server.get("/rosgraph_manipulator/ready_timeout") == 60


def test_monitor_without_a_file_has_the_parameters_that_are_set_elsewhere(server):
    server.set("/rosgraph_monitor/observers", ["x"])
    server.start(MONITOR)
    assert server.get("/rosgraph_monitor/observers") == ["x"]


def test_one_launch_file_starts_the_meta_controller_of_a_project(server, tmp_path):
    (tmp_path / "config").mkdir()
    nodes = {"rosgraph_monitor": "desired_model", "rosgraph_manipulator": "configurations", "reasoner": "model_file"}
    for node, parameter in nodes.items():
        (tmp_path / "config" / f"{node}.yaml").write_text(yaml.safe_dump({parameter: f"of {node}"}))
    file = "mros1_reasoner/launch/metacontrol.launch"
    server.start(file, f"project:={tmp_path}", "initial_configuration:=careful", "parameters:={cool_down: 3}")
    assert {node: server.get(f"/{node}/{parameter}") for node, parameter in nodes.items()} == {
        node: f"of {node}" for node in nodes
    }
    assert server.get("/rosgraph_manipulator/initial_configuration") == "careful"
    assert server.get("/reasoner/cool_down") == 3


@pytest.mark.parametrize(
    ("executable", "known", "elsewhere"),
    [
        ("rosgraph_monitor/monitor", monitor.PARAMETERS, set()),
        ("mros1_reasoner/reasoner", reasoner.PARAMETERS, set()),
        ("rosgraph_manipulator/rosgraph_manipulator", manipulator.PARAMETERS, {"kept_goals"}),
        ("rosgraph_launcher/rosgraph_launcher", launcher.PARAMETERS, {"addresses"}),
    ],
)
def test_every_parameter_of_the_reference_is_known_to_its_node(executable, known, elsewhere):
    """Any other is told as misspelt; the page itself is checked against what the nodes read."""
    page = (ROOT / "docs" / "reference" / "nodes.md").read_text()
    section = page.split(f"### {executable}\n")[1].split("\n### ")[0]
    assert set(known) == set(re.findall(r"^\| parameter \| `~(\w+)`", section, re.MULTILINE)) | elsewhere
