"""Models for the eye: the tree, the graph, and what the shell completes."""

import os
import subprocess
import sys
import xml.etree.ElementTree as ET

import cv2
import pytest
from ros_model.cli.rosmodel import main
from ros_model.io.drawing import dot
from ros_model.io.files import resolve
from ros_model.language.system_reader import parse_system

SYSTEM = """RosSystem { Name robot RosComponents (
    ComponentInterface { name laser NameSpace front FromRosNode 'p.laser.laser'
        RosPublishers { RosPublisher out { RefPublisher 'p.laser.laser.scan' } }
        RosParameters { RosParameter r { RefParameter 'p.laser.laser.rate' value 5 } } }
    ComponentInterface { name nav
        RosSubscribers { RosSubscriber in { RefSubscriber 'p.nav.nav.in' }, RosSubscriber '/odom' { } }
        RosSrvClients { RosServiceClient plan { } } }
    ComponentInterface { name base
        RosPublishers { RosPublisher odom { } } RosSrvServers { RosServiceServer plan { } } } )
    TopicConnections { TopicConnection scan { From ( 'laser.out' ) To ( 'nav.in' ) } }
    Parameters { Parameter { name qa_speed type Double value 0.5 } } }"""
PACKAGES = """PackageSet { CatkinPackage p { Specs { TopicSpec T { message { int8[] a } } } Artifact a { Node {
    name n Publishers { Publisher { name 'x[bold]' message 'std_msgs.String' } }
    Parameters { Parameter { name r type Double } }
} } Dependencies { PackageDependency roscpp } } }"""


@pytest.fixture
def show(capsys, tmp_path):
    def run(text, *arguments, name="m.rossystem"):
        (tmp_path / name).write_text(text)
        with pytest.raises(SystemExit) as done:
            main(["show", str(tmp_path / name), *map(str, arguments)])
        captured = capsys.readouterr()
        return done.value.code, captured.out, captured.err

    return run


def test_tree_of_a_system(show):
    status, out, _ = show(SYSTEM)
    assert status == 0
    assert [line.strip("│├└─ ") for line in out.splitlines()] == [
        "robot",
        "front/laser  p.laser.laser",
        "publisher out",
        "parameter rate = 5",
        "nav  p.nav.nav",
        "subscriber in",
        "subscriber /odom",
        "service client plan",
        "base",
        "publisher odom",
        "service server plan",
        "topic scan: laser.out -> nav.in",
        "parameter qa_speed  Double = 0.5",
    ]


def test_tree_of_packages_takes_no_name_for_markup(show):
    status, out, _ = show(PACKAGES, name="m.ros")
    assert status == 0
    assert [line.strip("│├└─ ") for line in out.splitlines()] == [
        "m.ros",
        "package p",
        "artifact a",
        "node n",
        "publisher x[bold]  std_msgs/String",
        "parameter r  Double",
        "topic T; message: int8[] a",
        "depends on roscpp",
    ]


def test_tree_of_a_hostile_name_commands_no_terminal(show):
    assert "\x1b" not in show("RosSystem { Name '\\u001b[2J' }")[1]


def test_graph_has_connections_and_ports_of_one_name():
    text = dot(parse_system(SYSTEM))
    labels = {
        line.split()[0]: line.split('label="')[1].split('"')[0] for line in text.splitlines() if " [label=" in line
    }
    edges = {
        tuple(part.strip() for part in line.split(" [")[0].rstrip(";").split("->"))
        for line in text.splitlines()
        if "->" in line
    }
    topics = {name: label for name, label in labels.items() if name.startswith("t")}
    by_label = {label: name for name, label in topics.items()}
    assert set(topics.values()) == {"scan", "odom", "plan"}
    assert edges == {
        ('"component laser"', by_label["scan"]),
        (by_label["scan"], '"component nav"'),
        ('"component base"', by_label["odom"]),
        (by_label["odom"], '"component nav"'),
        ('"component base"', by_label["plan"]),
        (by_label["plan"], '"component nav"'),
    }


def drawn(path, tag):
    return [element.text for element in ET.parse(path).iter(f"{{http://www.w3.org/2000/svg}}{tag}")]  # noqa: S314 (own)


def test_graph_is_drawn_as_svg(show, tmp_path):
    assert show(SYSTEM, "--graph", tmp_path / "g.svg") == (0, "", "")
    texts = drawn(tmp_path / "g.svg", "text")
    assert {"robot", "front/laser", "nav", "scan", "odom"} <= set(texts)


