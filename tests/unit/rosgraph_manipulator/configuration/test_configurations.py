"""Parameters of the manipulator, checked without any file."""

import re

import pytest
from rosgraph_manipulator.configuration.configurations import (
    ConfigurationError,
    FunctionOptions,
    parse_options,
)


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


def test_older_form_lists_packages_with_launch_files_of_their_names():
    asked = []

    def find(uri, anywhere):
        asked.append((uri, anywhere))
        return uri

    options = parse_options({"configs": ["fast", "slow"], "kill_nodes": None}, find)
    assert list(options.configurations) == ["fast", "slow"]
    assert asked[0] == ("package://fast/launch/fast.launch", True)
    assert options.configurations["slow"].args == ("profile:=slow",)
    expected = FunctionOptions(("/move_base",), "move_base", "move_base_msgs/MoveBaseAction")
    assert options.of("f_navigate") == expected


def test_older_form_may_say_more_than_it_did():
    options = parse_options({"configs": ["a"], "kill_nodes": ["/arm"], "save_action": ""}, lambda uri, _anywhere: uri)
    assert options.of("f_navigate") == FunctionOptions(("/arm",), None)


@pytest.mark.parametrize("names", ["fast", {"fast": 1}, [1], ["a b"], ["../x"]])
def test_older_form_that_is_no_list_of_packages_is_refused(names):
    with pytest.raises(ConfigurationError, match="parameter 'configs' must be a list of packages"):
        parse_options({"configs": names}, lambda uri, _anywhere: uri)


@pytest.mark.parametrize("args", [127, "profile:=slow", {"profile": "slow"}])
def test_arguments_that_are_no_list_are_refused(args):
    with pytest.raises(ConfigurationError, match=r"configurations/a: 'args' is .*: it must be a list of NAME:=VALUE"):
        parse_options({"configurations": {"a": {"launch": "/a", "args": args}}}, lambda uri, _anywhere: uri)


TWO = {"look": {"launch": "/l", "function": "f_look"}, "pick": {"launch": "/p", "function": "f_pick"}}
GRASP = {"save_action": "grasp", "goal_msg_type": "arm_msgs/GraspAction"}


def parse(**parameters):
    return parse_options({"configurations": TWO, **parameters}, lambda uri, _anywhere: uri)


def test_each_function_has_options_of_its_own():
    options = parse(functions={"f_pick": {**GRASP, "kill_nodes": ["gripper"]}})
    assert options.of("f_pick") == FunctionOptions(("gripper",), "grasp", "arm_msgs/GraspAction")
    assert options.of("f_look") == FunctionOptions()
    assert options.all_functions == ("f_look", "f_pick")


def test_options_outside_functions_hold_for_the_only_function():
    one = {"pick": TWO["pick"]}
    options = parse_options({"configurations": one, **GRASP}, lambda uri, _anywhere: uri)
    assert options.of("f_pick").save_action == "grasp"


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (GRASP, "does not say for which of f_look, f_pick it holds: put it under 'functions"),
        (
            {"functions": {"f_pik": GRASP}},
            "functions/f_pik: no configuration has this function; known are: f_look, f_p",
        ),
        ({"functions": {"f_pick": {"saveaction": "x"}}}, "functions/f_pick: unknown key 'saveaction'; known are: kill"),
        ({"functions": {"f_pick": {"save_action": "x"}}}, "functions/f_pick/goal_msg_type"),
        ({"functions": ["f_pick"]}, "'functions' must be of the form"),
        ({"functions": {"f_pick": {"kill_nodes": "a"}}}, "functions/f_pick/kill_nodes"),
    ],
)
def test_options_of_functions_that_cannot_be_meant_are_refused(parameters, words):
    with pytest.raises(ConfigurationError, match=re.escape(words)):
        parse(**parameters)


def test_option_that_stands_in_two_places_is_refused():
    one = {"pick": TWO["pick"]}
    parameters = {"configurations": one, "kill_nodes": ["a"], "functions": {"f_pick": GRASP}}
    with pytest.raises(ConfigurationError, match="stands beside functions/f_pick: put it there, too"):
        parse_options(parameters, lambda uri, _anywhere: uri)


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("", {}),
        (None, {}),
        ("pick", {"f_pick": "pick"}),
        (["pick", "look"], {"f_pick": "pick", "f_look": "look"}),
        ("pick, look", {"f_pick": "pick", "f_look": "look"}),
        ("[look]", {"f_look": "look"}),
    ],
)
def test_one_configuration_of_each_function_can_be_named(names, found):
    assert parse().one_per_function(names, "~initial_configuration") == found


@pytest.mark.parametrize("names", ["pik", ["pick", "pick"], 3])
def test_names_that_cannot_be_meant_are_refused(names):
    with pytest.raises(ConfigurationError, match="~initial_configuration"):
        parse().one_per_function(names, "~initial_configuration")
