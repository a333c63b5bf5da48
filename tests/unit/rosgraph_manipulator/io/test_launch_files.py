"""Reading launch files through roslaunch."""

import pytest
from ros_model.errors import ModelError
from ros_model.io.files import resolve
from ros_model.io.launch_files import load
from rosgraph_manipulator.configuration.difference import compare
from rosgraph_manipulator.io.launch_files import LaunchFileError, read_launch_file, read_model

NODE = '<node name="n" pkg="move_base" type="move_base"'


def short(value):
    return repr(value)[:12]


def write(folder, body):
    path = folder / "x.launch"
    path.write_text(f"<launch>{body}</launch>")
    return path


def test_nodes_keep_their_parameters_remaps_and_environment(tmp_path):
    body = f"""<arg name="speed"/><param name="shared" value="1"/><group ns="robot">
      {NODE} args="--fast" output="screen" respawn="true"><param name="x/y" value="$(arg speed)"/>
      <remap from="a" to="b"/><env name="E" value="1"/></node></group>"""
    launch = read_launch_file(write(tmp_path, body), ["speed:=2.5"])
    node = launch.system.nodes["/robot/n"]
    assert node.parameters == {"x/y": 2.5}
    assert node.remaps == (("a", "b"),)
    assert ("E", "1") in node.environment
    assert (node.args, node.output, node.respawn) == ("--fast", "screen", True)
    assert launch.system.parameters == {"/shared": 1}


def test_parameter_belongs_to_the_innermost_node_in_whose_namespace_it_is(tmp_path):
    inner = '<node name="controller" pkg="move_base" type="move_base"><param name="gain" value="1"/></node>'
    body = f"""<node name="arm" pkg="move_base" type="move_base"><param name="speed" value="2"/></node>
      <group ns="arm">{inner}</group><param name="arm/controllers" value="3"/>"""
    launch = read_launch_file(write(tmp_path, body))
    parameters = {name: node.parameters for name, node in launch.system.nodes.items()}
    assert parameters == {"/arm": {"speed": 2, "controllers": 3}, "/arm/controller": {"gain": 1}}
    assert launch.system.parameters == {}


def test_all_that_a_start_needs_is_in_the_description(tmp_path):
    body = f"""<machine name="here" address="localhost" default="never"/>
      {NODE} respawn="true" respawn_delay="2.5" machine="here" launch-prefix="nice" cwd="node"/>
      <node name="m" pkg="move_base" type="move_base" required="true"/>"""
    nodes = read_launch_file(write(tmp_path, body)).system.nodes
    assert (nodes["/n"].respawn, nodes["/n"].respawn_delay, nodes["/n"].required) == (True, 2.5, False)
    assert (nodes["/n"].machine, nodes["/n"].launch_prefix, nodes["/n"].cwd) == ("", "nice", "node")
    assert (nodes["/m"].respawn, nodes["/m"].respawn_delay, nodes["/m"].required) == (False, 0.0, True)


def test_node_of_another_machine_names_its_address(tmp_path):
    body = f'<machine name="far" address="192.0.2.1" env-loader="/x" user="u" password="p"/>{NODE} machine="far"/>'
    launch = read_launch_file(write(tmp_path, body))
    assert launch.system.nodes["/n"].machine == "192.0.2.1"
    assert launch.remarks == (
        "machine 'far': env-loader, user, password are ignored: a rosgraph_launcher runs there, and needs no ssh",
    )


def test_name_of_a_machine_may_be_known_to_its_launcher_alone(tmp_path):
    body = f'<machine name="far" address="arm-pc.invalid"/>{NODE} machine="far"/>'
    assert read_launch_file(write(tmp_path, body)).system.nodes["/n"].machine == "arm-pc.invalid"


def test_user_of_a_machine_makes_it_no_other_host(tmp_path):
    body = f'<machine name="own" address="localhost" user="somebody_else"/>{NODE} machine="own"/>'
    assert read_launch_file(write(tmp_path, body)).system.nodes["/n"].machine == ""


def test_machine_that_is_not_declared_is_named_with_node_and_remedy(tmp_path):
    with pytest.raises(LaunchFileError, match=r"node n is for machine 'arm', which is not declared: add <machine"):
        read_launch_file(write(tmp_path, f'{NODE} machine="arm"/>'))


