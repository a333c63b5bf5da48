"""Packages and launch files as a whole, with the command `rosmodel extract`."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
import rospkg
from ros_model.cli.rosmodel import main
from ros_model.errors import ModelError
from ros_model.io.models import read_packages, read_system
from ros_model.language.metamodel import ConnectionKind, PortKind
from ros_model.language.packages import SpecKind
from ros_model.language.packages_reader import parse_packages
from ros_model.language.packages_writer import write_packages
from ros_model.language.remappings import remappings_of
from ros_model_extraction.io.launch_files import read_launch_file
from ros_model_extraction.packages.catkin_package import find_packages, read_package
from ros_model_extraction.packages.cmake import commands
from ros_model_extraction.packages.package_source import extract_package

TALKER = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String
rospy.init_node("talker")
rospy.Publisher(rospy.get_param("~topic", "chatter"), String, queue_size=1)
rospy.Subscriber("heard", String, print)
rospy.Service("~reset", rospy.x, print)
"""


def make_package(folder: Path, name: str = "demo", cmake: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "package.xml").write_text(
        f'<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>'
        '<maintainer email="a@b.example">m</maintainer><license>MIT</license></package>'
    )
    (folder / "CMakeLists.txt").write_text(cmake or f"project({name})\n")
    return folder


def make_script(path: Path, text: str = TALKER, mode: int = 0o755) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(mode)
    return path


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


def executables(folder: Path) -> dict[str, list[str]]:
    found = read_package(folder).executables
    return {e.name: [str(s.relative_to(folder)) for s in e.sources] for e in found}


def test_installed_programs_and_executable_scripts_are_executables(tmp_path):
    make_package(tmp_path, cmake="catkin_install_python(PROGRAMS nodes/a DESTINATION x)\n")
    make_script(tmp_path / "nodes" / "a", mode=0o644)
    make_script(tmp_path / "scripts" / "b.py")
    make_script(tmp_path / "scripts" / "library.py", mode=0o644)
    make_script(tmp_path / "cfg" / "Demo.cfg")
    make_script(tmp_path / "test" / "check.py")
    make_script(tmp_path / "setup.py")
    make_script(tmp_path / "scripts" / "shell", "#!/bin/sh\n")
    assert executables(tmp_path) == {"a": ["nodes/a"], "b.py": ["scripts/b.py"]}


def test_compiled_executables_have_the_sources_of_the_libraries_they_link(tmp_path):
    make_package(
        tmp_path,
        cmake="""
        project(demo) # ${not_here}
        set(SOURCES src/a.cpp "src/b.cpp")
        file(GLOB REST src/lib/*.cpp)
        add_library(${PROJECT_NAME}_lib ${REST})
        add_executable(${PROJECT_NAME}_node ${SOURCES} src/gone.cpp ${elsewhere})
        target_link_libraries(${PROJECT_NAME}_node PRIVATE ${PROJECT_NAME}_lib ${catkin_LIBRARIES})
        set_target_properties(demo_node PROPERTIES OUTPUT_NAME node PREFIX "")
        #[[ add_executable(commented src/a.cpp) ]]
        """,
    )
    for name in ("a", "b", "lib/c"):
        make_script(tmp_path / "src" / f"{name}.cpp", "int x;\n", 0o644)
    assert executables(tmp_path) == {"node": ["src/a.cpp", "src/b.cpp", "src/lib/c.cpp"]}
    said = [str(remark) for remark in read_package(tmp_path).remarks]
    assert said == [
        "CMakeLists.txt:6:1: not read: the source src/gone.cpp of demo_node is not in the package",
        "CMakeLists.txt:6:1: not read: the source ${elsewhere} of demo_node is not in the package",
    ]


def test_library_that_no_executable_links_is_told(tmp_path):
    make_package(tmp_path, cmake="add_library(nodelets src/a.cpp)\n")
    make_script(tmp_path / "src" / "a.cpp", "int x;\n", 0o644)
    assert ["library nodelets is linked by no executable" in str(r) for r in read_package(tmp_path).remarks] == [True]


def test_script_that_never_starts_its_node_is_named_as_its_file(tmp_path):
    make_package(tmp_path)
    make_script(tmp_path / "nodes" / "a", TALKER.replace('rospy.init_node("talker")', ""))
    make_script(tmp_path / "nodes" / "b", "#!/usr/bin/env python3\n")
    extracted = extract_package(tmp_path)
    assert [(a.name, a.nodes[0].name) for a in extracted.package.artifacts] == [("a", "a")]
    assert "Executables that start no ROS node: b." in extracted.model().header


