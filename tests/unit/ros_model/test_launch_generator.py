"""Launch files from models: roslaunch's own loader reads them back; nothing in a model is evaluated or injected."""

from dataclasses import replace

import pytest
from ros_model.errors import ModelError
from ros_model.generators.launch import launch_file
from ros_model.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    Port,
    PortKind,
    PortPath,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
)
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

NODE = Reference("drivers", "laser", "laser_node")


def of(*parameters, name="laser", node=NODE, namespace=None, ports=(), connections=()):
    return RosSystem("x", (Component(name, node, namespace, ports, parameters),), connections)


def loaded(system):
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load_string(launch_file(system), config, verbose=False)
    return config


def remaps(system):
    (node,) = loaded(system).nodes
    return [tuple(remap) for remap in node.remap_args]


def port(name, inside=None, kind=PortKind.PUBLISHER, namespace=None):
    return Port(name, kind, replace(NODE, name=inside or name), namespace)


def test_node_is_the_artifact_of_the_reference():
    (node,) = loaded(of(namespace="left/arm")).nodes
    assert (node.package, node.type, node.name, node.namespace) == ("drivers", "laser", "laser", "/left/arm/")
    assert (node.cwd, node.respawn, node.output) == ("node", False, "screen")


@pytest.mark.parametrize("value", [3, 0.5, True, "15", "true", "a < b & \"c\" 'd'", "", [1, 2.5, "a"]])
def test_parameter_keeps_its_type(value):
    parameter = RosParameter("label", replace(NODE, name="group/rate"), value)
    actual = loaded(of(parameter)).params["/laser/group/rate"].value
    assert actual == value
    assert type(actual) is type(value)


def test_struct_becomes_a_group_of_parameters():
    parameter = RosParameter("limits", None, {"speed": 0.5, "axes": [1, 2]})
    params = loaded(of(parameter)).params
    assert {name: param.value for name, param in params.items()} == {
        "/laser/limits/speed": 0.5,
        "/laser/limits/axes": [1, 2],
    }


def test_parameter_of_the_system_is_global():
    system = RosSystem("x", parameters=(SystemParameter("qa_safety", None, 0.5, "robot"),))
    assert loaded(system).params["/robot/qa_safety"].value == 0.5


def test_parameter_without_a_value_is_left_to_the_node():
    assert loaded(of(RosParameter("rate"))).params == {}


def connected(name, component="laser"):
    return (Connection(name, ConnectionKind.TOPIC, (PortPath(component, "out"),), (PortPath("nav", "in"),)),)


def test_port_is_remapped_to_its_connection():
    assert remaps(of(ports=(port("out", "scan"),), connections=connected("front/scan"))) == [("scan", "front/scan")]


def test_connection_is_absolute_where_the_component_has_a_namespace():
    system = of(namespace="arm", ports=(port("out", "scan"),), connections=connected("front/scan"))
    assert remaps(system) == [("scan", "/front/scan")]


def test_port_without_a_connection_has_its_own_name():
    assert remaps(of(ports=(port("left/scan", "scan"), port("odom")))) == [("scan", "left/scan")]


def test_namespace_of_a_port_drops_its_slash():
    assert remaps(of(ports=(port("/left/scan", "scan", namespace="left"),))) == [("scan", "left/scan")]


def test_action_is_remapped_in_its_five_topics():
    found = remaps(of(ports=(port("arm", "move", PortKind.ACTION_SERVER),)))
    assert found == [(f"move/{t}", f"arm/{t}") for t in ("goal", "cancel", "status", "result", "feedback")]


@pytest.mark.parametrize(
    "system",
    [
        of(RosParameter("a", None, "$(env HOME)")),
        of(RosParameter("a", None, ["$(eval 1)"])),
        of(RosParameter("$(arg x)", None, 1)),
        of(RosParameter("a", None, "bell \x07")),
        of(name='x" args="y'),
        of(name="$(arg x)"),
        of(namespace="a b"),
        of(node=Reference("drivers", "../../bin/sh", "n")),
        of(node=Reference("$(find x)", "laser", "n")),
        of(node=Reference("drivers", "laser", "")),
        of(node=None),
        of(ports=(port("a b", "scan"),)),
        RosSystem("x", parameters=(SystemParameter("a b", None, 1),)),
    ],
)
def test_what_roslaunch_would_evaluate_or_misread_is_refused(system):
    with pytest.raises(ModelError):
        launch_file(system)