def test_graph_is_drawn_as_png(show, tmp_path):
    assert show(SYSTEM, "--graph", tmp_path / "g.png") == (0, "", "")
    picture = cv2.imread(str(tmp_path / "g.png"))
    assert min(picture.shape[:2]) > 100
    assert len({tuple(pixel) for pixel in picture.reshape(-1, 3)}) > 3


def edges_of(path):
    text = path.read_text()
    return {
        tuple(part.strip() for part in line.split(" [")[0].split("->")) for line in text.splitlines() if "->" in line
    }


def project_of(package):
    return str(resolve(f"package://{package}/models"))


def test_project_is_drawn_as_its_hierarchy(tmp_path):
    path = tmp_path / "h.dot"
    with pytest.raises(SystemExit) as done:
        main(["show", project_of("metacontrol_manipulation"), "--graph", str(path)])
    assert done.value.code == 0
    text, edges = path.read_text(), edges_of(path)
    design = {name: line.split()[0] for line in text.splitlines() for name in ("fd1_1", "fd2_1") if f'"{name}"' in line}
    assert ('"function f_move_position"', design["fd1_1"]) in edges
    assert (design["fd1_1"], '"function f_calibrate_position"') in edges
    assert (design["fd2_1"], '"environment light"') in edges
    assert '"fd1_left\\nfd1_right"' in text  # they require the same
    assert '"hand\\n1 of left_arm, right_arm"' in text
    assert '"o_calibrate_position\\nwhen required\\ntag_share: 0.1"' in text


def test_many_designs_that_require_the_same_are_drawn_as_one(tmp_path):
    path = tmp_path / "h.dot"
    with pytest.raises(SystemExit):
        main(["show", f"{project_of('metacontrol_sim')}/metacontrol.yaml", "--graph", str(path)])
    assert "more" in path.read_text()
    assert ('"component camera"', '"environment light"') in edges_of(path)


def test_names_do_not_break_out_of_the_graph(show, tmp_path):
    name = '"]; evil [label="x\\\\'
    assert (
        show(
            f"RosSystem {{ Name '{name}' RosComponents ( ComponentInterface {{ name '{name}' }} ) }}",
            "--graph",
            tmp_path / "g.svg",
        )[0]
        == 0
    )
    assert "evil" not in drawn(tmp_path / "g.svg", "title")


@pytest.mark.parametrize(("graph", "message"), [("g.bmp", "graphs are drawn as .svg"), ("no/g.svg", "No such file")])
def test_graph_that_can_not_be_drawn_is_told(show, tmp_path, graph, message):
    status, _, err = show(SYSTEM, "--graph", tmp_path / graph)
    assert status == 2
    assert message in err


def test_graph_without_graphviz_says_what_to_install(show, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    status, _, err = show(SYSTEM, "--graph", tmp_path / "g.svg")
    assert status == 2
    assert "install Debian's package 'graphviz'" in err
    assert show(SYSTEM, "--graph", tmp_path / "g.dot")[0] == 0


def test_packages_have_no_graph(show, tmp_path):
    assert show(PACKAGES, "--graph", tmp_path / "g.svg", name="m.ros")[0] == 2


def complete(line, folder):
    """Return what bash would be offered at the end of a line."""
    words = line.split(" ")
    environment = {
        **os.environ,
        "_ROSMODEL_COMPLETE": "bash_complete",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
    }
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    script = "import sys; sys.argv[0] = 'rosmodel'; from ros_model.cli.rosmodel import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return [tuple(entry.split(",", 1)) for entry in done.stdout.splitlines()]


def test_shell_completes_commands_options_and_choices(tmp_path):
    assert ("plain", "check") in complete("rosmodel ch", tmp_path)
    assert ("plain", "--path") in complete("rosmodel check --p", tmp_path)
    assert complete("rosmodel check --format s", tmp_path) == [("plain", "sarif")]
    assert complete("rosmodel check m", tmp_path) == [("file", "m")]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shell_gets_its_completion_script(shell):
    environment = {**os.environ, "_ROSMODEL_COMPLETE": f"{shell}_source", "PYTHONPATH": os.pathsep.join(sys.path)}
    script = "import sys; sys.argv[0] = 'rosmodel'; from ros_model.cli.rosmodel import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True, timeout=60
    )
    assert "_ROSMODEL_COMPLETE" in done.stdout


def test_every_command_has_a_complete_help():
    from ros_model.cli.rosmodel import command

    context = command.make_context("rosmodel", ["--help"], resilient_parsing=True)
    for name in command.list_commands(context):
        found = command.get_command(context, name)
        assert found.help, name
        assert all(option.help for option in found.params if option.param_type_name == "option"), name