def test_paths_outside_the_package_are_refused(tmp_path):
    make_package(
        tmp_path / "demo",
        cmake="catkin_install_python(PROGRAMS ../../etc/passwd /etc/passwd nodes/gone DESTINATION x)\n",
    )
    said = [str(remark) for remark in read_package(tmp_path / "demo").remarks]
    assert [line.partition("the program ")[2] for line in said] == [
        "../../etc/passwd is not in the package",
        "/etc/passwd is not in the package",
        "nodes/gone is not in the package",
    ]


@pytest.mark.parametrize(
    "cmake",
    [
        "macro(tutorial T)\nadd_executable(${T} src/${T}.cpp)\nendmacro()\n"
        "foreach(one a b)\ntutorial(${one})\nendforeach()",
        "set(names a b)\nforeach(one IN LISTS names)\nadd_executable(${one} src/${one}.cpp)\nendforeach(one)",
        "function(make)\nforeach(one ${ARGN})\nadd_executable(${one} src/${one}.cpp)\nendforeach()\nendfunction()\n"
        "Make(a b)",
        "function(names out)\nset(${out} src/a.cpp PARENT_SCOPE)\nendfunction()\n"
        "names(found)\nadd_executable(a ${found})\nadd_executable(b src/b.cpp)",
        "function(make)\ncmake_parse_arguments(my QUIET NAME SOURCES ${ARGN})\n"
        "add_executable(${my_NAME} ${my_SOURCES})\nendfunction()\n"
        "make(NAME a SOURCES src/a.cpp)\nmake(QUIET NAME b SOURCES src/b.cpp)",
        "set(i 1)\nforeach(i RANGE 1)\nlist(GET names ${i} one)\nendforeach()\n"
        "add_executable(a src/a.cpp)\nif(NOT CATKIN_ENABLE_TESTING)\nadd_executable(b src/b.cpp)\nendif()",
        "if(CATKIN_ENABLE_TESTING)\nif(x)\nelse()\nendif()\nadd_executable(check src/a.cpp)\nelse()\n"
        "add_executable(a src/a.cpp)\nendif()\nadd_executable(b src/b.cpp)",
    ],
)
def test_loops_functions_and_macros_are_run(tmp_path, cmake):
    make_package(tmp_path, cmake=cmake)
    for name in ("a", "b"):
        make_script(tmp_path / "src" / f"{name}.cpp", "int x;\n", 0o644)
    assert executables(tmp_path) == {"a": ["src/a.cpp"], "b": ["src/b.cpp"]}
    assert not read_package(tmp_path).remarks


def test_folders_that_are_added_are_read_with_paths_of_their_own(tmp_path):
    make_package(tmp_path, cmake="set(prefix demo)\nadd_subdirectory(src)\nadd_subdirectory(../elsewhere)\n")
    make_script(tmp_path / "src" / "a.cpp", "int x;\n", 0o644)
    lines = "set(prefix other)\nadd_executable(${prefix}_a a.cpp)\nadd_executable(b gone.cpp)\nadd_subdirectory(.)\n"
    (tmp_path / "src" / "CMakeLists.txt").write_text(lines)
    assert executables(tmp_path) == {"other_a": ["src/a.cpp"], "b": []}
    assert [str(remark) for remark in read_package(tmp_path).remarks] == [
        "src/CMakeLists.txt:3:1: not read: the source gone.cpp of b is not in the package"
    ]


ENDLESS = "macro(a)\na()\nendmacro()\na()", "foreach(i RANGE 999999)\nforeach(j RANGE 999999)\nb()\nendforeach()"


@pytest.mark.parametrize(
    "text", ["(" * 5000, '"', "set(A ${A}${A})" * 200, "a(b", ")))", "[[", "#[[", "foreach(", "if(a", *ENDLESS]
)
def test_broken_cmake_neither_hangs_nor_crashes(tmp_path, text):
    assert all(command.name for command in commands(text, tmp_path))


