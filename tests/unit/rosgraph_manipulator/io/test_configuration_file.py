"""The manipulator's configuration file, in both forms."""

import pytest
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.ros import manipulator


@pytest.fixture
def launch_file(tmp_path):
    path = tmp_path / "a.launch"
    path.write_text("<launch/>")
    return path


def test_own_form_names_function_launch_file_and_arguments(launch_file):
    options = options_from({"configurations": {"a": {"function": "f", "launch": str(launch_file), "args": ["x:=1"]}}})
    configuration = options.configurations["a"]
    assert (configuration.function, configuration.launch_file, configuration.args) == ("f", str(launch_file), ("x:=1",))


def test_published_command_is_parsed_into_package_file_and_arguments():
    command = "roslaunch rosgraph_manipulator manipulator.launch config:=/a"
    options = options_from({"configurations": {"a": {"command": command}}})
    configuration = options.configurations["a"]
    assert configuration.launch_file.endswith("rosgraph_manipulator/launch/manipulator.launch")
    assert configuration.args == ("config:=/a",)


def test_published_action_type_is_understood(launch_file):
    options = options_from(
        {
            "configurations": {"a": {"launch": str(launch_file)}},
            "save_action": "/move_base",
            "goal_msg_type": "move_base_msgs.msg.MoveBaseAction",
            "kill_nodes": ["/move_base"],
        }
    )
    navigate = options.of("f_navigate")
    assert navigate.save_action == "/move_base"  # with its slash, it is a global name
    assert navigate.action_type == "move_base_msgs/MoveBaseAction"
    assert options.reconfiguration_action_name == "rosgraph_manipulator_action_server"


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
        options_from(parameters)


@pytest.mark.parametrize("bad", [{"kill_nodes": "move_base"}, {"save_action": "m", "goal_msg_type": "os.system"}])
def test_unusable_parameter_is_refused(launch_file, bad):
    with pytest.raises(ConfigurationError, match=next(reversed(bad))):
        options_from({"configurations": {"a": {"launch": str(launch_file)}}, **bad})


PUBLISHED = """
configurations:
  f_one:
    command: "roslaunch metacontrol_sim f1_v1_r1.launch"
  f_two:
    command: roslaunch rosgraph_manipulator manipulator.launch config:=/some/file.yaml
kill_nodes: ['/move_base']
save_action: 'move_base'
goal_msg_type: move_base_msgs.msg.MoveBaseAction
reconfiguration_action_name: 'rosgraph_manipulator_action_server'
"""


def test_published_file_loads_unchanged(tmp_path):
    path = tmp_path / "configurations.yaml"
    path.write_text(PUBLISHED)
    options = options_from(read_file(str(path)))
    assert list(options.configurations) == ["f_one", "f_two"]
    # as roslaunch does, a file is found anywhere in its package
    assert options.configurations["f_one"].launch_file.endswith("metacontrol_sim/launch/variants/f1_v1_r1.launch")
    assert options.configurations["f_two"].args == ("config:=/some/file.yaml",)
    navigate = options.of("f_navigate")
    assert navigate.kill_nodes == ("/move_base",)
    assert (navigate.save_action, navigate.action_type) == ("move_base", "move_base_msgs/MoveBaseAction")


@pytest.mark.parametrize(
    ("text", "words"), [("", "found none"), ("a: [", "correct the YAML"), ("- a", "found none"), (None, "No such file")]
)
def test_file_that_is_no_configuration_is_refused(tmp_path, text, words):
    path = tmp_path / "configurations.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ConfigurationError, match=words):
        read_file(str(path))


def test_topics_to_wait_for_are_names(launch_file):
    entry = {"launch": str(launch_file), "topics": ["plan"]}
    assert options_from({"configurations": {"a": entry}}).configurations["a"].topics == ("plan",)
    with pytest.raises(ConfigurationError, match="topics"):
        options_from({"configurations": {"a": {**entry, "topics": "plan"}}})


def test_key_that_the_nodes_file_has_no_longer_is_removed(tmp_path, monkeypatch):
    told = {}
    monkeypatch.setattr(manipulator, "set_parameters", lambda values, delete: told.update(set=values, gone=delete))
    monkeypatch.setattr(manipulator.rospy, "resolve_name", lambda name: f"/cell/{name}")
    path = tmp_path / "c.yaml"
    path.write_text("configurations: {a: {launch: x}}\nkill_nodes: []\n")
    manipulator.read_parameters([str(path)])
    assert told["set"] == {"/cell/configurations": {"a": {"launch": "x"}}, "/cell/kill_nodes": []}
    assert {"/cell/functions", "/cell/save_action", "/cell/goal_msg_type"} < set(told["gone"])
    assert not told["set"].keys() & set(told["gone"])


def test_missing_absolute_path_of_a_command_concerns_its_configuration_alone(tmp_path, launch_file):
    (tmp_path / "old" / "deep").mkdir(parents=True)
    (tmp_path / "old" / "deep" / "nav.launch").write_text("<launch/>")
    entries = {
        "ok": {"launch": str(launch_file)},
        "mistyped": {"command": f"roslaunch {tmp_path}/nav/nav.launch"},
        "at_the_root": {"command": "roslaunch /nav_missing.launch"},
    }
    found = options_from({"configurations": entries}).configurations
    assert found["ok"].problem == ""
    for name, path in (("mistyped", f"{tmp_path}/nav/nav.launch"), ("at_the_root", "/nav_missing.launch")):
        remedy = "correct the name, or generate it"
        assert found[name].problem == f"configurations/{name}: there is no launch file {path}: {remedy}"


@pytest.mark.parametrize(
    ("file", "is_found"),
    [("f1_v1_r1.launch", True), ("variants/f1_v1_r1.launch", True), ("no_such_folder/f1_v1_r1.launch", False)],
)
def test_file_of_a_command_is_searched_in_its_package_with_the_folder_that_is_given(file, is_found):
    entries = {
        "a": {"command": f"roslaunch metacontrol_sim {file}"},
        "b": {"command": "roslaunch metacontrol_sim f1_v1_r1.launch"},
    }
    assert (options_from({"configurations": entries}).configurations["a"].problem == "") is is_found
