"""The checker: what is wrong in a model that reads well, and where."""

import re
from dataclasses import replace

import pytest
from ros_model.checks.systems import check_system
from ros_model.errors import ModelError
from ros_model.generators.launch import launch_file
from ros_model.language.metamodel import Reference, compose
from ros_model.language.system_reader import parse_system

TALK = """RosSystem { Name talk RosComponents (
    ComponentInterface { name talker RosPublishers { RosPublisher out { RefPublisher 'p.t.t.out' } } }
    ComponentInterface { name listener RosSubscribers { RosSubscriber in { RefSubscriber 'p.l.l.in' } } } )
    TopicConnections { TopicConnection chat { From ( 'talker.out' ) To ( 'listener.in' ) } } }"""


def found(text):
    return [str(finding) for finding in check_system(parse_system(text, "m"))]


def component(inside):
    return f"RosSystem {{ Name x RosComponents ( ComponentInterface {{ name a {inside} }} ) }}"


def parameter(inside):
    return f"RosSystem {{ Name x Parameters {{ Parameter {{ name p {inside} }} }} }}"


def test_sound_model_has_no_findings():
    assert found(TALK) == []


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        (TALK.replace("'talker.out'", "'listener.in'"), "m:4:54: error: connection 'chat': 'listener.in' is a sub"),
        (TALK.replace("'talker.out'", "'nobody.out'"), "'nobody.out' names no component"),
        (TALK.replace("'talker.out'", "'talker.loud'"), "'talker' has no port 'loud'"),
        (TALK.replace("'talker.out'", ""), "connection 'chat' has no source"),
        (
            "RosSystem { Name x RosComponents ( ComponentInterface { name a }\n ComponentInterface { name a } ) }",
            "m:2:2: error: component 'a' stands twice",
        ),
        (component("RosPublishers { RosPublisher b { } RosPublisher b { } }"), "publisher 'b' of 'a' stands twice"),
        (
            component("RosParameters { RosParameter b { RefParameter 'p.a.n.b' value 1 } "
                      "RosParameter c { RefParameter 'p.a.n.b' value 2 } }"),
            "parameter 'p.a.n.b' has two values",
        ),
        (component("FromRosNode '/etc/passwd.a.n'"), "'/etc/passwd' is no name of a package"),
        (component("FromRosNode 'p.a'"), "reference 'p.a' is not package.artifact.node"),
        (component("RosPublishers { RosPublisher b { RefPublisher 'p.a.n' } }"), "is not package.artifact.node.name"),
        (parameter("type Integer value 1.5"), "the value 1.5 of 'p' is no Integer"),
        (parameter("type Integer value true"), "the value True of 'p' is no Integer"),
        (parameter("type Double default fast"), "the default 'fast' of 'p' is no Double"),
        (parameter("type List {Integer} value {1, 2}"), "value [1, 2] of 'p' has 2 members, List { Integer } has 1"),
        (parameter("type List {Integer, String} value {1}"), "has 1 member, List { Integer, String } has 2"),
        (parameter("type List {Integer} value {}"), "has 0 members, List { Integer } has 1"),
        (parameter("type Array {type Integer} value {1, 2.5}"), "has member 2, 2.5, that is no Integer"),
        (parameter("type Array {type Array {type Integer}} value {{1}, {2, a}}"),
         "has member 2, [2, 'a'], that has member 2, 'a', that is no Integer"),
        (parameter("type Struct {b Integer} value { {c {value 1}} }"),
         "has member 'c', Struct { b Integer } has none of that name"),
        (parameter("type Struct {b Integer} value { {b {value x}} }"), "has member 'b', 'x', that is no Integer"),
        (parameter("type List value '[false, true]'"), "write the table as YAML, with p: [false, true]"),
        (parameter("type Struct {b Integer} value '{b: 1}'"), "write the table as YAML, with p: {b: 1}"),
        (parameter("type Integer value { 1 }"), "the value [1] of 'p' is no Integer"),
        (parameter("type Base64 value 'no base!'"), "is no Base64"),
        (parameter("type Date value yesterday"), "is no Date"),
        (parameter("type Struct {b List {Double, Integer default x}}"), "the default 'x' of 'p' is no Integer"),
    ],
)  # fmt: skip
def test_fault_is_found(text, finding):
    (message,) = found(text)
    assert finding in message