def test_messages_services_and_actions_are_specified(tmp_path):
    make_package(tmp_path)
    for kind, text in (
        ("msg", "# a comment\nstring NAME=a # b\nint8 OK=1\nfloat32[3] data # x\nstd_msgs/Header header\n"),
        ("srv", "int8 a\n---\nbool ok\n"),
        ("action", "---\nint8 result\n---\n"),
    ):
        (tmp_path / kind).mkdir()
        (tmp_path / kind / f"Thing.{kind}").write_text(text)
    (tmp_path / "msg" / "Bad.msg").write_text("int8 a\nwhat is this\n")
    extracted = extract_package(tmp_path)
    specs = {spec.kind: dict(spec.parts) for spec in extracted.package.specs}
    message = [(field.type, field.name, field.constant) for field in specs[SpecKind.TOPIC]["message"]]
    assert message == [
        ("string", "NAME", "a # b"),
        ("int8", "OK", "1"),
        ("float32[3]", "data", None),
        ("std_msgs/Header", "header", None),
    ]
    assert [len(fields) for fields in specs[SpecKind.SERVICE].values()] == [1, 1]
    assert [len(fields) for fields in specs[SpecKind.ACTION].values()] == [0, 1, 0]
    assert [str(remark) for remark in extracted.unread] == [
        "msg/Bad.msg:2:1: not read: 'what is this' is no field: expected a type and a name"
    ]


def test_packages_below_a_folder_are_found_through_links_but_not_in_circles(tmp_path):
    make_package(tmp_path / "src" / "a" / "one", "one")
    make_package(tmp_path / "elsewhere" / "two", "two")
    make_package(tmp_path / "src" / "ignored" / "three", "three")
    (tmp_path / "src" / "ignored" / "CATKIN_IGNORE").touch()
    (tmp_path / "src" / "linked").symlink_to(tmp_path / "elsewhere" / "two")
    (tmp_path / "src" / "a" / "circle").symlink_to(tmp_path / "src")
    (tmp_path / "src" / "a" / "one" / "self").symlink_to(tmp_path / "src" / "a" / "one")
    assert [path.name for path in find_packages(tmp_path / "src")[0]] == ["one", "linked"]
    assert executables(tmp_path / "src" / "a" / "one") == {}


def test_command_writes_a_model_that_reads_back_and_checks(tmp_path, capsys):
    folder = make_package(tmp_path / "demo")
    make_script(folder / "nodes" / "talker.py")
    assert run("extract", tmp_path, "-o", tmp_path / "out") == 0
    written = read_packages(tmp_path / "out" / "demo.ros")
    node = written.node("demo", "talker.py", "talker")
    assert node and [(p.kind, p.name, p.type) for p in node.ports] == [
        (PortKind.PUBLISHER, "chatter", "std_msgs/String"),
        (PortKind.SUBSCRIBER, "heard", "std_msgs/String"),
        (PortKind.SERVICE_SERVER, "~reset", ""),
    ]
    assert "nodes/talker.py:7:1: service server: its type is not known" in written.header
    assert "1 node, 3 interfaces, 1 not fully known" in capsys.readouterr().out
    assert run("check", tmp_path / "out" / "demo.ros") == 0


