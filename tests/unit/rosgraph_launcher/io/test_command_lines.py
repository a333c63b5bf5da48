"""Turning descriptions of nodes into commands through roslaunch."""

import os

import pytest
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import CommandLineError, command_line, process_environment


def node(**attributes):
    known = {"namespace": "/robot/", "package": "move_base", "executable": "move_base", **attributes}
    return NodeDescription("/robot/n", **known)


def test_command_names_executable_and_node():
    words, prefixed = command_line(node(args="--fast 1", remaps=(("a", "b"),)))
    assert os.path.basename(words[0]) == "move_base"
    assert words[1:] == ["--fast", "1", "a:=b", "__name:=n"]
    assert prefixed == 0


def test_environment_has_namespace_master_and_variables_of_the_node(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://robot:11311")
    environment = process_environment(node(environment=(("E", "1"),)), {"HOME": "/x", "E": "0"})
    assert environment["ROS_NAMESPACE"].strip("/") == "robot"
    assert environment["ROS_MASTER_URI"] == "http://robot:11311"
    assert (environment["HOME"], environment["E"]) == ("/x", "1")


def test_launch_prefix_comes_first():
    words, prefixed = command_line(node(launch_prefix="nice -n 5"))
    assert (words[:3], prefixed) == (["nice", "-n", "5"], 3)


def test_launch_prefix_that_does_not_exist_is_refused():
    with pytest.raises(CommandLineError, match=r"node /robot/n: no command 'no-such-command', .*: install it"):
        command_line(node(launch_prefix="no-such-command -e"))


def test_executable_that_does_not_exist_is_refused():
    with pytest.raises(CommandLineError, match=r"node /robot/n: .*no_such_node"):
        command_line(node(executable="no_such_node"))


def test_launch_prefix_without_its_second_quote_is_refused_in_one_line():
    with pytest.raises(CommandLineError, match="node /robot/n: ") as error:
        command_line(node(launch_prefix="sh -c 'exec"))
    assert "\n" not in str(error.value)
