"""Names of interfaces in the model of a launch file."""

import os

import pytest
from ros_model.generators.launch import launch_file
from ros_model_extraction.io.launch_files import read_launch_file

PACKAGE = (
    "<package format='2'><name>bells</name><version>0.1.0</version><description>x</description>"
    "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
)
BELL = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String

rospy.init_node("bell")
rospy.Publisher("/rung", String, queue_size=1)
rospy.Subscriber("rope", String, print)
rospy.spin()
"""


@pytest.mark.parametrize(
    ("remaps", "names"),
    [
        ("", ["/rung", "rope"]),
        ("<remap from='/rung' to='rung'/>", ["rope", "rung"]),
        ("<remap from='/rung' to='/heard'/>", ["/heard", "rope"]),
        ("<remap from='rope' to='/pulled'/>", ["/pulled", "/rung"]),
    ],
)
def test_name_with_a_slash_in_the_code_keeps_it_unless_it_is_remapped(tmp_path, monkeypatch, remaps, names):
    (tmp_path / "bells" / "nodes").mkdir(parents=True)
    (tmp_path / "bells" / "package.xml").write_text(PACKAGE)
    script = tmp_path / "bells" / "nodes" / "bell"
    script.write_text(BELL)
    script.chmod(0o755)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}{os.pathsep}{os.environ.get('ROS_PACKAGE_PATH', '')}")
    path = tmp_path / "a.launch"
    path.write_text(f"<launch><node name='bell' pkg='bells' type='bell'>{remaps}</node></launch>")
    system = read_launch_file(path).system
    (component,) = system.components
    assert sorted(port.name for port in component.ports) == names
    assert ("<remap" in launch_file(system)) == bool(remaps)