def test_command_tells_of_a_file_that_is_not_read_with_its_place(tmp_path, capsys):
    folder = make_package(tmp_path / "demo")
    make_script(folder / "nodes" / "talker", "#!/usr/bin/python\nprint 'old'\n")
    assert run("extract", folder, "-o", tmp_path / "out") == 1
    assert f"rosmodel: {folder}/nodes/talker:2:1: not read: no Python 3" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "package.xml:1:1: "),
        (b"<package>\n<name>", "package.xml:2:7: "),
        (b"\0\1", "not read: it is no text but binary"),
        (b"<package><name>\xff</name></package>", "not UTF-8"),
        (b"<!DOCTYPE x [<!ENTITY a 'b'>]><package/>", "no DOCTYPE and no entities"),
        (b"<package format='2'><name>x</name></package>", "must"),
    ],
    ids=["empty", "cut", "binary", "encoding", "entities", "incomplete"],
)
def test_bad_manifest_is_one_line_and_other_packages_are_read(tmp_path, capsys, content, said):
    make_package(tmp_path / "good", "good")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "package.xml").write_bytes(content)
    assert run("extract", tmp_path, "-o", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert said in error and "Traceback" not in error and len(error.strip().splitlines()) == 1
    assert (tmp_path / "out" / "good.ros").exists()


def test_manifest_with_more_dependencies_than_people_write_is_refused(tmp_path):
    path = make_package(tmp_path) / "package.xml"
    many = "".join(f"<exec_depend>p{number}</exec_depend>" for number in range(501))
    path.write_text(path.read_text().replace("</package>", f"{many}</package>"))
    with pytest.raises(ModelError, match=r"package\.xml:1:1: 501 dependencies are too many \(at most 500\): leave"):
        read_package(tmp_path)


def test_folder_without_packages_and_missing_paths_are_refused(tmp_path, capsys):
    (tmp_path / "circle").symlink_to(tmp_path)
    assert run("extract", tmp_path) == 2
    assert "no package.xml here or below" in capsys.readouterr().err
    assert run("extract", tmp_path / "gone") == 2
    assert "no such folder" in capsys.readouterr().err
    assert run("extract", tmp_path, "a:=b") == 2
    assert "arguments are for a launch file" in capsys.readouterr().err


@pytest.fixture
def forbid(monkeypatch):
    """Makes a folder one that can't be entered: root, who may run the tests, can enter all."""
    stat, forbidden = os.stat, []

    def refusing(path, *arguments, **options):
        if not isinstance(path, int) and any(folder in Path(path).parents for folder in forbidden):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return stat(path, *arguments, **options)

    monkeypatch.setattr(os, "stat", refusing)
    return forbidden.append


def test_named_folder_that_can_not_be_entered_is_refused_in_one_line(tmp_path, capsys, forbid):
    make_package(tmp_path / "demo")
    forbid(tmp_path)
    for path in (tmp_path, tmp_path / "demo", tmp_path / "demo" / "a.launch"):
        assert run("extract", path, "-o", tmp_path / "out") == 2
        error = capsys.readouterr().err
        assert error.startswith(f"rosmodel: {path}: not read: Permission denied") and len(error.splitlines()) == 1


def test_folder_below_that_can_not_be_entered_is_told_and_the_others_read(tmp_path, capsys, forbid):
    make_package(tmp_path / "src" / "closed", "closed")
    good = make_package(tmp_path / "src" / "good", "good")
    make_script(good / "nodes" / "talker", TALKER + "import private.other\nprivate.other.publish()\n")
    make_script(good / "private" / "other")
    forbid(tmp_path / "src" / "closed")
    forbid(good / "private")
    assert run("extract", tmp_path / "src", "-o", tmp_path / "out") == 1
    assert capsys.readouterr().err.splitlines() == [
        f"rosmodel: {tmp_path}/src/closed: not read: Permission denied",
        f"rosmodel: {good}/private:1:1: not read: Permission denied",
    ]
    assert read_packages(tmp_path / "out" / "good.ros").node("good", "talker", "talker")
    forbid(good)
    assert run("extract", tmp_path / "src", "-o", tmp_path / "out") == 2
    assert (
        f"no package.xml here or below: give the folder of a ROS package, or of several; {tmp_path}/src/closed: "
        in (capsys.readouterr().err)
    )


def test_folder_above_the_working_folder_may_be_given(tmp_path, monkeypatch, capsys):
    folder = make_package(tmp_path / "demo", cmake="catkin_install_python(PROGRAMS nodes/talker)\n")
    (folder / "nodes").mkdir()
    (folder / "nodes" / "talker").write_text(TALKER)
    models = tmp_path / "models"
    models.mkdir()
    monkeypatch.chdir(models)
    assert run("extract", "..", "-o", models) == 0, capsys.readouterr().err
    assert read_packages(models / "demo.ros").node("demo", "talker", "talker")


def test_listed_executable_that_does_not_exist_is_told(tmp_path, capsys):
    lines = "catkin_install_python(PROGRAMS nodes/gone)\nadd_executable(gone_too src/gone.cpp)\n"
    folder = make_package(tmp_path / "demo", cmake=lines)
    assert run("extract", folder, "-o", tmp_path / "out") == 1
    assert capsys.readouterr().err.splitlines() == [
        f"rosmodel: {folder}/CMakeLists.txt:1:1: not read: the program nodes/gone is not in the package",
        f"rosmodel: {folder}/CMakeLists.txt:2:1: not read: the source src/gone.cpp of gone_too is not in the package",
    ]


@pytest.mark.parametrize(
    ("place", "given"), [("", "src"), ("src/demo", "."), ("src/demo/src", ".."), ("src", "./demo")]
)
def test_paths_in_messages_are_relative_where_a_relative_one_is_given(tmp_path, monkeypatch, capsys, place, given):
    cmake = "add_executable(demo src/demo.cpp)\nadd_executable(gone src/gone.cpp)\n"
    folder = make_package(tmp_path / "src" / "demo", cmake=cmake)
    (folder / "src").mkdir(exist_ok=True)
    (folder / "include" / "demo").mkdir(parents=True)
    (folder / "src" / "demo.cpp").write_text(
        '#include <ros/ros.h>\n#include "demo/made.h"\n'
        'int main(int c, char** v) { ros::init(c, v, "demo"); ros::NodeHandle n; make(n); ros::spin(); }\n'
    )
    (folder / "include" / "demo" / "made.h").write_text(
        "#include <std_msgs/String.h>\n"
        'inline void make(ros::NodeHandle& n) { static auto p = n.advertise<std_msgs::String>("said", 1); }\n'
    )
    monkeypatch.chdir(tmp_path / place)
    assert run("extract", given, "-o", tmp_path / "out") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("CMakeLists.txt:2:1: not read: the source src/gone.cpp of gone is not in the package")
    assert str(tmp_path) not in line
    node = read_packages(tmp_path / "out" / "demo.ros").node("demo", "demo", "demo")
    assert [port.name for port in node.ports] == ["said"]


@pytest.mark.parametrize("name", ["main.cpp", "package.xml", "noextension"])
def test_file_that_is_no_launch_file_is_told_what_is_taken(tmp_path, capsys, name):
    (tmp_path / name).write_text("int main() {}")
    assert run("extract", tmp_path / name) == 2
    said = "no launch file (*.launch, *.xml, *.test): give one, or the folder of a ROS package, or of several"
    assert capsys.readouterr().err == f"rosmodel: {tmp_path / name}: {said}\n"


def test_unwritable_output_is_told(tmp_path, capsys):
    make_package(tmp_path / "demo")
    (tmp_path / "file").touch()
    assert run("extract", tmp_path / "demo", "-o", tmp_path / "file" / "x") == 2
    assert "check its folder" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["metacontrol_msgs", "metacontrol_sim", "move_base", "rosgraph_manipulator"])
