"""`.ros` files: both brace dialects are read, one form is written, what is written reads back equal."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ros_model.errors import ModelError
from ros_model.io.models import read_packages
from ros_model.language.metamodel import ParameterType, PortKind
from ros_model.language.packages import (
    Artifact,
    MessageField,
    Node,
    Package,
    PackageSet,
    ParameterDeclaration,
    PortDeclaration,
    Spec,
    SpecKind,
    is_unknown,
)
from ros_model.language.packages_reader import parse_packages
from ros_model.language.packages_writer import write_packages
from ros_model.project.tables import typed_cell

CORPUS = os.environ.get("MROS_CORPUS")

NEW = """// An arm.
PackageSet {
    CatkinPackage arm_driver {
        FromGitRepo "https://example.org/arm.git"
        Specs { TopicSpec Torque { message { float64 value } } }
        Artifact arm_node {
            Node { name arm
                ServiceServers { ServiceServer { name 'reset' service 'std_srvs.Trigger' } }
                Publishers {
                    Publisher { name '/joint_states' message 'sensor_msgs.JointState' },
                    Publisher { name 'torque' message 'arm_driver.Torque' namespace RelativeNamespace { } } }
                Subscribers { Subscriber { name 'command' message "trajectory_msgs/JointTrajectory" } }
                ServiceClients { ServiceClient { name 'calibrate' service 'std_srvs.Empty' } }
                ActionServers { ActionServer { name 'move' action 'control_msgs.FollowJointTrajectory' } }
                ActionClients { ActionClient { name 'grip' action 'control_msgs.GripperCommand' } }
                Parameters {
                    Parameter { name 'rate' type Double default 50.0 },
                    Parameter { name 'joints' type List { String, String } }
                } } },
        Artifact tool
        { }
        Dependencies { PackageDependency 'roscpp', ExternalDependency 'eigen' }
    }
}
"""
OLD = """/* An arm. */
PackageSet { package {
    CatkinPackage arm_driver {
        artifact {
            Artifact arm_node { node Node { name arm
                actionclient { ActionClient { name 'grip' action 'control_msgs.GripperCommand' } }
                actionserver { ActionServer { name 'move' action 'control_msgs.FollowJointTrajectory' } }
                publisher {
                    Publisher { name '/joint_states' message 'sensor_msgs.JointState' }
                    Publisher { name torque namespace RelativeNamespace { } message arm_driver.Torque }, }
                subscriber { Subscriber { message 'trajectory_msgs/JointTrajectory' name command } }
                serviceclient { ServiceClient { name calibrate service 'std_srvs.Empty' } }
                serviceserver { ServiceServer { name reset service 'std_srvs.Trigger' } }
                parameter {
                    Parameter { name rate type Double { default 50.0 } }
                    Parameter { name joints type List { sequence { String { }, String { } } } }
                } } },
            Artifact tool { }
        }
        spec { TopicSpec Torque { message { float64 value } } }
        dependency { PackageDependency { package roscpp } ExternalDependency eigen }
        fromGitRepo 'https://example.org/arm.git'
    } } }
