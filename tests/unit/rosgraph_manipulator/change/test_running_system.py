"""What is known of the running configurations."""

import pytest
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_launcher.launching.report import STABLE, LauncherReport
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.change.running_system import RunningSystem
from rosgraph_manipulator.change.tactics import NoRunningNodes
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions, Repair
from rosgraph_manipulator.io.launch_files import LaunchFile

LEVEL = "/qa_performance"


class Around:
    """Launch files by name, in place of those on the disk."""

    def __init__(self, files=()):
        self.files = dict(files)

    def launch_file(self, configuration):
        return LaunchFile(self.files[configuration.launch_file])


@pytest.fixture
def running():
    """Two functions, each with a node and an expected level of the same quality."""
    configurations = {name: Configuration(name, f"f_{name}", f"{name}.launch") for name in ("arm", "drive")}
    progress = ChangeProgress()
    progress.take(LauncherReport(f"f_{name}", name, state=STABLE, nodes=(f"/{name}",)) for name in configurations)
    options = ManipulatorOptions(configurations)
    running = RunningSystem(options, progress, lambda _node: True, Around(), NoRunningNodes())
    for level, (name, configuration) in enumerate(configurations.items()):
        node = NodeDescription(f"/{name}", "/", "p", "x", parameters={"rate": 1})
        running.deployed(configuration, LaunchFile(SystemDescription({node.name: node}, {LEVEL: level, "/robot": "r"})))
    return running


def test_node_that_starts_again_gets_its_parameters_back_but_no_expected_level(running):
    assert running.parameters_of("f_arm", ["/arm"]) == {"/robot": "r", "/arm/rate": 1}
    assert running.parameters_of("f_arm", ["/drive"]) == {}


def test_content_as_deployed_is_known_only_of_the_configuration_that_was_deployed(running):
    arm = Configuration("arm", "f_arm", "arm.launch")
    assert set(running.deployed_file(arm).system.nodes) == {"/arm"}
    assert running.deployed_file(Configuration("other", "f_arm", "other.launch")) is None
    running.released("f_arm")
    assert running.deployed_file(arm) is None


def test_drivers_yield_to_functions_and_to_one_another():
    look = Configuration("look", "f_look", "look")
    driver, twin = (Configuration(f"repair_of_{name}", f"repair_of_{name}", name) for name in ("eye", "twin"))
    progress = ChangeProgress()
    progress.take(LauncherReport(one.function, one.name, nodes=(f"/{one.name}",)) for one in (look, driver))
    repairs = {"eye": Repair("eye", driver=driver), "twin": Repair("twin", driver=twin)}
    options = ManipulatorOptions({"look": look}, repairs=repairs)
    around = Around()
    read = around.files
    system = RunningSystem(options, progress, lambda _node: False, around, NoRunningNodes())
    read["look"] = SystemDescription({"/look": NodeDescription("/look", "/", "p", "x")}, {"/gain": 1})
    read["eye"] = SystemDescription({"/eye": NodeDescription("/eye", "/", "p", "x")}, {"/gain": 2})
    assert system.describe_beside_others(look) == read["look"]
    read["twin"] = SystemDescription({"/eye": NodeDescription("/eye", "/", "p", "x", args="twice")}, {"/focus": 3})
    assert system.describe_beside_others(twin) == read["twin"]
    with pytest.raises(DeploymentError, match="parameter /gain is 2 for repair_of_eye and 1 for f_look, which runs"):
        system.describe_beside_others(driver)
    read["look"] = SystemDescription({"/eye": NodeDescription("/eye", "/", "p", "another")})
    with pytest.raises(DeploymentError, match="node /eye belongs to f_look and repair_of_eye, which runs"):
        system.describe_beside_others(look)
