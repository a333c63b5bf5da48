"""What launch files hold that no reader takes, and what they may hold."""

import itertools
import math
import time

import pytest
import rosparam  # noqa: F401 - teaches PyYAML angles
import yaml
from node_kit.yaml_text import MAX_VALUES
from ros_model.errors import ModelError
from ros_model.io.launch_files import NotRun, load, wrong_parameters
from ros_model.io.launch_loader import MAX_FILES
from roslaunch.substitution_args import resolve_args

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


@pytest.mark.parametrize(
    "text",
    [
        "open('MARK', 'w')",
        "().x.y.join([open('MARK', 'w')])",
        "[f for f in [str]][0].mro()",
        "'{0.real}'.format(1)",
        "f'{1:9999999999d}'",
        "9**9**9",
        "'a'*9999999999",
        "'%9999999999d' % 1",
        "'a'.zfill(9999999999)",
        "factorial(99999999)",
        "(lambda: 1)()",
        "1" + "+1" * 1500,
        "1" + " " * 5000,
    ],
)
def test_expression_that_asks_for_python_is_refused_and_not_run(refusal, tmp_path, text):
    mark = tmp_path / "mark"
    told = refusal(f'<param name="p" value="$(eval {text.replace("MARK", str(mark))})"/>')
    assert '<param name="p" value="$(eval ' in told and ": " in told
    assert not mark.exists()


def test_expression_is_computed_as_roslaunch_does(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOT", "left arm")
    expressions = [
        *(
            "a + 1",
            "arg('a') * 2.5",
            "word",
            "word == 'b c'",
            "not flag and a > 2",
            "'x' if flag else 'y'",
            "1 < a <= 3",
        ),
        *("word.split()[1]", "'-'.join(word.split())", "word.replace('b', 'd').upper()", "env('ROBOT') + '!'"),
        *("word.startswith('b')", "optenv('NO_ROBOT', 'none')", "optenv('NO_ROBOT')", "sin(pi / 2) + e", "len(word)"),
        *("list(map(int, '1 2'.split()))", "[1, 'a', 2.0][-1]", "{'k': a}['k']", "dict(k=1)", "dirname() + '/x'"),
        *(
            "find('roslaunch') + '/y'",
            "anon('n') == anon('n')",
            "'%03d_%s' % (a, word)",
            "f'{a}{word}'",
            "float('1e3')",
        ),
        *("str(a) + '.5'", "a % 2 == 1", "a // 2", "2 ** 10", "-a", "true", "False", "None", "a in [1, 3]", "word[1:]"),
        *("[x * 2 for x in [1, 2]]", "(a, word)", "floor(2.7)", "1_0 + 0x10", "max(1, a)", "atan2(1, 1)"),
    ]
    path = tmp_path / "robot.launch"
    arguments = {"a": "3", "word": "b c", "flag": "true", "pi": "4"}
    context = {"arg": arguments, "anon": {}, "filename": str(path)}
    given = "".join(f'<arg name="{name}" default="{value}"/>' for name, value in arguments.items())
    body = "".join(
        f'<param name="p{n}" type="str" value="{escaped(f"$(eval {text})")}"/>' for n, text in enumerate(expressions)
    )
    path.write_text(f"<launch>{given}{body}</launch>")
    values = load(path).params
    for number, text in enumerate(expressions):
        assert values[f"/p{number}"].value == resolve_args(f"$(eval {text})", context).strip(), text


def test_argument_that_is_called_as_a_function_of_python_is_the_argument(read):
    assert read('<arg name="map" default="hall"/><param name="p" value="$(eval map + \'!\')"/>') == {"/p": "hall!"}


@pytest.mark.parametrize("text", ["open('MARK', 'w')", "exit(3)", "9**9**9", "'a'", "1/0", "[1]"])
@pytest.mark.parametrize(
    "form", ["<rosparam>{}</rosparam>", '<rosparam>a: 1</rosparam><param name="q" type="yaml" value="{}"/>']
)
def test_angle_that_asks_for_python_is_refused_and_not_run(refusal, tmp_path, form, text):
    mark, file = tmp_path / "mark", tmp_path / "p.yaml"
    code = text.replace("MARK", str(mark))
    told = refusal(form.format(escaped(f"{{x: !radians '{code.replace(chr(39), chr(39) * 2)}'}}")))
    assert "is no angle in radians: " in told and told.endswith(": correct the YAML")
    file.write_text(f'x: !radians "{code}"')
    assert "is no angle in radians: " in wrong_parameters(file)
    assert not mark.exists()


def test_angles_are_computed_as_rosparam_does(read):
    angles = "[!radians 2*pi, rad(pi/2), rad(1.5), !degrees 180, deg(-90.5), !radians -pi+1, rad( 1 ), radish]"
    values = read(f"<rosparam>a: {angles}</rosparam>")["/a"]
    assert values == yaml.safe_load(angles)
    assert values[:4] == [2 * math.pi, math.pi / 2, 1.5, math.pi]


@pytest.mark.parametrize("number", ["1:" * 5000 + "1", "1" * 5000, "1" * 5000 + ".5"])
def test_number_of_any_length_is_refused(refusal, number):
    assert "characters (at most 1100): correct the YAML" in refusal(f"<rosparam>a: {number}</rosparam>")


def test_includes_that_double_are_refused(refusal, tmp_path):
    for number in range(12):
        include = f'<include file="$(dirname)/l{number + 1}.launch"/>'
        (tmp_path / f"l{number}.launch").write_text(f"<launch>{include}{include}</launch>")
    (tmp_path / "l12.launch").write_text("<launch/>")
    told = refusal(f'<include file="{tmp_path}/l0.launch"/>')
    assert f"there are more than {MAX_FILES} files with it: include fewer" in told


@pytest.mark.parametrize("form", ["$(arg {0})$(arg {0})", "$(eval {0}+{0})"])
def test_arguments_that_double_are_refused(refusal, form):
    doubled = "".join(f'<arg name="a{number + 1}" value="{form.format(f"a{number}")}"/>' for number in range(40))
    told = refusal(f'<arg name="a0" value="xxxxxxxxxx"/>{doubled}')
    assert "shorten the arguments" in told or "it makes something of the size" in told


def test_argument_that_holds_a_substitution_is_refused(refusal):
    body = (
        """<arg name="a" value="$(eval '$'+'(arg b)')"/><arg name="b" value="1"/><param name="p" value="$(arg a)"/>"""
    )
    assert "the argument a holds '$(': take it out" in refusal(body)
    assert "more than 1000 $(...)" in refusal(f'<arg name="b" value="1"/><param name="p" value="{"$(arg b)" * 1001}"/>')


@pytest.mark.parametrize(
    "body", ['<arg name="a" value="{}"/>', '<remap from="x" to="{}"/>', '<machine name="x" address="{}"/>']
)
def test_refused_expression_is_named_with_file_and_element_whatever_it_stands_in(refusal, body):
    told = refusal(body.format("$(eval 9**9**9)"))
    assert told.startswith(f"{body.format('$(eval 9**9**9)')[:-2]}>: $(eval ...): a power with more than 10000 bits")
    assert told.endswith("use numbers, texts, their methods and roslaunch's functions")
