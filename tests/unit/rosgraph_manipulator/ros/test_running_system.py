"""What is known of the running configurations."""

import pytest
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_launcher.launching.report import STABLE, LauncherReport
from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.io.launch_files import LaunchFile
from rosgraph_manipulator.ros.running_system import RunningSystem

LEVEL = "/qa_performance"


@pytest.fixture
def running():
    """Two functions, each with a node and an expected level of the same quality."""
    configurations = {name: Configuration(name, f"f_{name}", f"{name}.launch") for name in ("arm", "drive")}
    progress = ChangeProgress()
    progress.take(LauncherReport(f"f_{name}", name, state=STABLE, nodes=(f"/{name}",)) for name in configurations)
    running = RunningSystem(ManipulatorOptions(configurations), progress, lambda _node: True)
    for level, (name, configuration) in enumerate(configurations.items()):
        node = NodeDescription(f"/{name}", "/", "p", "x", parameters={"rate": 1})
        running.deployed(configuration, LaunchFile(SystemDescription({node.name: node}, {LEVEL: level, "/robot": "r"})))
    return running


def test_node_that_starts_again_gets_its_parameters_back_but_no_expected_level(running):
    assert running.parameters_of("f_arm", ["/arm"]) == {"/robot": "r", "/arm/rate": 1}
    assert running.parameters_of("f_arm", ["/drive"]) == {}
