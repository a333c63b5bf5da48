"""Parameters of the manipulator, checked without any file."""

import pytest
from rosgraph_manipulator.configuration.configurations import ConfigurationError, parse_options


def test_launch_files_are_found_by_whoever_asks():
    asked = []

    def find(uri, anywhere):
        asked.append((uri, anywhere))
        return f"/found/{len(asked)}"

    entries = {"own": {"launch": "package://p/a.launch"}, "published": {"command": "roslaunch p b.launch"}}
    configurations = parse_options({"configurations": entries}, find).configurations
    assert asked == [("package://p/a.launch", False), ("package://p/launch/b.launch", True)]
    assert [configuration.launch_file for configuration in configurations.values()] == ["/found/1", "/found/2"]


def test_configuration_whose_launch_file_is_not_found_is_named():
    def find(_uri, _anywhere):
        raise ConfigurationError("it is nowhere")

    with pytest.raises(ConfigurationError, match="configurations/a: it is nowhere"):
        parse_options({"configurations": {"a": {"launch": "a.launch"}}}, find)
