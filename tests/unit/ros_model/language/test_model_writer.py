"""The writer: what is written reads back as an equal model."""

import math
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ros_model.errors import ModelError
from ros_model.language.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    ParameterType,
    Port,
    PortKind,
    PortPath,
    Reference,
    RosParameter,
    RosSystem,
    SystemParameter,
)
from ros_model.language.system_reader import parse_system
from ros_model.language.system_writer import write_system

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NAME = st.one_of(
    st.from_regex(r"[a-z_/.-]{1,8}", fullmatch=True),
    TEXT,
    st.sampled_from(["name", "value", "type", "}", "ParameterStruct", "PrivateNamespace", "default"]),
)
PART = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="."), min_size=1, max_size=6)
VALUE = st.recursive(
    st.one_of(st.booleans(), st.integers(-(10**20), 10**20), st.floats(allow_nan=False, allow_infinity=False), TEXT),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(NAME, inner, max_size=3)),
    max_leaves=5,
)
DEFAULT = st.none() | VALUE


def without_default(declared):
    return replace(declared, default=None)


TYPE = st.recursive(
    st.builds(ParameterType, st.sampled_from(["Integer", "Double", "String", "Boolean", "Base64"]), default=DEFAULT),
    lambda inner: st.one_of(
        st.builds(ParameterType, st.just("List"), st.lists(inner, max_size=3).map(tuple), default=DEFAULT),
        st.builds(ParameterType, st.just("Array"), st.tuples(inner.map(without_default)), default=DEFAULT),
        st.builds(
            ParameterType,
            st.just("Struct"),
            members=st.lists(st.tuples(NAME, inner), max_size=3).map(tuple),
            default=DEFAULT,
        ),
    ),
    max_leaves=4,
)
REFERENCE = st.builds(Reference, PART, PART, PART, TEXT)
OPTIONAL = st.none() | NAME
PORTS = st.lists(st.builds(Port, NAME, st.sampled_from(PortKind), st.none() | REFERENCE, OPTIONAL), max_size=4)
COMPONENT = st.builds(
    Component,
    NAME,
    st.none() | REFERENCE,
    OPTIONAL,
    PORTS.map(lambda ports: tuple(sorted(ports, key=lambda port: list(PortKind).index(port.kind)))),
    st.lists(st.builds(RosParameter, NAME, st.none() | REFERENCE, st.none() | VALUE, OPTIONAL), max_size=3).map(tuple),
)
ENDS = st.lists(st.builds(PortPath, PART, TEXT), max_size=3).map(tuple)
CONNECTIONS = st.lists(st.builds(Connection, NAME, st.sampled_from(ConnectionKind), ENDS, ENDS), max_size=4)
SYSTEM = st.builds(
    RosSystem,
    NAME,
    st.lists(COMPONENT, max_size=3).map(tuple),
    CONNECTIONS.map(lambda found: tuple(sorted(found, key=lambda c: list(ConnectionKind).index(c.kind)))),
    st.lists(st.builds(SystemParameter, NAME, st.none() | TYPE, st.none() | VALUE, OPTIONAL), max_size=3).map(tuple),
    st.lists(st.from_regex(r"([a-z*/'{ ]{0,9}[a-z])?", fullmatch=True), max_size=3).map("\n".join),
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(SYSTEM)
def test_what_is_written_reads_back_equal(system):
    text = write_system(system)
    again = parse_system(text)
    assert again == system
    assert write_system(again) == text  # tells 1 from true and 1.0, which compare equal


def test_form_is_that_of_the_grammar():
    system = RosSystem(
        "x",
        components=(Component("a", Reference("p", "a", "n")),),
        connections=(
            Connection("t", ConnectionKind.TOPIC, (PortPath("a", "t"),), (PortPath("b", "t"),)),
            Connection("s", ConnectionKind.SERVICE, (PortPath("a", "s"),), (PortPath("b", "s"),)),
            Connection("m", ConnectionKind.ACTION, (PortPath("a", "m"),), (PortPath("b", "m"),)),
        ),
        header="By hand.",
    )
    assert write_system(system) == (
        "// By hand.\n"
        "RosSystem {\n"
        "    Name 'x'\n"
        "    RosComponents (\n"
        "        ComponentInterface {\n"
        "            name a\n"
        "            FromRosNode 'p.a.n'\n"
        "        }\n"
        "    )\n"
        "    TopicConnections {\n"
        "        TopicConnection 't' { From ( 'a.t' ) To ( 'b.t' ) }\n"
        "    }\n"
        "    ServiceConnections {\n"
        "        ServiceConnection 's' { From ( 'a.s' ) To 'b.s' }\n"
        "    }\n"
        "    ActionConnections {\n"
        "        ActionConnection 'm' { From 'a.m' To 'b.m' }\n"
        "    }\n"
        "}\n"
    )


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_value_without_a_notation_is_refused(value):
    with pytest.raises(ModelError, match="has no notation"):
        write_system(RosSystem("x", parameters=(SystemParameter("p", None, value),)))
