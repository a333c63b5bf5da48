"""The README's six steps: its commands run as they stand there, and leave a deployment that loads."""

import os
import re
import subprocess
from pathlib import Path

import pytest
import yaml
from helpers import launch_files
from mros1_reasoner.io.ontology_files import read_knowledge_base
from ros_model.io.files import resolve
from ros_model.io.project import load_project
from rosgraph_monitor.observers.plugins import available

README = Path(__file__).parents[4] / "catkin_ws" / "src" / "ros_model" / "README.md"


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    section = README.read_text().split("## The six steps at design time")[1].split("\n## ")[0]
    blocks = re.findall(r"```bash\n(.*?)```", section, re.DOTALL)
    assert len(blocks) == 9
    folder = tmp_path_factory.mktemp("tutorial")
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", "\n".join(blocks)],
        cwd=folder,
        env={**os.environ, "COLUMNS": "120"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "my_robot"


def test_every_step_leaves_its_files(robot):
    found = {str(path.relative_to(robot)) for path in robot.rglob("*") if path.is_file()}
    assert found >= {
        "launch/d2.launch",
        "models/metacontrol.yaml",
        "models/variants/calm.rossystem",
        "models/variants/quick.rossystem",
        "config/rosgraph_monitor.yaml",
        "config/reasoner.yaml",
        "config/rosgraph_manipulator.yaml",
        "launch/variants/calm.launch",
        "launch/variants/quick.launch",
        "models/observers.ros",
        "src/my_robot/comfort_quality_observer.py",
        "test/test_comfort_quality_observer.py",
        "models/d2.owl",
        "package.xml",
        "setup.py",
    }


def test_package_can_be_found_with_its_models_and_its_observer(robot, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(robot.parent))
    assert resolve("package://my_robot/models/d2.owl") == robot / "models/d2.owl"
    assert available() == {"ComfortQualityObserver": "my_robot.comfort_quality_observer:ComfortQualityObserver"}


def test_variants_load_with_their_values(robot):
    config = launch_files.read(robot / "launch/variants/calm.launch")
    assert [node.name for node in config.nodes] == ["move_base"]
    assert config.params["/move_base/TrajectoryPlannerROS/max_vel_x"].value == 0.3
    assert repr(config.params["/move_base/controller_frequency"].value) == "10.0"


def test_manipulator_waits_for_what_others_need_of_a_variant(robot):
    manipulator = yaml.safe_load((robot / "config/rosgraph_manipulator.yaml").read_text())
    assert manipulator["configurations"]["calm"]["topics"] == ["cmd_vel"]


def test_ontology_and_configuration_agree(robot):
    designs = read_knowledge_base([robot / "models/d2.owl"]).designs
    manipulator = yaml.safe_load((robot / "config/rosgraph_manipulator.yaml").read_text())
    assert set(designs) == set(manipulator["configurations"]) == {"calm", "quick"}
    assert designs["calm"].components == {"simulator", "front_laser"}
    assert load_project(robot / "models").settings["observers"][0]["name"] == "ComfortQualityObserver"
