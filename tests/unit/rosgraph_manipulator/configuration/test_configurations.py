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


def test_configuration_without_its_package_leaves_the_others_usable():
    def find(uri, _anywhere):
        if "missing" in uri:
            raise ConfigurationError("no package missing: install it")
        return uri

    entries = {"a": {"launch": "package://missing/a.launch", "function": "f_a"}, "b": {"launch": "/b.launch"}}
    a, b = parse_options({"configurations": entries}, find).configurations.values()
    assert (a.name, a.function, a.problem) == ("a", "f_a", "configurations/a: no package missing: install it")
    assert (b.launch_file, b.problem) == ("/b.launch", "")


def test_entry_that_is_malformed_refuses_the_file():
    with pytest.raises(ConfigurationError, match="configurations/a: neither"):
        parse_options({"configurations": {"a": {}, "b": {"launch": "/b.launch"}}}, lambda uri, _anywhere: uri)


def test_configuration_whose_launch_file_is_not_found_is_named():
    def find(_uri, _anywhere):
        raise ConfigurationError("it is nowhere")

    with pytest.raises(ConfigurationError, match="configurations/a: it is nowhere"):
        parse_options({"configurations": {"a": {"launch": "a.launch"}}}, find)
