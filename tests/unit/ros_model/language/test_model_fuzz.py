"""Any text is read or refused with a place: what the grammars generate, damaged models, hostile files."""

import os
import re
import tracemalloc
from pathlib import Path

import pytest
import ros_model.language.parser
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.lark import from_lark
from lark import Lark
from ros_model.checks.packages import check_packages
from ros_model.checks.systems import check_system
from ros_model.cli.rosmodel import main
from ros_model.errors import ModelError
from ros_model.io.drawing import dot
from ros_model.language.difference import differences
from ros_model.language.library import Library
from ros_model.language.metamodel import MAX_SIZE
from ros_model.language.packages import PackageSet
from ros_model.language.packages_reader import parse_packages
from ros_model.language.packages_writer import write_packages
from ros_model.language.system_reader import parse_system
from ros_model.language.system_writer import write_system

CORPUS = os.environ.get("MROS_CORPUS")
GRAMMARS = Path(ros_model.language.parser.__file__).parent / "grammar"
WORDS = ["a", "p.a.n.x", "move_base//goal", "~rate", "true", "-1", "2.5e3", "0b01", "2026-1-2T10:20:30"]
STRINGS = ["'a b'", '"x"', "'it\\'s'", "''", "'a.b'", "'{'"]
MARKS = [
    "{",
    "}",
    "(",
    ")",
    ",",
    "'",
    '"',
    "/*",
    "*/",
    "//",
    "\n",
    "=",
    "[",
    "]",
    "\0",
    "\ufeff",
    "\u2028",
    "RosSystem",
    "Node",
]


def grammatical(grammar, start):
    """Return a strategy of texts that a grammar derives; keywords and words end with a space, as they must."""
    text = "\n".join((GRAMMARS / name).read_text() for name in (grammar, "common.lark"))
    parser = Lark(text, start=start, parser="lalr")
    explicit = {
        name: st.sampled_from([f"{word} " for word in re.findall('"(.+?)"', words)])
        for name, words in re.findall(r"^(\w+)\.2: (.+) _END$", text, re.MULTILINE)
    }
    explicit |= {
        "WORD": st.sampled_from([word + " " for word in WORDS]),
        "FIELD_WORD": st.sampled_from(
            [f"{word} " for word in ["int8", "goal", "message", "type", "geometry_msgs/Pose"]]
        ),
        "CONSTANT": st.sampled_from(["1 ", "-2.5 ", "x "]),
        "STRING": st.sampled_from(STRINGS),
        "BRACKETS": st.sampled_from(["[]", "[36]"]),
        "COMMENT": st.sampled_from(["// a { comment\n", "/* 'another */"]),
        "__IGNORE_0": st.sampled_from([" ", "\n", "\t"]),
    }
    known = {terminal.name for terminal in parser.terminals}
    return from_lark(parser, start=start, explicit={name: explicit[name] for name in explicit.keys() & known})


def check(text, parse, write):
    """Read a text; a model that it is must survive writing, an error must have its place and be one line."""
    try:
        model = parse(text)
    except ModelError as error:
        for found in error.all:
            assert found.position is not None
            assert found.position.line >= 1 or text.count("\n") == 0
            assert "\n" not in str(found)
        return error
    assert parse(write(model)) == model
    assert differences(model, model) == ()
    if isinstance(model, PackageSet):
        check_packages(model, Library(model.packages))
    else:
        check_system(model, library=KNOWN)
        dot(model)
    return None


KNOWN = Library(
    parse_packages("""PackageSet { CatkinPackage p { Artifact a { Node { name n
        Publishers { Publisher { name x message 'std_msgs.String' } }
        Parameters { Parameter { name x type Double } } } } } }""").packages
)
SLOW = settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)


@SLOW
@given(grammatical("rossystem.lark", "system"))
def test_what_the_grammar_of_systems_derives_is_read(text):
    error = check(text, parse_system, write_system)
    assert error is None or not any(found.message.startswith("expected") for found in error.all), text


@SLOW
@given(grammatical("ros.lark", "package_set"))
def test_what_the_grammar_of_packages_derives_is_read(text):
    error = check(text, parse_packages, write_packages)
    assert error is None or not any(found.message.startswith("expected") for found in error.all), text


def damaged(text):
    """Return a strategy of a text with some pieces cut, doubled, moved or put in."""
    place = st.integers(0, len(text))
    edit = st.tuples(place, st.integers(0, 40), st.sampled_from(["cut", "double", "put"]), st.sampled_from(MARKS))
    return st.lists(edit, min_size=1, max_size=4).map(lambda edits: _edited(text, edits))


def _edited(text, edits):
    for start, length, what, mark in edits:
        piece = {"cut": "", "double": text[start : start + length] * 2, "put": mark}[what]
        text = text[:start] + piece + text[start + length :]
    return text


OWN = """// A robot.
RosSystem { Name robot RosComponents (
    ComponentInterface { name arm NameSpace left FromRosNode 'arm.arm_node.arm'
        RosPublishers { RosPublisher joints { ns left RefPublisher 'arm.arm_node.arm.joints' }, RosPublisher { } }
        RosParameters { RosParameter rate { RefParameter 'arm.arm_node.arm.rate' value { 1, { {a {value 1}} } } } } } )
    TopicConnections { TopicConnection joints { From ( 'arm.joints' ) To ( planner/joints ) } }
    Parameters { Parameter { name limits type Struct { x Double default 1.5, y List { Integer } }
        value { {x {value 2}} } } } }
"""
OWN_PACKAGES = """PackageSet { package { CatkinPackage arm {
    spec { TopicSpec T { message { float64[36] x int8 OK=1 } } }
    artifact { Artifact arm_node { node Node { name arm
        publisher { Publisher { name joints message 'a.JointState' namespace GlobalNamespace { parts { a } } } }
        parameter { Parameter { name rate type Double { default 1.0 } } } } } }
    dependency { ExternalDependency eigen } } } }
"""