"""


def fields(text):
    spec = parse_packages(f"PackageSet {{ Package p {{ Specs {{ TopicSpec T {{ message {{ {text} }} }} }} }} }}")
    return [(f.type, f.name, f.constant) for f in spec.packages[0].specs[0].parts[0][1]]


def node(inside):
    return parse_packages(f"PackageSet {{ CatkinPackage p {{ Artifact a {{ Node {{ name n {inside} }} }} }} }}").node(
        "p", "a", "n"
    )


def failure(text):
    with pytest.raises(ModelError) as caught:
        parse_packages(text, "m.ros")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_both_dialects_say_the_same():
    assert parse_packages(NEW) == parse_packages(OLD)


def test_everything_is_read():
    packages = parse_packages(NEW)
    assert packages.header == "An arm."
    (package,) = packages.packages
    assert (package.name, package.catkin, package.repository) == ("arm_driver", True, "https://example.org/arm.git")
    assert (package.dependencies, package.external_dependencies) == (("roscpp",), ("eigen",))
    assert [artifact.name for artifact in package.artifacts] == ["arm_node", "tool"]
    arm = packages.node("arm_driver", "arm_node", "arm")
    assert [(port.kind, port.name, port.type) for port in arm.ports] == [
        (PortKind.PUBLISHER, "/joint_states", "sensor_msgs/JointState"),
        (PortKind.PUBLISHER, "torque", "arm_driver/Torque"),
        (PortKind.SUBSCRIBER, "command", "trajectory_msgs/JointTrajectory"),
        (PortKind.SERVICE_SERVER, "reset", "std_srvs/Trigger"),
        (PortKind.SERVICE_CLIENT, "calibrate", "std_srvs/Empty"),
        (PortKind.ACTION_SERVER, "move", "control_msgs/FollowJointTrajectory"),
        (PortKind.ACTION_CLIENT, "grip", "control_msgs/GripperCommand"),
    ]
    assert arm.parameters[0] == ParameterDeclaration("rate", ParameterType("Double", default=50.0))


def test_positions_are_those_of_the_opening_words():
    package = parse_packages(NEW, "arm.ros").packages[0]
    found = [package, package.artifacts[0], package.artifacts[0].nodes[0], package.artifacts[0].nodes[0].ports[0]]
    assert [str(element.position) for element in found] == [
        "arm.ros:3:5",
        "arm.ros:6:9",
        "arm.ros:7:13",
        "arm.ros:10:21",
    ]
    assert str(package.specs[0].parts[0][1][0].position) == "arm.ros:5:46"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", []),
        ("float32[] data", [("float32[]", "data", None)]),
        ("float64[36] covariance", [("float64[36]", "covariance", None)]),
        ("float64 [ 3 ] x", [("float64[3]", "x", None)]),
        ("Header header time stamp", [("Header", "header", None), ("time", "stamp", None)]),
        ("'geometry_msgs/Pose'[] poses", [("geometry_msgs/Pose[]", "poses", None)]),
        ('"geometry_msgs.Pose" pose', [("geometry_msgs/Pose", "pose", None)]),
        ("geometry_msgs/msg/Pose pose", [("geometry_msgs/Pose", "pose", None)]),
        (
            "string message Goal goal duration type",
            [("string", "message", None), ("Goal", "goal", None), ("duration", "type", None)],
        ),
        ("int8 OK=1 int8 BAD=-2", [("int8", "OK", "1"), ("int8", "BAD", "-2")]),
        ("int8 OK = 1", [("int8", "OK", "1")]),
        ("int8 'OK'=1", [("int8", "OK", "1")]),
        ("string NAME='a b'", [("string", "NAME", "a b")]),
        ("float32 PI=3.14e0, bool b", [("float32", "PI", "3.14e0"), ("bool", "b", None)]),
        ("byte message // why\nbyte[] 'name'", [("byte", "message", None), ("byte[]", "name", None)]),
    ],
)
def test_fields_of_a_message(text, expected):
    assert fields(text) == expected


def test_services_and_actions_have_their_parts_in_order():
    package = parse_packages("""PackageSet { Package p { Specs {
        ServiceSpec S { response { bool ok } request { } },
        ActionSpec A { feedback { float32 done } goal { string goal } },
        ActionSpec Opaque { } TopicSpec Header { message { uint32 seq } } } } }""").packages[0]
    assert package.specs == (
        Spec("S", SpecKind.SERVICE, (("request", ()), ("response", (MessageField("bool", "ok"),)))),
        Spec(
            "A",
            SpecKind.ACTION,
            (("goal", (MessageField("string", "goal"),)), ("feedback", (MessageField("float32", "done"),))),
        ),
        Spec("Opaque", SpecKind.ACTION),
        Spec("Header", SpecKind.TOPIC, (("message", (MessageField("uint32", "seq"),)),)),
    )
    assert not package.catkin


@pytest.mark.parametrize(
    ("text", "namespace"),
    [
        ("GlobalNamespace { parts { robot, arm } }", "/robot/arm"),
        ("GlobalNamespace { }", "/"),
        ("RelativeNamespace { parts { arm } }", "arm"),
        ("PrivateNamespace { }", "~"),
        ("PrivateNamespace { parts { 'arm' } }", "~arm"),
        ("arm", "arm"),
    ],
)
def test_namespace(text, namespace):
    port = node(f"Publishers {{ Publisher {{ name x message 'a.B' namespace {text} }} }}").ports[0]
    assert port.namespace == namespace


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Integer { }", ParameterType("Integer")),
        ("Double { default -1.5e3 }", ParameterType("Double", default=-1500.0)),
        ("Date default 2020-1-2T10:00:00", ParameterType("Date", default="2020-1-2T10:00:00")),
        (
            "Array { type Integer { } default { 1, 2 } }",
            ParameterType("Array", (ParameterType("Integer"),), default=[1, 2]),
        ),
        (
            "List { sequence { Integer { }, String { } } default { 1, a } }",
            ParameterType("List", (ParameterType("Integer"), ParameterType("String")), default=[1, "a"]),
        ),
        (
            "Struct { parameterstructypetmember { ParameterStructTypeMember x { type Integer { } default 3 } } }",
            ParameterType("Struct", members=(("x", ParameterType("Integer", default=3)),)),
        ),
        (
            "Struct { x Integer } default ParameterStruct { value { ParameterStructMember x { value 1 } } }",
            ParameterType("Struct", members=(("x", ParameterType("Integer")),), default={"x": 1}),
        ),
        ("Any default ParameterAny { value 'x' }", ParameterType("Any", default="x")),
    ],
)
def test_type_of_a_parameter(text, expected):
    assert node(f"Parameters {{ Parameter {{ name p type {text} }} }}").parameters[0].type == expected


def test_names_may_be_keywords():
    packages = parse_packages(
        "PackageSet { CatkinPackage package { Artifact node { node Node { name node publisher {"
        " Publisher { name name message 'message.message' } } } } } }"
    )
    assert packages.node("package", "node", "node").ports[0].name == "name"
    assert parse_packages(write_packages(packages)) == packages


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.ros:1:1: expected 'PackageSet' near the end of the file"),
        ("PackageSet {", "m.ros:1:13: expected 'CatkinPackage' or 'Package' or '}' near the end of the file"),
        ("PackageSet { CatkinPackage a {\n Artefact b { } } }", "m.ros:2:2: expected 'Artifact' or "),
        ("PackageSet { CatkinPackage a {\n Artefact b { } } }", "near 'Artefact': did you mean 'Artifact'?"),
        (
            "PackageSet { Package p { Specs { TopicSpec T { message { int8 } } } } }",
            "expected '[]' or a string or a type or name near '}'",
        ),
        (
            "PackageSet { Package p { Specs { TopicSpec T { message { } message { } } } } }",
            "second 'message' in this TopicSpec",
        ),
        (
            "PackageSet { Package p { Specs { TopicSpec T { request { } } } } }",
            "expected 'message' or '}' near 'request'",
        ),
        ("PackageSet { CatkinPackage p { Artifact a { Node { } } } }", "m.ros:1:45: this Node has no name"),
        ("RosSystem { }", "m.ros:1:1: expected 'PackageSet' near 'RosSystem'"),
    ],
)
def test_bad_text_is_refused_with_its_position(text, message):
    assert message in failure(text)


def test_canonical_form():
    assert (
        write_packages(parse_packages(OLD))
        == """// An arm.
