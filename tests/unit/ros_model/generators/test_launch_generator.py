"""Launch files from models: roslaunch's own loader reads them back; nothing in a model is evaluated or injected."""

from dataclasses import replace
from xmlrpc.client import Binary

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_model.errors import ModelError
from ros_model.generators.launch import launch_file
from ros_model.language.library import Library
from ros_model.language.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    ParameterType,
    Port,
    PortKind,
    PortPath,
    Position,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
)
from ros_model.language.packages_reader import parse_packages
from ros_model.language.remappings import remappings_of, remark
from rosgraph.names import resolve_name
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

NODE = Reference("drivers", "laser", "laser_node")


def of(*parameters, name="laser", node=NODE, namespace=None, ports=(), connections=()):
    return RosSystem("x", (Component(name, node, namespace, ports, parameters),), connections)


def loaded_text(text):
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load_string(text, config, verbose=False)
    return config


def loaded(system):
    return loaded_text(launch_file(system))


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


TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff"))
SCALARS = st.booleans() | st.integers(-(2**31), 2**31 - 1) | st.floats(allow_nan=False, allow_infinity=False) | TEXTS


@settings(deadline=None)
@given(SCALARS | st.lists(SCALARS, max_size=4))
def test_value_arrives_as_it_is_or_is_refused(value):
    try:
        text = launch_file(of(RosParameter("a", None, value)))
    except ModelError as error:
        assert "$(" in str(error)
        return
    actual = loaded_text(text).params["/laser/a"].value
    assert (actual, type(actual)) == (value, type(value))


@pytest.mark.parametrize(
    "value", [" a", "a ", "\t", "two\nlines", "- a", "{", "#x", "'", '"', "&amp;", "]]>", "é", "deg(90)", "1e3"]
)
def test_text_that_xml_or_yaml_might_take_for_something_else(value):
    for sent in (value, [value], {"m": [value]}):
        actual = loaded(of(RosParameter("a", None, sent))).params
        expected = {"/laser/a/m": [value]} if isinstance(sent, dict) else {"/laser/a": sent}
        assert {name: param.value for name, param in actual.items()} == expected


def declared(kind, value=None, **more):
    system = RosSystem("x", parameters=(SystemParameter("a", ParameterType(kind, **more), value, position=HERE),))
    (param,) = loaded(system).params.values()
    return param.value


HERE = Position("x.rossystem", 3, 5)
TEXT, WHOLE, DOUBLE, BYTES = (ParameterType(kind) for kind in ("String", "Integer", "Double", "Base64"))


@pytest.mark.parametrize(
    ("kind", "value", "more", "expected"),
    [
        ("Double", 1, {}, 1.0),
        ("String", 15, {}, "15"),
        ("String", True, {}, "true"),
        ("Boolean", False, {}, False),
        ("Base64", "aGVsbG8=", {}, Binary(b"hello")),
        ("Base64", "0b100000001", {}, Binary(b"\x01\x01")),
        ("Integer", None, {"default": 7}, 7),
        ("Array", [1, 2.5], {"elements": (DOUBLE,)}, [1.0, 2.5]),
        ("List", [1, 1, "aGk="], {"elements": (DOUBLE, TEXT, BYTES)}, [1.0, "1", Binary(b"hi")]),
        ("Any", [1, "x"], {}, [1, "x"]),
    ],
)
def test_declared_type_decides(kind, value, more, expected):
    actual = declared(kind, value, **more)
    assert actual == expected
    assert type(actual) is type(expected)


def test_members_of_a_struct_have_their_declared_types():
    kind = ParameterType("Struct", members=(("gain", DOUBLE), ("id", TEXT), ("key", BYTES)))
    system = RosSystem("x", parameters=(SystemParameter("a", kind, {"gain": 2, "id": 7, "key": "aGk="}),))
    params = {name: param.value for name, param in loaded(system).params.items()}
    assert params == {"/a/gain": 2.0, "/a/id": "7", "/a/key": Binary(b"hi")}
    assert isinstance(params["/a/gain"], float)


@pytest.mark.parametrize(
    ("kind", "value", "more"),
    [
        ("Integer", 0.5, {}),
        ("Integer", True, {}),
        ("Boolean", 1, {}),
        ("Double", "fast", {}),
        ("Double", 10**400, {}),
        ("Base64", "no base!", {}),
        ("List", [1], {"elements": (WHOLE, WHOLE)}),
        ("Array", ["a"], {"elements": (WHOLE,)}),
        ("Struct", {"a": 1}, {"members": (("b", WHOLE),)}),
    ],
)
def test_value_that_is_none_of_its_type_is_refused(kind, value, more):
    with pytest.raises(ModelError, match=rf"^x\.rossystem:3:5: the value .* of 'a' (is no {kind}|has )"):
        declared(kind, value, **more)


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, [2**40], {"a": 2**31}, float("inf"), [float("nan")]])
def test_number_that_the_parameter_server_can_not_hold_is_refused(value):
    with pytest.raises(ModelError, match=r"^x\.rossystem:3:5: "):
        launch_file(of(RosParameter("a", None, value, position=HERE)))