def test_models_of_our_own_packages_read_back_as_written(name):
    extracted = extract_package(Path(rospkg.RosPack().get_path(name)))
    assert extracted.unread == ()
    assert parse_packages(write_packages(extracted.model())) == extracted.model()


# --- launch files


@pytest.fixture
def launched(tmp_path, monkeypatch):
    """Reads a launch file that may start nodes/talker of the package demo."""
    folder = make_package(tmp_path / "src" / "demo")
    make_script(folder / "nodes" / "talker")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'src'}{os.pathsep}{os.environ.get('ROS_PACKAGE_PATH', '')}")

    def read(text: str, *arguments: str):
        path = tmp_path / "system.launch"
        path.write_text(f"<launch>{text}</launch>")
        return read_launch_file(path, arguments)

    return read


def test_program_of_a_launch_file_is_run_only_if_that_is_asked_for(launched, tmp_path):
    mark, out = tmp_path / "mark", tmp_path / "out"
    command = f"touch {mark}"
    launched(f"""<param name="text" command="{command}"/><param name="kept" value="1"/>""")
    assert run("extract", tmp_path / "system.launch", "-o", out) == 0
    assert not mark.exists()
    written = (out / "system.rossystem").read_text()
    assert f"Left out: the parameter /text, which a program gives that was not run: {command}" in written
    assert run("extract", tmp_path / "system.launch", "-o", out, "--run-programs") == 0
    assert mark.exists()
    assert "Left out" not in (out / "system.rossystem").read_text()


def test_launch_file_gives_components_wiring_and_parameters(launched, tmp_path, capsys):
    launched(
        """<arg name="side"/><param name="gain" value="2"/>
        <group ns="$(arg side)"><node name="a" pkg="demo" type="talker"><param name="topic" value="said"/>
        <remap from="heard" to="said_back"/></node></group>
        <node name="b" pkg="demo" type="talker" args="heard:=left/said _topic:=left/said_back"/>
        <node name="c" pkg="nowhere" type="thing" launch-prefix="nice"/>""",
        "side:=left",
    )
    assert run("extract", tmp_path / "system.launch", "side:=left", "-o", tmp_path / "out") == 0
    system = read_system(tmp_path / "out" / "system.rossystem")
    assert [(c.graph_name, str(c.node)) for c in system.components] == [
        ("left/a", "demo.talker.talker"),
        ("b", "demo.talker.talker"),
        ("c", "nowhere.thing.c"),
    ]
    assert {(c.kind, c.name, str(c.sources[0]), str(c.targets[0])) for c in system.connections} == {
        (ConnectionKind.TOPIC, "left/said", "a.said", "b.left/said"),
        (ConnectionKind.TOPIC, "left/said_back", "b.left/said_back", "a.said_back"),
    }
    assert [(p.key, p.value) for p in system.components[0].parameters] == [("topic", "said")]
    assert [(p.name, p.value) for p in system.parameters] == [("gain", 2)]
    assert "The interfaces of /c are not known: the package nowhere is not installed." in system.header
    assert run("check", tmp_path / "out") == 0


