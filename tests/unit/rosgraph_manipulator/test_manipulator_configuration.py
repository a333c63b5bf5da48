"""The manipulator's configuration file, in both forms."""

import pytest
from rosgraph_manipulator.configuration import ConfigurationError, parse_settings


@pytest.fixture
def launch_file(tmp_path):
    path = tmp_path / "a.launch"
    path.write_text("<launch/>")
    return path


def test_own_form_names_function_launch_file_and_arguments(launch_file):
    settings = parse_settings(
        {"configurations": {"a": {"function": "f", "launch": str(launch_file), "args": ["x:=1"]}}}
    )
    configuration = settings.configurations["a"]
    assert (configuration.function, configuration.launch_file, configuration.args) == ("f", str(launch_file), ("x:=1",))


def test_published_command_is_parsed_into_package_file_and_arguments():
    command = "roslaunch rosgraph_manipulator manipulator.launch config:=/a"
    settings = parse_settings({"configurations": {"a": {"command": command}}})
    configuration = settings.configurations["a"]
    assert configuration.launch_file.endswith("rosgraph_manipulator/launch/manipulator.launch")
    assert configuration.args == ("config:=/a",)


def test_published_action_type_is_understood(launch_file):
    settings = parse_settings(
        {
            "configurations": {"a": {"launch": str(launch_file)}},
            "save_action": "/move_base",
            "goal_msg_type": "move_base_msgs.msg.MoveBaseAction",
            "kill_nodes": ["/move_base"],
        }
    )
    assert settings.save_action == "move_base"
    assert settings.action_type == "move_base_msgs/MoveBaseAction"
    assert settings.reconfiguration_action_name == "rosgraph_manipulator_action_server"


@pytest.mark.parametrize(
    ("parameters", "named"),
    [
        ({}, "configurations"),
        ({"configurations": {"a": "roslaunch"}}, "configurations/a"),
        ({"configurations": {"a": {}}}, "configurations/a"),
        ({"configurations": {"a": {"command": "rm -rf x; roslaunch a b"}}}, "is not 'roslaunch"),
        ({"configurations": {"a": {"command": "roslaunch 'a"}}}, "quotation"),
        ({"configurations": {"a": {"command": "roslaunch no_such_package x.launch"}}}, "no_such_package"),
        ({"configurations": {"a": {"launch": "/no/such/file.launch"}}}, "/no/such/file.launch"),
        ({"configurations": {"a": {"launch": "package://rosgraph_manipulator/../../secret"}}}, "configurations/a"),
    ],
)
def test_unusable_configuration_is_refused_and_named(parameters, named):
    with pytest.raises(ConfigurationError, match=named):
        parse_settings(parameters)


@pytest.mark.parametrize("bad", [{"kill_nodes": "move_base"}, {"save_action": "m", "goal_msg_type": "os.system"}])
def test_unusable_parameter_is_refused(launch_file, bad):
    with pytest.raises(ConfigurationError, match=next(reversed(bad))):
        parse_settings({"configurations": {"a": {"launch": str(launch_file)}}, **bad})