@SLOW
@given(damaged(OWN))
def test_damaged_system_is_read_or_refused(text):
    check(text, parse_system, write_system)


@SLOW
@given(damaged(OWN_PACKAGES))
def test_damaged_packages_are_read_or_refused(text):
    check(text, parse_packages, write_packages)


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
@SLOW
@given(st.data())
def test_damaged_published_files_are_read_or_refused(data):
    files = [path for path in sorted(Path(CORPUS).rglob("*.ros*")) if path.stat().st_size < 8000]
    path = data.draw(st.sampled_from(files))
    text = data.draw(damaged(path.read_text()))
    check(text, *((parse_packages, write_packages) if path.suffix == ".ros" else (parse_system, write_system)))


@SLOW
@given(st.text(st.sampled_from([*"{}(),'\"/*=[] \n\\", *"ab1.-\0\ufeff\u00a0"]), max_size=60))
def test_any_text_is_refused_in_both_languages(text):
    assert check(text, parse_system, write_system) is not None
    assert check(text, parse_packages, write_packages) is not None


IN_SYSTEM = "RosSystem { Name x Parameters { Parameter { name p "
IN_PACKAGES = "PackageSet { CatkinPackage p { Artifact a { Node { name n Parameters { Parameter { name p "


@pytest.mark.parametrize(("parse", "start"), [(parse_system, IN_SYSTEM), (parse_packages, IN_PACKAGES)])
@pytest.mark.parametrize(
    "repeated",
    [
        "value { ",
        "value { {a {value ",
        "type List { ",
        "type Struct { a Struct { a ",
        "type Array { type Array { type ",
    ],
)
def test_ten_thousand_levels_are_refused(parse, start, repeated):
    word, nested = repeated.split(" ", 1)
    with pytest.raises(ModelError) as caught:
        parse(f"{start}{word} " + nested * 10_000, "deep")
    assert caught.value.position.file == "deep"
    assert "deeper than 64 levels" in str(caught.value)


@pytest.mark.parametrize("parse", [parse_system, parse_packages])
@pytest.mark.parametrize(
    "text",
    [
        "{" * 200_000,
        "RosSystem {" * 50_000,
        "PackageSet {" * 50_000,
        "(" * 9 + "}" * 100_000,
        "'" * 199_999,
        "/*" * 99_999,
    ],
)
def test_brackets_without_end_are_refused(parse, text):
    with pytest.raises(ModelError) as caught:
        parse(text, "hostile")
    assert caught.value.position.line == 1


@pytest.fixture
def refused(capsys, tmp_path):
    def run(path):
        for command in ("check", "format", "show"):
            with pytest.raises(SystemExit) as done:
                main([command, str(path)])
            out, err = capsys.readouterr()
            assert done.value.code == 2
            assert "Traceback" not in out + err
            assert len(out + err) < 2000
        return err

    return run


@pytest.mark.parametrize("name", ["m.ros", "m.rossystem"])
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", ":1:1: expected '"),
        (b"  \n\n", ":1:1: expected '"),
        (bytes(range(256)), ":2:118: byte 0x80 is not UTF-8"),
        (b"\x00\x01\x02\x03", ":1:1: expected '"),
        (b"{" * 50_000_000, f":1:1: 50000000 bytes are too many ({MAX_SIZE})"),
        ("RosSystem { }".encode("utf-16"), ":1:1: byte 0xff is not UTF-8: it looks like UTF-16"),
        ("// \u00e9\nRosSystem { Name 'caf\u00e9' }".encode("latin-1"), ":1:4: byte 0xe9 is not UTF-8"),
    ],
    ids=["empty", "blank", "bytes", "binary", "brackets", "utf-16", "latin-1"],
)
def test_bad_file_is_refused_at_its_place(refused, tmp_path, name, content, expected):
    path = tmp_path / name
    path.write_bytes(content)
    assert f"{path}{expected}" in refused(path)


def test_what_is_no_regular_file_is_refused(refused, tmp_path):
    pipe = tmp_path / "pipe.ros"
    os.mkfifo(pipe)
    assert "is no regular file" in refused(pipe)
    assert "is no regular file" in refused("/dev/zero")


def test_reference_out_of_the_workspace_touches_no_file(capsys, tmp_path):
    path = tmp_path / "m.rossystem"
    path.write_text(
        "RosSystem { Name x RosComponents ( ComponentInterface { name a FromRosNode '../../etc.passwd.x' }"
        " ComponentInterface { name b FromRosNode '/etc/passwd.a.n' } ) }"
    )
    with pytest.raises(SystemExit) as done:
        main(["check", str(path)])
    assert done.value.code == 2
    assert f"{path}:1:76: error: reference '../../etc.passwd.x' is not package.artifact.node" in capsys.readouterr().out


def test_memory_is_linear_in_the_file():
    def peak(count):
        port = "RosPublisher 'p{0}' {{ RefPublisher 'p.a.n.p{0}' }}"
        text = "RosSystem { Name x RosComponents ( ComponentInterface { name a RosPublishers { "
        text += ", ".join(port.format(number) for number in range(count)) + " } } ) }"
        parse_system(text)
        tracemalloc.start()
        parse_system(text)
        _, highest = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return highest

    assert peak(2000) < 2.5 * peak(1000)
