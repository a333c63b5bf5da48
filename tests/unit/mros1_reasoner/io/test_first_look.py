"""What the doctor looks at on this machine."""

import pytest
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
