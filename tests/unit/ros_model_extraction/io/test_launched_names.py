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


NODELETS = """
#include <nodelet/nodelet.h>
namespace plant {
class Damper : public nodelet::Nodelet {
  void onInit() override {
    out_ = getNodeHandle().advertise<std_msgs::String>("damped", 1);
    in_ = getPrivateNodeHandle().subscribe("raw", 1, &Damper::onRaw, this);
    getPrivateNodeHandle().param("window", window_, 3.0);
  }
  void onRaw(const std_msgs::String::ConstPtr& text) {}
  ros::Publisher out_;
  ros::Subscriber in_;
  double window_;
};
}
"""
STARTED = """<launch><group ns="hall">
  <node name="host" pkg="nodelet" type="nodelet" args="manager"/>
  <node name="damper" pkg="nodelet" type="nodelet" args="load plant/damper {manager} --no-bond">
    <remap from="~raw" to="/gauge/pressure"/>
    <param name="window" value="2"/>
  </node>
  <node name="alone" pkg="nodelet" type="nodelet" args="standalone plant/damper"/>
</group></launch>"""


@pytest.fixture
def started(tmp_path, monkeypatch):
    folder = tmp_path / "plant"
    (folder / "src").mkdir(parents=True)
    export = '<export><nodelet plugin="${prefix}/nodelets.xml"/></export></package>'
    (folder / "package.xml").write_text(PACKAGE.replace("bells", "plant").replace("</package>", export))
    (folder / "CMakeLists.txt").write_text("project(plant)\nadd_library(dampers src/dampers.cpp)\n")
    (folder / "nodelets.xml").write_text(
        "<library path='lib/libdampers'>"
        '<class name="plant/damper" type="plant::Damper" base_class_type="nodelet::Nodelet"/></library>'
    )
    (folder / "src" / "dampers.cpp").write_text(NODELETS)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}{os.pathsep}{os.environ.get('ROS_PACKAGE_PATH', '')}")

    def read(manager="host"):
        path = tmp_path / "a.launch"
        path.write_text(STARTED.format(manager=manager))
        return read_launch_file(path)

    return read


def names_of(system, component):
    return {(port.kind.value, port.name) for port in system.component(component).ports}


def test_manager_has_the_interfaces_of_a_nodelet_and_its_loader_has_the_parameters(started):
    models = started()
    assert {("publisher", "damped"), ("subscriber", "/gauge/pressure")} <= names_of(models.system, "host")
    assert names_of(models.system, "damper") == set()
    assert [(p.name, p.value) for p in models.system.component("damper").parameters] == [("window", 2)]
    declared = models.packages.node("nodelet", "nodelet", "damper")
    assert [(p.name, p.type.kind, p.value) for p in declared.parameters] == [("window", "Double", 3.0)]
    assert "/hall/host has the interfaces of the nodelet /hall/damper" in models.system.header
    assert "The interfaces of /hall/damper" not in models.system.header
    assert "Also remapped: /hall/damper: damper/raw:=/gauge/pressure" in models.system.header


def test_nodelet_without_a_manager_has_its_interfaces_itself(started):
    assert names_of(started().system, "alone") == {("publisher", "damped"), ("subscriber", "alone/raw")}


def test_nodelet_of_a_manager_that_is_started_elsewhere_is_told(started):
    header = started(manager="/elsewhere/host").system.header
    assert "the interfaces of the nodelet /hall/damper: its manager /elsewhere/host has them" in header


@pytest.mark.parametrize(
    ("args", "content", "kept", "said"),
    [
        ("_a/b:=1", '<param name="a" value="5"/>', {"a/b": 1}, "/n/a, which /n/a/b replaces"),
        ("_a:=1", '<param name="a/b" value="5"/>', {"a": 1}, "/n/a/b, which /n/a replaces"),
        ("_a:=1 _a/b/c:=2", "", {"a/b/c": 2}, "/n/a, which /n/a/b/c replaces"),
        ("_a:='{b: 1}'", "<rosparam>a: {b: 2, c: 3}</rosparam>", {"a/b": 1}, "/n/a/c, which /n/a replaces"),
        ("_a:=1", '<param name="a" value="5"/>', {"a": 1}, ""),
    ],
)
def test_parameter_that_another_one_replaces_is_said(tmp_path, args, content, kept, said):
    path = tmp_path / "a.launch"
    path.write_text(f'<launch><node name="n" pkg="nowhere" type="t" args="{args}">{content}</node></launch>')
    system = read_launch_file(path).system
    assert {parameter.key: parameter.value for parameter in system.component("n").parameters} == kept
    assert [line for line in system.header.splitlines() if "replaces" in line] == [
        f"Left out: the parameter {said}: no name has both a value and others below it" for _ in filter(None, [said])
    ]