@pytest.mark.parametrize(
    ("text", "arguments", "said"),
    [
        ("<node/>", (), "roslaunch refuses it"),
        ("<param name='x' value='$(arg a)'/>", (), "roslaunch refuses it"),
        ("<include file='$(find nowhere)/x.launch'/>", (), "roslaunch refuses it"),
        ("<include file='/nonexistent.launch'/>", (), "roslaunch refuses it"),
        ("<node", (), "roslaunch refuses it"),
        ("", ("a",), "no NAME:=VALUE"),
        ("\0", (), "not well-formed XML"),
        ("<param name='a' type='int' value='x'/>", (), "roslaunch refuses it"),
        ("<rosparam>a: [</rosparam>", (), "roslaunch"),
        ("<!DOCTYPE a>", (), "not well-formed XML"),
        ("<include file='$(dirname)/system.launch'/>", (), "roslaunch"),
    ],
)
def test_launch_file_that_roslaunch_refuses_is_told_in_one_line(launched, text, arguments, said):
    with pytest.raises(ModelError) as told:
        launched(text, *arguments)
    message = str(told.value).replace("is not NAME:=VALUE", "is no NAME:=VALUE")
    assert said in message and "\n" not in message


@pytest.mark.parametrize("condition", ["1/0", "nothing", "1 +", "'a'.x", "[0][1]"])
def test_launch_file_whose_condition_fails_is_refused_in_one_line(tmp_path, capsys, condition):
    path = tmp_path / "robot.launch"
    path.write_text(f'<launch><group if="$(eval {condition})"/></launch>')
    assert run("extract", path, "-o", tmp_path) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"rosmodel: {path}: roslaunch ")
    assert len(error.splitlines()) == 1


def test_what_a_launch_file_says_and_a_model_can_not_is_listed(tmp_path, monkeypatch):
    make_script(make_package(tmp_path / "demo") / "nodes" / "talker.py")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    path = tmp_path / "robot.launch"
    path.write_text(
        """<launch><group ns="cell"><node pkg="demo" type="talker.py" name="eye" args="--fast _topic:=found x:=y"
            launch-prefix="nice" respawn="true"><env name="A" value="b"/>
            <remap from="heard" to="/ears"/><remap from="~image" to="/camera/image"/></node>
            <node pkg="nowhere" type="tool" name="tool"><remap from="in" to="out"/></node></group></launch>"""
    )
    models = read_launch_file(path)
    (eye, _) = models.system.components
    assert (eye.node.artifact, {port.name for port in eye.ports}) == ("talker.py", {"/ears", "found", "eye/reset"})
    header = models.system.header
    assert remappings_of(header) == {
        "cell/eye": (("eye/image", "/camera/image"), ("x", "y")),
        "cell/tool": (("in", "out"),),
    }
    assert 'Left out: args="--fast", launch-prefix="nice", env="A=b", respawn="true" of /cell/eye' in header


@pytest.mark.parametrize(
    ("imported", "name"),
    [
        ("import demo.msg", "demo.msg.Level"),
        ("from demo.msg import *", "Level"),
        ("from demo.msg import Level", "Level"),
        ("import demo", "demo.msg.Level"),
    ],
)
@pytest.mark.parametrize("has_module", [True, False])
def test_messages_of_the_package_itself_are_known(tmp_path, imported, name, has_module):
    folder = make_package(tmp_path / "other_folder", "demo")
    (folder / "msg").mkdir()
    (folder / "msg" / "Level.msg").write_text("int32 level\n")
    if has_module:
        (folder / "src" / "demo").mkdir(parents=True)
        (folder / "src" / "demo" / "__init__.py").touch()
    make_script(
        folder / "nodes" / "a",
        f"#!/usr/bin/env python3\nimport rospy\n{imported}\nrospy.init_node('a')\nrospy.Publisher('level', {name})\n",
    )
    (artifact,) = extract_package(folder).package.artifacts
    assert [(port.name, port.type) for port in artifact.nodes[0].ports] == [("level", "demo/Level")]


