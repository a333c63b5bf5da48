"""The reader of `.rossystem` files: every form that published files use, and what it says of bad ones."""

import os
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from ros_model.errors import ModelError
from ros_model.io.models import read_system
from ros_model.language.builder import MAX_NESTING
from ros_model.language.metamodel import (
    EXTENSIONS_OF_SCRIPTS,
    ConnectionKind,
    ParameterType,
    PortKind,
    PortPath,
    Reference,
    RosParameter,
    SystemParameter,
)
from ros_model.language.notation import quoted
from ros_model.language.system_reader import parse_system
from ros_model.language.system_writer import write_system

CORPUS = os.environ.get("MROS_CORPUS")

WHOLE = """// A robot.
/* Drawn up
 * by hand. */
RosSystem { Name 'whole'
    RosComponents (
        ComponentInterface { name driver NameSpace arm FromRosNode 'arm_pkg.driver.arm_driver'
            RosParameters { RosParameter rate { RefParameter 'arm_pkg.driver.arm_driver.rate' value 50.0 } }
            RosPublishers {
                RosPublisher "joints" { ns left RefPublisher "arm_pkg.driver.arm_driver.joints" },
                RosPublisher { RefPublisher 'arm_pkg.driver.arm_driver./state' }
            }
            RosSrvServers { RosServiceServer reset { RefServer 'arm_pkg.driver.arm_driver.reset' } }
            RosActionServers { RosActionServer move { RefServer 'arm_pkg.driver.arm_driver.move' } }
        },
        ComponentInterface { name planner
            RosSubscribers { RosSubscriber joints { RefSubscriber 'planning.planner.planner.joints' } }
            RosSrvClients { RosServiceClient reset { RefClient 'planning.planner.planner.reset' } }
            RosActionClients { RosClient move { RefClient 'planning.planner.planner.move' } }
        }
    )
    TopicConnections { TopicConnection joints { From ( 'driver.joints' ) To ( 'planner.joints' ) } }
    ServiceConnections { ServiceConnection reset { From ( 'driver.reset' ) To 'planner.reset' } }
    ActionConnections { ActionConnection move { From 'driver.move' To 'planner.move' } }
    Parameters { Parameter { name qa_speed type Double value 0.5 } }
}
"""


def values(text: str) -> object:
    return (
        parse_system(f"RosSystem {{ Name x Parameters {{ Parameter {{ name p value {text} }} }} }}").parameters[0].value
    )


def declared(text: str) -> ParameterType | None:
    return (
        parse_system(f"RosSystem {{ Name x Parameters {{ Parameter {{ name p type {text} }} }} }}").parameters[0].type
    )


def failure(text: str) -> str:
    with pytest.raises(ModelError) as caught:
        parse_system(text, "m.rossystem")
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_all_sections_are_read():
    system = parse_system(WHOLE)
    driver, planner = system.components
    assert [port.kind for port in driver.ports] == [
        PortKind.PUBLISHER,
        PortKind.PUBLISHER,
        PortKind.SERVICE_SERVER,
        PortKind.ACTION_SERVER,
    ]
    assert [port.kind for port in planner.ports] == [
        PortKind.SUBSCRIBER,
        PortKind.SERVICE_CLIENT,
        PortKind.ACTION_CLIENT,
    ]
    assert driver.node == Reference("arm_pkg", "driver", "arm_driver")
    assert (driver.namespace, driver.graph_name) == ("arm", "arm/driver")
    assert driver.ports[0].namespace == "left"
    assert [connection.kind for connection in system.connections] == list(ConnectionKind)
    assert system.connections[2].sources == (PortPath("driver", "move"),)
    assert system.expected_qas == {"speed": 0.5}


def test_port_without_a_name_takes_that_of_its_reference():
    assert parse_system(WHOLE).components[0].ports[1].name == "/state"


