"""What launch files hold that no reader takes, and what they may hold."""

import itertools
import math
import time

import pytest
from node_kit.yaml_text import MAX_VALUES
from ros_model.errors import ModelError
from ros_model.io.launch_files import NotRun, load, wrong_parameters

LEVELS = "abcdefg"
BOMB = "a: &a [1,1,1,1,1,1,1,1,1,1]\n" + "\n".join(
    f"{name}: &{name} [{','.join([f'*{before}'] * 10)}]" for before, name in itertools.pairwise(LEVELS)
)
DEEP = "a: &a [1]\n" + "\n".join(f"b{i}: &b{i} [*{'a' if i == 0 else f'b{i - 1}'}]" for i in range(2000))
MERGED = "a: &a {x: 1}\n" + "\n".join(
    f"{name}: &{name} {{<<: [{','.join([f'*{before}'] * 10)}]}}" for before, name in itertools.pairwise(LEVELS)
)


@pytest.fixture
def read(tmp_path):
    """Read a launch file of this body."""

    def read(body):
        path = tmp_path / "robot.launch"
        content = body if isinstance(body, bytes) else f"<launch>{body}</launch>".encode()
        path.write_bytes(content)
        return {name: parameter.value for name, parameter in load(path).params.items()}

    return read


@pytest.fixture
def refusal(read, tmp_path):
    """Tell why a launch file of this body is refused, without its name."""

    def refusal(body):
        with pytest.raises(ModelError) as error:
            read(body)
        text = str(error.value)
        assert "\\n" not in text and text.startswith(f"{tmp_path}/")
        return text.removeprefix(f"{tmp_path}/robot.launch: ")

    return refusal


def escaped(text):
    return text.replace("&", "&amp;").replace("<", "&lt;")


@pytest.mark.parametrize("form", ["<rosparam>{}</rosparam>", '<group ns="q"><rosparam ns="p">{}</rosparam></group>'])
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a [*a]", "an alias stands within what it repeats: take it out"),
        ("a: &a {b: *a}", "an alias stands within what it repeats: take it out"),
        ("&a {b: *a}", "an alias stands within what it repeats: take it out"),
        (BOMB, f"there are more than {MAX_VALUES} values: correct the aliases"),
        (MERGED, f"there are more than {MAX_VALUES} values: correct the aliases"),
        (DEEP, "values are nested deeper than 64 levels: correct them"),
        (f"a: {'[' * 2000}", "nested too deep: correct the YAML"),
    ],
    ids=["list", "mapping", "whole", "bomb", "merged", "deep", "open"],
)
def test_values_without_end_are_refused_with_the_parameter(refusal, form, text, words):
    before = time.process_time()
    told = refusal(form.format(escaped(text)))
    assert words in told and "of its YAML: parameter /" in told
    assert time.process_time() - before < 5


@pytest.mark.parametrize("text", ["&a {b: *a}", "&a [*a]", "{1: 2}", "!odd 3", "[1"])
def test_values_of_a_parameter_are_refused_with_its_name(refusal, tmp_path, text):
    told = refusal(f'<param name="limits" type="yaml" value="{escaped(text)}"/>')
    assert told.startswith('<param name="limits" type="yaml" value="')
    assert "line 1 of its YAML: parameter limits" in told and ": " in told
    file = tmp_path / "limits.yaml"
    file.write_text(text)
    assert f"{file}:1:" in refusal(f'<param name="limits" type="yaml" textfile="{file}"/>')


def test_private_parameter_is_counted_for_each_node(refusal):
    values = ",".join(["1"] * 3000)
    nodes = "".join(f'<node name="n{i}" pkg="a" type="b"/>' for i in range(100))
    told = refusal(f'<param name="~p" type="yaml" value="[{values}]"/>{nodes}')
    assert f"/p hold more than {MAX_VALUES} values: take some out" in told


@pytest.mark.parametrize(
    ("key", "kind"), [("1", "int"), ("1.5", "float"), ("on", "bool"), ("2001-01-01", "timestamp"), ("~", "null")]
)
@pytest.mark.parametrize("form", ["{}: 2", "a: {{{}: 2}}", "a: [{{{}: 2}}]"])
def test_key_that_is_no_text_is_named(refusal, key, kind, form):
    told = refusal(f"<rosparam>{form.format(key)}</rosparam>")
    assert f"key {key} is no text, but of the type {kind}: put it in quotes" in told