@pytest.mark.parametrize(
    ("text", "rule", "finding"),
    [
        (parameter("type String value x").replace("name p", "name 'a b'"), "name", "m:1:33: error: 'a b' is no name"),
        (component("").replace("name a", "name 'nav\" args=\"x'"), "name", "m:1:36: error: 'nav\" args=\"x' is no"),
        (component("NameSpace '$(env HOME)'"), "name", "m:1:36: error: '$(env HOME)' is no name of ROS"),
        (component("RosParameters { RosParameter 'b c' { value 1 } }"), "name", "'b c' is no name of ROS"),
        (component("RosPublishers { RosPublisher 'b c' { RefPublisher 'p.a.n.b' } }"), "name", "'b c' is no name of"),
        (component("FromRosNode 'p.a;b.n'"), "name", "m:1:76: error: 'a;b' can't name a package or executable"),
        (parameter("type String value '$(env HOME)'"), "substitution", "m:1:70: error: '$(env HOME)' holds"),
        (parameter("type String default '$(env HOME)'"), "substitution", "holds '$(', which roslaunch would evaluate"),
        (parameter("type List value {'$(env HOME)'}"), "substitution", "holds '$(', which roslaunch would evaluate"),
        (component("RosParameters { RosParameter b { value '$(env HOME)' } }"), "substitution", "m:1:103: error: '$("),
        (parameter("type Integer value 4294967296"), "value", "has more than 32 bits"),
    ],
)  # fmt: skip
def test_what_generate_refuses_is_found(text, rule, finding):
    system = parse_system(text, "m")
    (told,) = check_system(system)
    assert (told.rule, finding in str(told)) == (rule, True), told
    with pytest.raises(ModelError):
        launch_file(replace(system, components=tuple(map(_runnable, system.components))))


def _runnable(runs):
    return runs if runs.executable else replace(runs, node=Reference("p", "a", "n"))


@pytest.mark.parametrize("value", ["fast", "{1, 2}", "{ {a {value 1}} }", "'fast'", "ParameterAny { value x }"])
def test_caret_stands_under_the_value(value):
    text = parameter(f"type Integer value {value}")
    column = text.index("value") + len("value ") + 1
    column += value.find("x }") if "Any" in value else 0
    assert found(text)[0].startswith(f"m:1:{column}: error: the value ")


@pytest.mark.parametrize(
    "declared",
    [
        "Integer default HERE",
        "Integer { default HERE }",
        "Array { type Integer default { HERE } }",
        "Array { type Integer } default 'HERE'",
        "Struct { a Integer, b Integer default HERE }",
        "List { Integer default HERE }",
    ],
)
def test_caret_stands_under_the_default(declared):
    text = parameter(f"type {declared}")
    column = text.index(re.search(r"'?(\{ )?HERE", text[text.index("default") :])[0]) + 1
    assert found(text)[0].startswith(f"m:1:{column}: error: the default ")


@pytest.mark.parametrize(
    "inside",
    ["type Integer value 1.5", "type List {Integer} value {}", "type Struct {b Integer} value { {c {value 1}} }"],
)
def test_generate_says_of_a_value_what_check_says(inside):
    text = parameter(inside)
    with pytest.raises(ModelError) as refused:
        launch_file(parse_system(text, "m"))
    assert found(text) == [str(refused.value).replace(": the", ": error: the", 1)]


@pytest.mark.parametrize(
    "inside",
    [
        "type Double value 1",
        "type Array {type Integer} value {1, 2}",
        "type List {Integer, String} value {1, a}",
        "type Struct {b Integer} value { {b {value 1}} }",
        "type Base64 value 'AAEC'",
        "type Base64 value 0b0110",
        "type Base64 value 'AA EC'",
        "type Date value 2026-1-2T10:20:30",
        "type Any value 1",
        "type List value {1, a}",
    ],
)
def test_value_of_its_type_is_no_fault_and_can_be_launched(inside):
    assert found(parameter(inside)) == []
    assert "qa" in launch_file(parse_system(parameter(inside).replace("name p", "name qa")))


CAMERAS = """RosSystem { Name x RosComponents (
    ComponentInterface { name camera NameSpace left FromRosNode 'p.c.c'
        RosPublishers { RosPublisher image { RefPublisher 'p.c.c.image' } } }
    ComponentInterface { name camera NameSpace right FromRosNode 'p.c.c'
        RosPublishers { RosPublisher image { RefPublisher 'p.c.c.image' } } }
    ComponentInterface { name view FromRosNode 'p.v.v'
        RosSubscribers { RosSubscriber in { RefSubscriber 'p.v.v.in' } } } )
    TopicConnections { TopicConnection 'left/image' { From ( 'camera.image' ) To ( 'view.in' ) } } }"""


def test_connection_to_one_of_two_components_of_a_name_is_refused_with_the_remedy():
    told = "m:8:62: error: 'camera' is left/camera and right/camera: name each component by its whole name"
    (finding,) = (finding for finding in found(CAMERAS) if "whole name" in finding)
    assert finding == f"{told}, such as 'left/camera'"
    with pytest.raises(ModelError, match="name each component by its whole name"):
        launch_file(parse_system(CAMERAS, "m"))


def test_whole_names_tell_components_apart_and_so_do_none_where_nothing_is_connected():
    whole = CAMERAS.replace("name camera NameSpace left", "name 'left/camera'").replace("'camera.", "'left/camera.")
    alone = re.sub(r"TopicConnections.*", "}", CAMERAS, flags=re.DOTALL)
    assert not [finding for text in (whole, alone) for finding in found(text) if "whole name" in finding]
    assert "error" not in "".join(found(whole))


def test_variant_replaces_the_component_of_its_namespace_only():
    base = parse_system(re.sub(r"TopicConnections.*", "}", CAMERAS, flags=re.DOTALL), "m")
    variant = replace(base, name="v", components=base.components[1:2], connections=())
    names = [component.graph_name for component in compose(base, variant).components]
    assert sorted(names) == ["left/camera", "right/camera", "view"]