def test_comments_at_the_top_are_kept():
    assert parse_system(WHOLE).header == "A robot.\nDrawn up\nby hand."


def test_positions_are_those_of_the_opening_words():
    system = parse_system(WHOLE, "w.rossystem")
    assert str(system.components[0].position) == "w.rossystem:6:9"
    assert str(system.components[0].parameters[0].position) == "w.rossystem:7:29"
    assert str(system.connections[0].position) == "w.rossystem:21:24"


def test_listing_without_commas_and_references_is_read():
    text = """RosSystem { Name f RosComponents ( ComponentInterface { name a RosParameters {
        RosParameter 'max_vel_x' { value 0.5 }
        RosParameter 'max_vel_y' { value 0 } } } ComponentInterface { name b }, ) }"""
    system = parse_system(text)
    assert [component.name for component in system.components] == ["a", "b"]
    assert [(p.key, p.value) for p in system.components[0].parameters] == [("max_vel_x", 0.5), ("max_vel_y", 0)]


def test_sections_may_be_braced_and_stand_in_any_order():
    text = "RosSystem { Parameters { } RosComponents { ComponentInterface { RosPublishers { } name a } } Name 'x' }"
    system = parse_system(text)
    assert (system.name, system.components[0].name) == ("x", "a")


def test_one_label_may_stand_twice():
    text = """RosSystem { Name x RosComponents ( ComponentInterface { name a RosParameters {
        RosParameter radius { RefParameter 'p.a.n.local/radius' value 1 },
        RosParameter radius { RefParameter 'p.a.n.global/radius' value 2 } } } ) }"""
    assert [p.key for p in parse_system(text).components[0].parameters] == ["local/radius", "global/radius"]


def test_reference_keeps_dots_and_slashes_of_the_port():
    text = "RosSystem { Name x RosComponents ( ComponentInterface { name '/a' RosPublishers { RosPublisher p { "
    text += "RefPublisher 'pkg./iiwa/x./iiwa/x./iiwa/joint.states' } } } ) }"
    reference = parse_system(text).components[0].ports[0].reference
    assert reference == Reference("pkg", "/iiwa/x", "/iiwa/x", "/iiwa/joint.states")


ONE_COMPONENT = "RosSystem {{ Name x RosComponents ( ComponentInterface {{ name a FromRosNode {} }} ) }}"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("vision.detector_fast.py.eye.found", ("vision", "detector_fast.py", "eye", "found")),
        ("vision.start.sh.eye", ("vision", "start.sh", "eye")),
        ("vision.eye.eye.x.py", ("vision", "eye", "eye", "x.py")),
        (r"vision.node_1\.0.eye.found", ("vision", "node_1.0", "eye", "found")),
        (r"vision.old\.eye.py.eye.found", ("vision", "old.eye.py", "eye", "found")),
    ],
)
def test_reference_keeps_the_name_of_the_executable(text, parts):
    assert Reference.parse(text) == Reference(*parts)
    assert str(Reference(*parts)) == text
    system = parse_system(ONE_COMPONENT.format(quoted(text)))
    assert system.components[0].node == Reference(*parts)
    assert parse_system(write_system(system)) == system


def test_reference_without_a_node_after_a_script_is_incomplete_but_read():
    (component,) = parse_system(ONE_COMPONENT.format("'v.e.py'")).components
    assert component.node == Reference("v", "e.py", "")


_PART_OF_A_REFERENCE = st.from_regex(r"[A-Za-z][A-Za-z0-9_.]{0,8}", fullmatch=True)


_NODE = st.from_regex(r"[a-z]{1,3}", fullmatch=True) | st.sampled_from(sorted(EXTENSIONS_OF_SCRIPTS))


@given(_PART_OF_A_REFERENCE, _PART_OF_A_REFERENCE, _NODE, st.text(max_size=8))
@example("p", "a", "rb", "")
@example("p", "a", "py", "name")
@example("p", "a.py", "py", "name")
def test_any_reference_is_read_as_it_was_written(package, artifact, node, name):
    reference = Reference(package, artifact, node, name)
    assert Reference.parse(str(reference)) == reference