@pytest.mark.parametrize("attribute", ["textfile", "binfile"])
@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("/dev/zero", "/dev/zero: is no regular file: give the path of one"),
        ("/dev", "/dev: Is a directory: check the path"),
        ("/no/such", "/no/such: No such file or directory: check the path"),
    ],
)
def test_file_that_can_not_be_a_value_is_named_with_the_parameter(refusal, attribute, file, words):
    assert refusal(f'<param name="p" {attribute}="{file}"/>') == f'<param name="p" {attribute}="{file}">: {words}'


@pytest.mark.parametrize("form", ['<rosparam file="{}"/>', '<param name="p" type="yaml" textfile="{}"/>'])
def test_large_file_of_parameters_is_refused_before_it_is_parsed(refusal, tmp_path, form):
    file = tmp_path / "large.yaml"
    file.write_text(f"a: [{'1,' * 700_000}]")
    before = time.process_time()
    told = refusal(form.format(file))
    assert f"{file}:1:1: 140" in told and "are too many" in told
    assert time.process_time() - before < 5
    assert f"{file}:1:1: " in wrong_parameters(file)


def test_ordinary_files_and_values_are_read_as_before(read, tmp_path):
    file = tmp_path / "some.yaml"
    file.write_text("base: &base {x: 1}\nmore: {<<: *base, y: !degrees 180}\nrows: [" + "1.5, " * 20_000 + "]\n")
    values = read(
        f'<rosparam file="{file}"/><param name="text" textfile="{file}"/><param name="raw" binfile="{file}"/>'
        '<param name="yaml" type="yaml" value="{a: [1, {b: c}]}"/>'
        '<rosparam subst_value="true">e: $(optenv NONE 2)</rosparam>'
        '<rosparam param="empty"/><param name="program" command="echo \'a b\'"/>'
    )
    assert (values["/base/x"], values["/more/x"], values["/more/y"], len(values["/rows"])) == (1, 1, math.pi, 20_000)
    assert values["/text"] == file.read_text() and values["/raw"].data == file.read_bytes()
    assert (values["/yaml"], values["/e"], values["/program"]) == ({"a": [1, {"b": "c"}]}, 2, NotRun("echo 'a b'"))


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("", "its command is empty: name a program"),
        (" ", "its command is empty"),
        ("''", "its command is empty"),
        ("'", "its command: No closing quotation: close the quotation"),
        ("echo \\", "its command: No escaped"),
    ],
)
def test_command_that_can_not_run_is_refused_with_the_parameter(refusal, command, words):
    told = refusal(f'<param name="p" command="{command}"/>')
    assert told.startswith(f'<param name="p" command="{command}">: {words}')


def test_document_type_is_refused_in_included_files_and_allowed_in_comments(read, refusal, tmp_path):
    inner = tmp_path / "inner.launch"
    inner.write_text('<!DOCTYPE launch [<!ENTITY e "x">]><launch><param name="p" value="&e;"/></launch>')
    assert refusal(f'<include file="{inner}"/>').startswith(f"{inner}: no DOCTYPE is allowed")
    assert read('<!-- <!DOCTYPE x> --><param name="p" value="1"/>') == {"/p": 1}


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-8-sig"])
def test_encodings_of_xml_are_read(read, encoding):
    declared = '<?xml version="1.0" encoding="latin-1"?>' if encoding == "latin-1" else ""
    assert read(f'{declared}<launch><param name="p" value="\u00e4"/></launch>'.encode(encoding)) == {"/p": "\u00e4"}


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<node name="a.b" pkg="p" type="t"/>', "illegal <node> name 'a.b'"),
        ('<node name="a" pkg="p" type="t" colour="red"/>', "unknown <node> attribute 'colour'"),
        ("<nodes/>", "unrecognized tag nodes"),
    ],
)
def test_what_roslaunch_only_warns_of_is_refused_as_such(refusal, body, words):
    told = refusal(body)
    assert told.startswith("roslaunch warns of it, so it is not taken: ") and words in told
    assert told.endswith(": correct it")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<group ns="~"><param name="p" value="1"/></group>', 'roslaunch can\'t read <group ns="~">: ValueError: '),
        ('<param name="p" value="$(eval 1/0)"/>', 'roslaunch can\'t read <param name="p" value="$(eval 1/0)">: Zero'),
        ("<include/>", "roslaunch can't read <include>: KeyError: 'file'"),
    ],
)
def test_whatever_roslaunch_raises_is_told_with_element_and_remedy(refusal, body, words):
    told = refusal(body)
    assert told.startswith(words) and told.endswith(": correct the launch file")