def test_two_readings_of_anonymous_names_are_the_same(tmp_path):
    path = write(tmp_path, '<node name="$(anon n)" pkg="move_base" type="move_base"/>')
    assert list(read_launch_file(path).system.nodes) == list(read_launch_file(path).system.nodes)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("<node name=", "not well-formed"),
        ("", "starts no node"),
        ('<node name="n" type="x"/>', "pkg"),
        (f'<include file="/no/such.launch"/>{NODE}/>', "no/such.launch"),
        (f'{NODE}/><param name="x" value="$(arg nowhere)"/>', "nowhere"),
        (f"{NODE}/>{NODE}/>", "multiple nodes named"),
        ('<node name="" pkg="move_base" type="move_base"/>', "a node of move_base/move_base has no name: give it one"),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_one_line(tmp_path, body, words):
    path = write(tmp_path, body)
    with pytest.raises(LaunchFileError, match=words) as error:
        read_launch_file(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("no_such_name", "NameError: name 'no_such_name' is not defined"),
        ("1/0", "ZeroDivisionError: division by zero"),
        ("1 +", "SyntaxError: "),
        ("pi.nothing", "AttributeError: 'float' object has no attribute 'nothing'"),
        ("'x'[3]", "IndexError: "),
        ("9.0**999", "OverflowError: "),
    ],
)
@pytest.mark.parametrize("body", ['<group if="{}">{}/></group>', '<param name="x" value="{}"/>{}/>'])
def test_expression_that_fails_is_named_with_file_and_remedy(tmp_path, body, expression, words):
    path = write(tmp_path, body.format(f"$(eval {expression})", NODE))
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(path)
    assert f"{path}: '$(eval {expression})' fails: {words}" in str(error.value)
    assert str(error.value).endswith("correct the expression")
    assert "\n" not in str(error.value)


def test_expression_of_an_included_file_is_named_with_that_file(tmp_path):
    included = tmp_path / "included.launch"
    included.write_text(f'<launch><group unless="$(eval 1/0)">{NODE}/></group></launch>')
    with pytest.raises(LaunchFileError, match=f"{included}: .*division by zero"):
        read_launch_file(write(tmp_path, f'<include file="{included}"/>'))


MANY = "".join(f'<param name="p{i}" value="{i}"/>' for i in range(20))
FAILS = "$(eval 1/0)"


@pytest.mark.parametrize(
    "body",
    [
        f'{NODE} args="{FAILS}">{MANY}</node>',
        f'{NODE}><param name="x" value="{FAILS}"/>{MANY}</node>',
        f'{NODE}><env name="x" value="{FAILS}"/>{MANY}</node>',
        f'{NODE}><remap from="x" to="{FAILS}"/>{MANY}</node>',
        f'<arg name="x" value="{FAILS}"/>',
        f'<remap from="x" to="{FAILS}"/>',
        f'<machine name="x" address="{FAILS}"/>',
    ],
)
@pytest.mark.parametrize("is_included", [False, True])
def test_refusal_of_an_expression_is_file_expression_and_reason(tmp_path, body, is_included):
    path = write(tmp_path, body)
    outer = tmp_path / "outer.launch"
    outer.write_text(f'<launch><include file="{path}"/></launch>')
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(outer if is_included else path)
    assert str(error.value) == f"{path}: '{FAILS}' fails: ZeroDivisionError: division by zero: correct the expression"


def test_long_expression_is_shortened(tmp_path):
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(write(tmp_path, f'{NODE} args="$(eval {"1 + " * 200} no_such_name)"/>'))
    assert len(str(error.value)) < len(str(tmp_path)) + 250
    assert "no_such_name)' fails: NameError" in str(error.value)


def test_refusal_of_a_node_names_it_without_what_is_in_it(tmp_path):
    path = write(tmp_path, f'<node name="n" pkg="move_base">{MANY}</node>')
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(path)
    told = '<node> tag is missing required attribute: \'type\', in <node name="n" pkg="move_base">'
    assert str(error.value) == f"{path}: {told}"