def test_type_that_the_model_of_the_node_declares_decides():
    library = Library(
        parse_packages(
            "PackageSet { CatkinPackage drivers { Artifact laser { Node { name laser_node Parameters {"
            " Parameter { name rate type Double }, Parameter { name key type Base64 },"
            " Parameter { name gains type Array { type Double } } } } } } }"
        ).packages
    )
    values = {"rate": 15, "key": "aGk=", "gains": [1, 2], "other": 3}
    system = of(*(RosParameter(name, replace(NODE, name=name), value) for name, value in values.items()))
    params = loaded_text(launch_file(system, library=library)).params
    assert repr([params[f"/laser/{name}"].value for name in ("rate", "gains", "other")]) == "[15.0, [1.0, 2.0], 3]"
    assert params["/laser/key"].value == Binary(b"hi")


def test_struct_becomes_a_group_of_parameters():
    parameter = RosParameter("limits", None, {"speed": 0.5, "axes": [1, 2]})
    params = loaded(of(parameter)).params
    assert {name: param.value for name, param in params.items()} == {
        "/laser/limits/speed": 0.5,
        "/laser/limits/axes": [1, 2],
    }


def test_private_name_of_a_parameter_is_one_of_the_node():
    assert list(loaded(of(RosParameter("rate", replace(NODE, name="~rate"), 1))).params) == ["/laser/rate"]


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


@pytest.mark.parametrize(
    ("connection", "remapped"),
    [("left/scan", []), ("left/front/scan", [("scan", "front/scan")]), ("scan", [("scan", "/scan")])],
)
def test_connection_is_named_as_a_node_in_a_namespace_resolves_it(connection, remapped):
    system = of(name="left/laser", ports=(port("out", "scan"),), connections=connected(connection, "left/laser"))
    assert remaps(system) == remapped


@pytest.mark.parametrize(
    ("name", "connection", "other", "remapped"),
    [
        ("/scan", "scan", "/scan", []),
        ("/scan", "/scan", "scan", []),
        ("/scan", "scan", "scan", [("/scan", "scan")]),  # the others are in the namespace, too
        ("/scan", "front/scan", "/scan", [("/scan", "front/scan")]),
        ("/tf", "tf", "tf", []),
        ("/tf", "front/tf", "tf", [("/tf", "front/tf")]),
    ],
)
@pytest.mark.parametrize("component", ["laser", "left/laser"])
def test_connection_called_as_an_absolute_port_is_no_remapping(name, connection, other, remapped, component):
    ends = (PortPath(component, name),), (PortPath("nav", other), PortPath("map", other))
    system = of(name=component, ports=(port(name),), connections=(Connection(connection, ConnectionKind.TOPIC, *ends),))
    outside = "/" if "/" in component else ""
    assert remaps(system) == [(inside, outside + topic) for inside, topic in remapped if outside + topic != inside]


def test_remapping_of_an_absolute_name_into_the_namespace_is_kept():
    ends = (PortPath("laser", "tf"),), (PortPath("laser", "tf"),)
    system = of(ports=(port("tf", "/tf"),), connections=(Connection("tf", ConnectionKind.TOPIC, *ends),))
    assert remaps(system) == [("/tf", "tf")]


def test_node_in_a_namespace_publishes_its_connection():
    system = of(name="left/laser", ports=(port("out", "scan"),), connections=connected("left/merged", "left/laser"))
    (node,) = loaded(system).nodes
    assert resolve_name(dict(node.remap_args)["scan"], f"{node.namespace}{node.name}") == "/left/merged"


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


SCAN = (PortPath("filter", "clean"),), (PortPath("laser", "in"),)


def kept(*pairs, ports=(), connections=(), namespace=None):
    return replace(
        of(ports=ports, connections=connections, namespace=namespace), header="A robot.\n" + remark("/laser", pairs)
    )


def test_remapping_that_belongs_to_no_port_is_kept_and_one_of_a_port_goes_first():
    system = kept(("late", "/map"), ("~in", "elsewhere"), ports=[port("in", "~in", PortKind.SUBSCRIBER)])
    assert remaps(system) == [("~in", "in"), ("late", "/map")]


def test_all_names_in_the_code_for_one_topic_follow_a_variant_that_connects_another():
    ports = [port("in", "echo", PortKind.SUBSCRIBER), port("do", "act", PortKind.ACTION_SERVER)]
    connection = Connection("clean", ConnectionKind.TOPIC, *SCAN)
    action = Connection("dock", ConnectionKind.ACTION, (PortPath("laser", "do"),), (PortPath("ui", "dock"),))
    found = remaps(kept(("/in", "in"), ("~go/goal", "do/goal"), ports=ports, connections=[connection, action]))
    assert {("echo", "clean"), ("/in", "clean"), ("~go/goal", "dock/goal")} < set(found)


def test_word_that_is_no_remapping_is_passed_over():
    assert remappings_of("Also remapped: /cell/eye: a:=b $(x):=c d.e:=f g:= ~h:=/i, j:=k") == {
        "cell/eye": (("a", "b"), ("j", "k"))
    }