def test_words_may_be_keywords_where_a_name_stands():
    text = (
        "RosSystem { Name Name RosComponents ( ComponentInterface { name value } ComponentInterface { name From } ) }"
    )
    assert [component.name for component in parse_system(text).components] == ["value", "From"]


def test_double_slash_within_a_word_opens_no_comment():
    system = parse_system("RosSystem { Name move_base//simple/goal // the end\n }")
    assert system.name == "move_base//simple/goal"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("15", 15),
        ("-3", -3),
        ("0.5", 0.5),
        ("1e-05", 1e-05),
        ("9.00", 9.0),
        ("true", True),
        ("false", False),
        ("point_cloud", "point_cloud"),
        ("package://pkg/a.yaml", "package://pkg/a.yaml"),
        ("'15'", "15"),
        ("'true'", "true"),
        ('"it\'s"', "it's"),
        (r"'a\'b\\c\n\u00e9'", "a'b\\c\n\u00e9"),
        ("{ }", []),
        ("{1,2,a}", [1, 2, "a"]),
        ("{1, {2, 3}, }", [1, [2, 3]]),
        ("{ {first {value 8}}, {second {value dsd}} }", {"first": 8, "second": "dsd"}),
        ("{ {type {value x}}, {value {value {1}}} }", {"type": "x", "value": [1]}),
        ("{ Integer, default }", ["Integer", "default"]),
    ],
)
def test_value(text, value):
    assert values(text) == value
    assert type(values(text)) is type(value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Integer", ParameterType("Integer")),
        ("Integer default 7", ParameterType("Integer", default=7)),
        ("Integer {default 7}", ParameterType("Integer", default=7)),
        ("Base64", ParameterType("Base64")),
        ("List", ParameterType("List")),
        ("Array default {1}", ParameterType("Array", default=[1])),
        ("Struct", ParameterType("Struct")),
        ("Struct { default Integer }", ParameterType("Struct", members=(("default", ParameterType("Integer")),))),
        ("List {Integer, String}", ParameterType("List", (ParameterType("Integer"), ParameterType("String")))),
        ("Array {type Integer default {1,2}}", ParameterType("Array", (ParameterType("Integer"),), default=[1, 2])),
        (
            "Struc {first Integer default 7, type String}",
            ParameterType(
                "Struct", members=(("first", ParameterType("Integer", default=7)), ("type", ParameterType("String")))
            ),
        ),
    ],
)
def test_type(text, expected):
    assert declared(text) == expected


def test_parameter_may_have_a_namespace():
    system = parse_system("RosSystem { Name x Parameters { Parameter { name p NameSpace arm value 1 } } }")
    assert system.parameters == (SystemParameter("p", None, 1, "arm"),)


def test_namespace_may_be_written_in_parts():
    parameter = "Parameter { name p NameSpace GlobalNamespace { parts { a, b } } value 1 }"
    system = parse_system(f"RosSystem {{ Name x Parameters {{ {parameter} }} }}")
    assert system.parameters == (SystemParameter("p", None, 1, "/a/b"),)