@pytest.mark.parametrize(
    "content",
    [
        b'<?xml version="1.0" encoding="no-such-encoding"?><launch/>',
        b'<?xml version="1.0" encoding="utf-32"?><launch/>',
        b'<?xml version="1.0" encoding="base64"?><launch/>',
        b"<launch>\xff\xfe</launch>",
        b"<launch>\x00</launch>",
        b"\x00\x01\x02",
        b"",
        b"<launch><node></launch>",
    ],
)
def test_file_that_is_no_xml_is_refused_with_a_remedy(tmp_path, content):
    path = tmp_path / "x.launch"
    path.write_bytes(content)
    with pytest.raises(LaunchFileError, match=r"not well-formed XML: .*UTF-8") as error:
        read_launch_file(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_file_that_includes_itself_is_refused(tmp_path):
    with pytest.raises(LaunchFileError, match="recursion"):
        read_launch_file(write(tmp_path, f'<include file="{tmp_path}/x.launch"/>'))


@pytest.mark.parametrize("failure", [RuntimeError("a\nb"), SystemExit(3), AssertionError(), MemoryError()])
def test_whatever_roslaunch_raises_refuses_the_file_in_one_line(tmp_path, monkeypatch, failure):
    def fail(*_arguments, **_options):
        raise failure

    path = write(tmp_path, f"{NODE}/>")
    monkeypatch.setattr("roslaunch.xmlloader.XmlLoader._node_tag", fail)
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(path)
    assert str(error.value).startswith(f"{path}: roslaunch can't read <launch>: {type(failure).__name__}: ")
    assert str(error.value).endswith(": correct the launch file")
    assert "\n" not in str(error.value)


def test_missing_file_is_refused():
    with pytest.raises(LaunchFileError, match=r"/no/such\.launch"):
        read_launch_file("/no/such.launch")


def test_entities_are_refused(tmp_path):
    path = tmp_path / "x.launch"
    path.write_text(f'<!DOCTYPE launch [<!ENTITY e "x">]><launch>{NODE} args="&e;"/></launch>')
    with pytest.raises(LaunchFileError, match="document type"):
        read_launch_file(path)


@pytest.mark.parametrize(
    "body",
    [
        "<rosparam>a: &amp;a [*a]</rosparam>",
        '<param name="p" textfile="/dev/zero"/>',
        '<param name="p" command=""/>',
        '<node name="a.b" pkg="move_base" type="move_base"/>',
        "<rosparam>1: 2</rosparam>",
    ],
)
def test_what_check_refuses_is_refused_in_the_same_words(tmp_path, body):
    path = write(tmp_path, f"{NODE}/>{body}")
    with pytest.raises(ModelError) as checked:
        load(path)
    with pytest.raises(LaunchFileError) as error:
        read_launch_file(path)
    assert str(error.value) == str(checked.value)


def test_parameter_that_is_no_number_does_not_differ_from_itself(tmp_path):
    path = write(tmp_path, f"{NODE}><rosparam>{{a: .nan, b: [.nan]}}</rosparam></node><rosparam>c: .nan</rosparam>")
    difference = compare(read_launch_file(path).system, read_launch_file(path).system)
    assert not difference.touches_nodes and not difference.shared
    path.write_text(path.read_text().replace("[.nan]", "[1.0]"))
    assert list(compare(difference.running, read_launch_file(path).system).parameters["/n"]) == ["b"]


def test_model_and_its_launch_file_are_the_same_configuration():
    name = "f2_v2_r2"
    model = read_model(resolve(f"package://metacontrol_sim/models/variants/{name}.rossystem"))
    launch = read_launch_file(resolve(f"package://metacontrol_sim/launch/variants/{name}.launch"))
    difference = compare(model.system, launch.system)
    assert not difference.touches_nodes
    assert not difference.shared


def test_parameters_to_clear_are_kept(tmp_path):
    launch = read_launch_file(write(tmp_path, f'<group ns="old" clear_params="true"/>{NODE}/>'))
    assert launch.clear == ("/old/",)


@pytest.mark.parametrize(
    "spoilt", ["a: [1", "[1, 2]", "1: 2", "a: &a [*a]", "a: [" + "1," * 300_000 + "]", "", b"a: \xff", None], ids=short
)
def test_file_of_parameters_that_can_not_be_used_counts_as_it_was(tmp_path, spoilt):
    """Many variants may load one file."""
    file = tmp_path / "tank.yaml"
    file.write_text("depth: 3\nvalves: {open: [1, 2]}\n")
    path = write(tmp_path, f'{NODE}><rosparam file="{file}"/><param name="depth" value="4"/></node>')
    known = {}
    whole = read_launch_file(path, parameter_files=known)
    if spoilt is None:
        file.unlink()
    else:
        file.write_bytes(spoilt if isinstance(spoilt, bytes) else spoilt.encode())
    if spoilt != "":
        with pytest.raises(LaunchFileError):
            read_launch_file(path)
    launch = read_launch_file(path, parameter_files=known)
    assert launch.system == whole.system
    (remark,) = launch.remarks
    assert f"{file} can't be used, so its values are those of before: correct it (" in remark and "\n" not in remark
    file.write_text("depth: 3\nvalves: {open: [1]}\n")
    assert read_launch_file(path, parameter_files=known).system.nodes["/n"].parameters["valves/open"] == [1]