def test_header_keeps_which_types_follow_from_whole_numbers_alone(tmp_path):
    make_package(tmp_path)
    (tmp_path / "nodes").mkdir()
    code = "import rospy\nrospy.init_node('a')\nrospy.get_param('~rate', 10)\nrospy.get_param('~gain', 0.1)\n"
    make_script(tmp_path / "nodes" / "a", f"#!/usr/bin/env python3\n{code}")
    model = extract_package(tmp_path).model()
    assert "Whole numbers alone tell types of demo.a.a: rate." in model.header.splitlines()


NODELET = """
    #include <nodelet/nodelet.h>
    namespace demo {
    class Crop : public nodelet::Nodelet {
      ros::Publisher out_;
      void onInit() override {
        out_ = getNodeHandle().advertise<std_msgs::String>("cropped", 1);
        sub_ = getPrivateNodeHandle().subscribe("input", 1, &Crop::onInput, this);
        getPrivateNodeHandle().param("size", size_, 3);
      }
      void onInput(const std_msgs::String::ConstPtr& text) {}
      ros::Subscriber sub_;
      int size_;
    };
    class Other : public nodelet::Nodelet {
      void onInit() override { getNodeHandle().advertise<std_msgs::String>("of_the_other", 1); }
    };
    }
    """
DESCRIBED = """
    <library path="lib/libdemo_nodelets">
      <class name="demo/crop" type="demo::Crop" base_class_type="nodelet::Nodelet"/>
      <class name="demo/planner" type="demo::Other" base_class_type="nav_core::BaseGlobalPlanner"/>
    </library>
    """


BAD_ENCODINGS = ["nope", "hex", "utf-7", "shift_jis", "idna"]


def make_nodelets(folder: Path, described: str = DESCRIBED) -> Path:
    make_package(folder, cmake="project(demo)\nadd_library(${PROJECT_NAME}_nodelets src/nodelets.cpp)\n")
    manifest = (folder / "package.xml").read_text()
    export = '<export><nodelet plugin="${prefix}/nodelets.xml"/></export></package>'
    (folder / "package.xml").write_text(manifest.replace("</package>", export))
    (folder / "nodelets.xml").write_text(described)
    (folder / "src").mkdir()
    (folder / "src" / "nodelets.cpp").write_text(NODELET)
    return folder


def test_nodelet_is_a_node_with_what_its_class_can_reach(tmp_path):
    extracted = extract_package(make_nodelets(tmp_path))
    assert [artifact.name for artifact in extracted.package.artifacts] == ["crop"]
    (node,) = extracted.package.artifacts[0].nodes
    assert node.name == "crop"
    assert {(p.kind, p.name, p.type) for p in node.ports} == {
        (PortKind.PUBLISHER, "cropped", "std_msgs/String"),
        (PortKind.SUBSCRIBER, "~input", "std_msgs/String"),
    }
    assert [(p.name, p.value) for p in node.parameters] == [("size", 3)]


def test_model_says_how_a_nodelet_is_started(tmp_path):
    header = extract_package(make_nodelets(tmp_path)).model().header
    assert "nodelets.xml:3:1: crop is a nodelet, which is started by nodelet load demo/crop MANAGER" in header


@pytest.mark.parametrize("described", ["<library", "<!DOCTYPE a><library/>", "<other/>"])
def test_descriptions_of_nodelets_that_pluginlib_refuses_have_none(tmp_path, described):
    assert extract_package(make_nodelets(tmp_path, described)).package.artifacts == ()


@pytest.mark.parametrize(
    ("described", "said"),
    [
        ("<a>\n </b>", "nodelets.xml:2:4: not read: mismatched tag: line 2, column 3: save it"),
        ("<!DOCTYPE a>", "nodelets.xml:1:1: not read: a description of plug-ins has no DOCTYPE"),
        ("<library>\n\0", "nodelets.xml:2:1: not read: it is no text but binary"),
        *((f"<?xml version='1.0' encoding='{name}'?><a>\xe4</a>", "nodelets.xml:1:") for name in BAD_ENCODINGS),
    ],
)
def test_description_of_nodelets_that_can_not_be_read_is_said(tmp_path, described, said):
    extracted = extract_package(make_nodelets(tmp_path, described))
    (remark,) = extracted.unread
    assert str(remark).startswith(said) and str(remark) in extracted.model().header