def test_parameter_of_a_component_may_lack_its_name():
    text = "RosSystem { Name x RosComponents ( ComponentInterface { name a RosParameters { "
    text += "RosParameter { RefParameter 'p.a.n.r' } } } ) }"
    assert parse_system(text).components[0].parameters == (RosParameter("r", Reference("p", "a", "n", "r")),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.rossystem:1:1: expected 'RosSystem' near the end of the file"),
        ("RosSystem {\n  Name 'a'\n", "m.rossystem:2:11: expected"),
        ("RosSystem { Name 'a' ", "near the end of the file"),
        ("RosSystem {\n Name x Colour red }", "m.rossystem:2:9: expected 'ActionConnections' or "),
        ("RosSystem { Name x } RosSystem", "m.rossystem:1:22: expected the end of the file near 'RosSystem'"),
        (
            "RosSystem { Name 'x }",
            "m.rossystem:1:18: expected a name or value or a string near a string that is never closed",
        ),
        (
            "RosSystem { Name x } 'rest",
            "m.rossystem:1:22: expected the end of the file near a string that is never closed",
        ),
        (
            "RosSystem { Name 'x\n RosComponents ( ComponentInterface { name 'a' } ) }",
            "near 'a': the string before it begins in line 1, is its quote missing?",
        ),
        ("RosSystem { Name x /* }", "m.rossystem:1:20: this comment is never closed"),
        ("RosSystem { Name x\nName y }", "m.rossystem:2:1: second 'Name' in this RosSystem"),
        ("RosSystem { }", "m.rossystem:1:1: this RosSystem has no name"),
        (
            "RosSystem { Name x RosComponents ( ComponentInterface { } ) }",
            "m.rossystem:1:36: this ComponentInterface has no",
        ),
        ("RosSystem { Namex x }", "near 'Namex'"),
        ("RosSystem { Name x Parameters { Parameter { name p value 1e999 } } }", "too large for a double"),
        ("RosSystem { Name x Parameters { Parameter { name p value {1 2} } } }", "expected ',' or '{' or '}' near '2'"),
        ("RosSystem { Name x Parameters { Parameter { name p value { 1, {a {value 1}} } } } }", "are mixed here"),
        (
            "RosSystem { Name x Parameters { Parameter { name p value { {a {value 1}}, {a {value 2}} } } } }",
            "second member 'a'",
        ),
        (
            "RosSystem { Name x RosComponents ( ComponentInterface { name a FromRosNode 'a..b' } ) }",
            "m.rossystem:1:76: reference 'a..b' is not package.artifact.node",
        ),
        (
            "RosSystem { Name x RosComponents ( ComponentInterface { name a RosPublishers { RosSubscriber b",
            "expected 'RosPublisher' or '}' near 'RosSubscriber'",
        ),
        ("\x00\x01\x02", "m.rossystem:1:1: expected 'RosSystem'"),
        ("{" * 200_000, "m.rossystem:1:1: expected 'RosSystem'"),
        ("x" * 17_000_000, "m.rossystem:1:1: 17000000 characters are too many"),
    ],
)
def test_bad_text_is_refused_with_its_position(text, message):
    assert message in failure(text)


@pytest.mark.parametrize("opening", ["value {", "value { { a { value {", "type List {"])
def test_deep_nesting_is_refused(opening):
    repeated = "List { " if "List" in opening else "{ "
    text = f"RosSystem {{ Name x Parameters {{ Parameter {{ name p {opening} {repeated * 10_000}"
    assert f"deeper than {MAX_NESTING} levels" in failure(text)


def test_failed_file_leaves_no_trace_in_the_next():
    failure("// old\nRosSystem { Name x Parameters { Parameter { name p value " + "{ " * 50)
    nested = "{ " * 40 + "1" + " }" * 40
    assert parse_system(f"RosSystem {{ Name x Parameters {{ Parameter {{ name p value {nested} }} }} }}").header == ""


def test_file_that_is_not_text_is_refused_at_the_bad_byte(tmp_path):
    path = tmp_path / "latin.rossystem"
    path.write_bytes("RosSystem {\n Name 'caf\u00e9' }".encode("latin-1"))
    with pytest.raises(ModelError, match=r"latin\.rossystem:2:11: byte 0xe9 is not UTF-8"):
        read_system(path)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match="No such file"):
        read_system(tmp_path / "none.rossystem")