PackageSet {
    CatkinPackage arm_driver {
        FromGitRepo 'https://example.org/arm.git'
        Specs {
            TopicSpec Torque { message { float64 value } }
        }
        Artifact arm_node {
            Node {
                name arm
                ServiceServers {
                    ServiceServer { name 'reset' service 'std_srvs.Trigger' }
                }
                Publishers {
                    Publisher { name '/joint_states' message 'sensor_msgs.JointState' },
                    Publisher { name 'torque' message 'arm_driver.Torque' namespace RelativeNamespace { } }
                }
                Subscribers {
                    Subscriber { name 'command' message 'trajectory_msgs.JointTrajectory' }
                }
                ServiceClients {
                    ServiceClient { name 'calibrate' service 'std_srvs.Empty' }
                }
                ActionServers {
                    ActionServer { name 'move' action 'control_msgs.FollowJointTrajectory' }
                }
                ActionClients {
                    ActionClient { name 'grip' action 'control_msgs.GripperCommand' }
                }
                Parameters {
                    Parameter { name 'rate' type Double default 50.0 },
                    Parameter { name 'joints' type List { String, String } }
                }
            }
        },
        Artifact tool {
        }
        Dependencies {
            PackageDependency 'roscpp',
            ExternalDependency 'eigen'
        }
    }
}
"""
    )


TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
NAME = st.one_of(st.from_regex(r"[a-z_/.-]{1,8}", fullmatch=True), TEXT, st.sampled_from(["node", "goal", "}", "="]))
WORD = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,5}", fullmatch=True)
TYPE_NAME = st.builds("{}/{}".format, WORD, WORD)
FIELD_TYPE = st.builds("{}{}".format, WORD | TYPE_NAME, st.sampled_from(["", "[]", "[36]"]))
FIELDS = st.lists(st.builds(MessageField, FIELD_TYPE, NAME, st.none() | TEXT), max_size=3).map(tuple)
NAMESPACE = st.none() | st.builds(
    lambda mark, parts: mark + "/".join(parts), st.sampled_from(["", "/", "~"]), st.lists(WORD, max_size=2)
)
NODES = st.lists(
    st.builds(
        Node,
        NAME,
        st.lists(
            st.builds(PortDeclaration, NAME, st.sampled_from(PortKind), st.just("") | TYPE_NAME, NAMESPACE), max_size=4
        ).map(lambda ports: tuple(sorted(ports, key=lambda port: list(PortKind).index(port.kind)))),
        st.lists(
            st.builds(
                ParameterDeclaration,
                NAME,
                st.none() | st.builds(ParameterType, st.sampled_from(["Integer", "String"]), default=st.none() | TEXT),
                st.none() | st.integers() | TEXT,
                NAMESPACE,
            ),
            max_size=2,
        ).map(tuple),
    ),
    max_size=2,
).map(tuple)
SPECS = st.lists(
    st.one_of(
        st.builds(lambda name, part: Spec(name, SpecKind.TOPIC, (("message", part),)), NAME, FIELDS),
        st.builds(
            lambda name, a, b: Spec(name, SpecKind.SERVICE, (("request", a), ("response", b))), NAME, FIELDS, FIELDS
        ),
        st.builds(Spec, NAME, st.just(SpecKind.ACTION)),
    ),
    max_size=3,
).map(tuple)
PACKAGE = st.builds(
    Package,
    NAME,
    st.lists(st.builds(Artifact, NAME, NODES), max_size=2).map(tuple),
    SPECS,
    st.lists(NAME, max_size=2).map(tuple),
    st.booleans(),
    st.lists(NAME, max_size=2).map(tuple),
    st.none() | TEXT,
)
PACKAGES = st.builds(PackageSet, st.lists(PACKAGE, max_size=2).map(tuple))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(PACKAGES)
def test_what_is_written_reads_back_equal(packages):
    text = write_packages(packages)
    again = parse_packages(text)
    assert again == packages
    assert write_packages(again) == text


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.sampled_from([NEW, OLD]),
    st.integers(0, len(OLD)),
    st.integers(0, 12),
    st.text("{}(),'\"/* \n\\ab1=[]", max_size=4),
)
def test_damaged_text_is_read_or_refused(text, start, length, inserted):
    try:
        parse_packages(text[:start] + inserted + text[start + length :])
    except ModelError as error:
        assert all(found.position is not None for found in error.all)


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
def test_published_files_are_read_and_survive_a_round_trip():
    files = sorted(Path(CORPUS, "ros").glob("*.ros"))
    assert files
    for file in files:
        packages = read_packages(file)
        assert parse_packages(write_packages(packages)) == packages, file
        assert sum(len(n.ports) for p in packages.packages for a in p.artifacts for n in a.nodes) == len(
            re.findall(
                r"\b(Publisher|Subscriber|ServiceServer|ServiceClient|ActionServer|ActionClient)\s*\{", file.read_text()
            )
        )


@pytest.mark.parametrize(
    "written", ["std_msgs.String", "std_msgs/String", "/*x.y", "String", "a b/c", "a/", "/a", "a/b/c"]
)
def test_name_of_a_type_is_written_as_it_was_read(written):
    publisher = f"Publishers {{ Publisher {{ name x message '{written}' }} }}"
    packages = parse_packages(f"PackageSet {{ Package p {{ Artifact a {{ Node {{ name n {publisher} }} }} }} }}")
    assert parse_packages(write_packages(packages)) == packages


@pytest.mark.parametrize(
    ("name", "unknown"),
    [
        ("{topic}@src/n.cpp:3", True),
        ("a/{x}/b{y} @n.py:12", True),
        ("plain", False),
        ("{x}@:3", False),
        ("{x}@n.py", False),
        ("}{@n:1", False),
        ("{x\n}@n:1", False),
        ("first\n{x}@n:1", True),
    ],
)
def test_name_that_the_source_does_not_tell_is_known(name, unknown):
    assert is_unknown(name) is unknown


def test_texts_that_match_almost_take_no_time():
    before = time.process_time()
    assert not is_unknown("{" * 20_000 + "}" * 20_000 + "@" * 20_000)
    assert typed_cell("1" * 99_999 + "x") == "1" * 99_999 + "x"
    parse_packages(f"PackageSet {{ CatkinPackage {'1' * 200_000}x {{ }} }}", "p.ros")
    assert time.process_time() - before < 5


@pytest.mark.parametrize("text", ["'" + "\\n" * 500_000 + "'", "'" + "x" * 1_000_000 + "'", "y" * 1_000_000])
def test_long_text_is_read_without_much_memory(text):
    code = (
        "import resource, sys; from ros_model.language.packages_reader import parse_packages as parse;"
        "used = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; text = sys.stdin.read();"
        "parse('PackageSet { CatkinPackage a { } }', 'a.ros'); before = used(); parse(text, 'a.ros');"
        "print(used() - before)"
    )
    model = f"PackageSet {{ CatkinPackage {text} {{ }} }}"
    done = subprocess.run([sys.executable, "-c", code], input=model, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 30_000  # kB
