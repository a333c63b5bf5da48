"""What the doctor looks at on this machine."""

from types import SimpleNamespace

import pytest
from mros1_reasoner.io import first_look
from mros1_reasoner.io.first_look import _arguments, _initial


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        (["python3", "/opt/ros/bin/roslaunch", "rover", "robot.launch"], ["rover", "robot.launch"]),
        (["roslaunch", "-p", "11411", "rover", "robot.launch", "rate:=3"], ["rover", "robot.launch", "rate:=3"]),
        (["roslaunch", "--wait", "robot.launch", "--screen", "__name:=r"], ["robot.launch"]),
        (["rosrun", "rover", "driver"], None),
    ],
)
def test_arguments_of_a_roslaunch_are_without_its_options(words, arguments):
    assert _arguments(words) == arguments


def test_launch_files_tell_what_they_begin_with(tmp_path):
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "barn.launch").write_text(
        '<launch><arg name="initial_configuration" default="slow"/><include file="x">'
        '<arg name="initial_configuration" value="$(arg initial_configuration)"/></include></launch>'
    )
    (tmp_path / "launch" / "plain.launch").write_text("<launch/>")
    (tmp_path / "launch" / "broken.launch").write_text("<launch>")
    for name in ("nope", "utf-7", "idna"):
        (tmp_path / "launch" / f"{name}.launch").write_text(f'<?xml version="1.0" encoding="{name}"?><launch/>')
    assert list(_initial(tmp_path)) == [("launch/barn.launch", "slow")]


def test_type_of_a_goal_is_looked_up_in_ros_packages_and_nothing_else_is_imported(tmp_path, monkeypatch):
    mark = tmp_path / "mark"
    (tmp_path / "trapped").mkdir()
    for name in ("trapped/__init__.py", "trapped/msg.py", "sprung.py"):
        (tmp_path / name).write_text(f"open({str(mark)!r}, 'w').close()\nclass Kind: pass\nclass KindAction: pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    known = "move_base_msgs.msg.MoveBaseAction"
    names = ("sprung.Kind", "trapped.msg.KindAction", known, "move_base_msgs/NoSuchAction")
    functions = {f"f_{number}": {"goal_msg_type": name} for number, name in enumerate(names)}
    found = first_look._missing_types(SimpleNamespace(settings={"functions": functions}))
    assert not mark.exists()
    assert set(found) == {*names} - {known}
    assert found["sprung.Kind"].startswith("names no action's type")
    assert found["trapped.msg.KindAction"] == "can't be imported (no package trapped)"
