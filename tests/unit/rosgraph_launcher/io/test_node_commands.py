"""The folder in which a node is started, also where the launcher's own one is gone."""

import os

import pytest
import rospkg
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import CommandLineError
from rosgraph_launcher.io.node_commands import NodeCommands
from rosgraph_launcher.io.processes import MARK


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    commands = NodeCommands("mark", "run", print)

    def make(cwd):
        return commands.command(NodeDescription("/n", "/", "move_base", "move_base", cwd=cwd))

    return make


@pytest.fixture
def gone(tmp_path, monkeypatch):
    """Have the working folder deleted."""
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()


def test_node_is_started_in_the_folder_that_its_launch_file_names(command):
    assert command("node").cwd == os.path.dirname(command("node").words[0])
    assert command(None).cwd == command("ROS_HOME").cwd == rospkg.get_ros_home()
    assert command(None).environment[MARK] == "mark"


@pytest.mark.parametrize("cwd", [None, "ROS_HOME", "node"])
def test_nodes_are_started_although_the_folder_of_the_launcher_is_gone(command, gone, cwd):
    assert os.path.isabs(command(cwd).cwd)


def test_folder_that_roslaunch_does_not_know_is_refused(command):
    with pytest.raises(CommandLineError, match="cwd must be one of 'ROS_HOME', 'node'"):
        command("cwd")