def test_byte_order_mark_and_carriage_returns_are_read(tmp_path):
    path = tmp_path / "windows.rossystem"
    path.write_bytes(b"\xef\xbb\xbf" + WHOLE.replace("\n", "\r\n").encode())
    assert read_system(path) == parse_system(WHOLE)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(WHOLE)), st.integers(0, 12), st.text("{}(),'\"/* \n\\ab1", max_size=4))
@example(0, 0, "\ufeff")
def test_damaged_text_is_read_or_refused(start, length, inserted):
    text = WHOLE[:start] + inserted + WHOLE[start + length :]
    try:
        parse_system(text)
    except ModelError as error:
        assert error.position is not None
        assert "\n" not in str(error)


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
def test_published_files_are_read_and_survive_a_round_trip():
    files = sorted(Path(CORPUS, "rossystem").glob("*.rossystem"))
    assert files
    for file in files:
        system = read_system(file)
        assert parse_system(write_system(system)) == system, file


def test_spellings_of_older_files_are_read():
    system = parse_system("""RosSystem { Name x
        Components { RosComponent a NameSpace left RosComponent b }
        TopicConnections { TopicConnection { From { 'a.x' } To { 'b.y' } } }
        ServiceConnections { ServiceConnection s { From 'a.s' To ( b/t ) } } }""")
    assert [component.graph_name for component in system.components] == ["left/a", "b"]
    assert system.connections[0].name == "x"
    assert system.connections[1].targets == (PortPath("b", "t"),)


def test_end_with_slashes_is_split_where_its_component_ends():
    text = """RosSystem { Name x RosComponents ( ComponentInterface { name move_base } )
        TopicConnections { TopicConnection goal { From ( /joy/goal ) To ( move_base//move_base_simple/goal ) } } }"""
    (connection,) = parse_system(text).connections
    assert connection.targets == (PortPath("move_base", "/move_base_simple/goal"),)
    assert connection.sources == (PortPath("", "/joy/goal"),)


def test_stacks_group_components():
    text = """RosSystem { Name x
        RosComponentStacks ( ComponentStack { name drive
            QualityAttributes { QualityAttribute safety { value 0.5 } }
            RosComponents ( ComponentInterface { name base } ) } )
        RosComponents ( ComponentInterface { name camera } ) }"""
    system = parse_system(text)
    assert [component.name for component in system.components] == ["camera", "base"]
    assert (system.stacks[0].name, system.stacks[0].components) == ("drive", ("base",))
    assert system.stacks[0].quality_attributes[0].value == 0.5
    assert parse_system(write_system(system)) == system


def test_section_may_stand_twice():
    text = """RosSystem { Name x RosComponents ( ComponentInterface { name a } )
        RosComponents ( ComponentInterface { name b
            RosPublishers { RosPublisher c { } } RosPublishers { RosPublisher d { } } } ) }"""
    system = parse_system(text)
    assert [component.name for component in system.components] == ["a", "b"]
    assert [port.name for port in system.components[1].ports] == ["c", "d"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("{ a {value 1}, {b {value 2}} }", {"a": 1, "b": 2}),
        ("{ {a {value 1}} {b {value 2}} }", {"a": 1, "b": 2}),
        ("{ a {value 1} }", {"a": 1}),
        ("{ { {a {value 1}} }, { {a {value 2}} } }", [{"a": 1}, {"a": 2}]),
        ("{ { {a {value 1}}, {b {value 2}} }, 3 }", [{"a": 1, "b": 2}, 3]),
        ("{ {1, 2} {3} }", [[1, 2], [3]]),
        ("ParameterStruct { value { ParameterStructMember a { value 1 } } }", {"a": 1}),
        ("ParameterStruct { }", {}),
        ("ParameterAny { value '5' }", "5"),
        ("-.5", -0.5),
        ("1.", 1.0),
        ("2.5E+3", 2500.0),
        ("0x1F", "0x1F"),
        ("<xml/>", "<xml/>"),
    ],
)
def test_value_in_a_lenient_form(text, value):
    assert values(text) == value