def test_nodelets_that_are_not_there_are_said(tmp_path):
    make_nodelets(tmp_path, DESCRIBED.replace("libdemo_nodelets", "libgone"))
    assert "the nodelet demo/crop: no source of the library gone is known" in str(read_package(tmp_path).remarks)
    (tmp_path / "nodelets.xml").unlink()
    assert "nodelets.xml, which describes nodelets" in str(read_package(tmp_path).remarks)


def test_library_with_several_nodelets_in_one_description(tmp_path):
    more = DESCRIBED.replace("nav_core::BaseGlobalPlanner", "nodelet::Nodelet")
    extracted = extract_package(make_nodelets(tmp_path, f"<class_libraries>{more}</class_libraries>"))
    assert [artifact.name for artifact in extracted.package.artifacts] == ["crop", "planner"]


LOADING = """
    int main(int argc, char** argv) {
      ros::init(argc, argv, "both");
      nodelet::Loader loader(false);
      nodelet::M_string names;
      names["cropped"] = "out";
      loader.load(ros::this_node::getName(), "demo/crop", names, nodelet::V_string());
      loader.load("/other", "demo/crop", names, nodelet::V_string());
      loader.load("third", "gone/nodelet", names, nodelet::V_string());
    }
    """


def test_program_has_the_interfaces_of_the_nodelets_that_it_loads(tmp_path):
    make_nodelets(tmp_path)
    (tmp_path / "CMakeLists.txt").write_text(
        "project(demo)\nadd_library(demo_nodelets src/nodelets.cpp)\nadd_executable(both src/both.cpp)\n"
    )
    (tmp_path / "src" / "both.cpp").write_text(LOADING)
    extracted = extract_package(tmp_path)
    node = extracted.package.artifacts[0].nodes[0]
    assert {port.name for port in node.ports} == {"out", "~input", "/other/input"}
    assert {parameter.name for parameter in node.parameters} == {"size", "/other/size"}
    assert "it loads the nodelet gone/nodelet, whose source is not here" in str(extracted.nodes["both"].remarks)


def make_workspace(folder: Path, monkeypatch) -> tuple[Path, Path]:
    """Make two packages: a library, and a program that uses its class and a plug-in of it."""
    library = make_package(folder / "maps", "maps")
    (library / "include" / "maps").mkdir(parents=True)
    (library / "include" / "maps" / "store.h").write_text("namespace maps { class Store { public: Store(); }; }\n")
    (library / "src").mkdir()
    (library / "src" / "store.cpp").write_text(
        '#include "maps/store.h"\nmaps::Store::Store() {\n'
        'ros::NodeHandle nh; nh.advertise<std_msgs::String>("stored", 1); }\n'
    )
    (library / "src" / "layer.cpp").write_text(
        "PLUGINLIB_EXPORT_CLASS(maps::Layer, maps::Base)\n"
        "class Layer : public maps::Base {\n"
        ' void start() { ros::NodeHandle nh; nh.subscribe<std_msgs::String>("layer", 1, f); }\n};\n'
    )
    program = make_package(folder / "robot", "robot", "project(robot)\nadd_executable(robot src/main.cpp)\n")
    (program / "src").mkdir()
    (program / "src" / "main.cpp").write_text(
        "#include <maps/store.h>\n"
        "int main(int argc, char** argv) {\n"
        'ros::init(argc, argv, "robot"); maps::Store store;\n'
        'pluginlib::ClassLoader<maps::Base> loader("maps", "maps::Base"); loader.createInstance("maps::Layer"); }\n'
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(folder))
    return library, program


def test_code_and_plugins_of_other_packages_in_the_workspace_are_followed(tmp_path, monkeypatch):
    _, program = make_workspace(tmp_path, monkeypatch)
    extracted = extract_package(program)
    (node,) = extracted.package.artifacts[0].nodes
    assert {port.name: port.position.file for port in node.ports} == {
        "stored": "maps/src/store.cpp",
        "layer": "maps/src/layer.cpp",
    }


def test_package_that_is_not_in_the_workspace_is_not_followed(tmp_path, monkeypatch):
    _, program = make_workspace(tmp_path, monkeypatch)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(program))
    assert extract_package(program).package.artifacts[0].nodes[0].ports == ()
