"""The command rosmodel: exit status, and one line for every failure."""

import json
import re
import sys
from pathlib import Path

import pytest
from ros_model.io.models import read_system

GOOD = "RosSystem { Name good }\n"
FAULTY = "RosSystem { Name bad TopicConnections { TopicConnection t { From ( 'a.b' ) To ( 'c.d' ) } } }\n"


@pytest.fixture
def model(tmp_path):
    def write(text, name="m.rossystem"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_version_is_that_of_the_package(run):
    package = Path(__file__).parents[4] / "catkin_ws/src/ros_model/package.xml"
    version = re.search("<version>(.*)</version>", package.read_text())[1]
    assert run("--version") == (0, f"rosmodel {version}\n", "")


def test_version_needs_the_package(run, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/nowhere")
    monkeypatch.delenv("ROS_ROOT", raising=False)
    assert run("--version") == (2, "", "rosmodel: no package ros_model: source the workspace that holds it\n")


@pytest.mark.parametrize("command", [["show"], ["show", "--graph", "x.svg"], ["diff", "m.rossystem"]])
def test_folder_is_refused_where_a_file_is_needed(run, model, tmp_path, monkeypatch, command):
    model(GOOD)
    (tmp_path / "models").mkdir()
    monkeypatch.chdir(tmp_path)
    expected = "rosmodel: models: is a folder: give a .rossystem or .ros file\n"
    assert run(*command, "models") == (2, "", expected)


def test_check_of_a_good_file_says_so(run, model):
    assert run("check", model(GOOD)) == (0, "nothing is wrong\n", "")


def test_check_of_a_faulty_file_names_the_place(run, model):
    path = model(FAULTY)
    status, out, _ = run("check", path)
    assert status == 1
    assert f"{path}:1:68: error: connection 't': 'a.b' names no component" in out


def test_check_goes_on_after_a_file_that_can_not_be_read(run, model):
    status, out, err = run("check", model("RosSystem", "broken"), model(FAULTY))
    assert (status, err) == (2, "")
    assert "broken:1:10: error: expected '{'" in out
    assert "connection 't'" in out


def test_broken_file_that_was_not_asked_for_is_a_warning(run, model):
    path = model(GOOD, "bom.rossystem")
    other = model("PackageSet { CatkinPackage p { Colour red Artifact a { Node { nam n } } } }", "open.ros")
    warning = f"warning: {other} can't be read: 2 errors; its packages are unknown: check it by itself\n"
    assert run("check", path) == (0, warning, "")
    assert run("check", "--path", path.parent, path) == (0, warning, "")


@pytest.mark.parametrize("order", [("bom.rossystem", "open.ros"), ("open.ros", "bom.rossystem"), (".",)])
def test_broken_file_that_was_asked_for_is_told_with_its_own_errors_only(run, model, order):
    folder = model(GOOD, "bom.rossystem").parent
    model("PackageSet {", "open.ros")
    status, out, _ = run("check", *(folder / name for name in order))
    assert (status, "open.ros:1:" in out, "warning" in out) == (2, True, False)


@pytest.fixture
def project(model):
    settings = """package: p
base: base.rossystem
variants: {table: table.csv, qa: qa.csv}
functions: {f: {designs: all}}
quality_attributes: {safety: {direction: lower_is_better, range: [0, 1]}}
utility: safety
objectives: {o: {function: f}}
"""
    model(
        "RosSystem { Name base RosComponents ( ComponentInterface { name nav FromRosNode 'p.nav.nav' } ) }",
        "base.rossystem",
    )
    model("PackageSet { CatkinPackage p { Artifact nav { Node { name nav } } } }", "p.ros")
    model("name,nav.speed\na,1\nb,2\n", "table.csv")
    model("name,safety\na,0.1\nb,0.2\n", "qa.csv")
    return model(settings, "metacontrol.yaml")


@pytest.mark.parametrize(
    ("name", "change", "rule", "message"),
    [
        ("metacontrol.yaml", ("utility: safety", "utility: speed"), "settings", "'speed' is none of quality_attr"),
        ("metacontrol.yaml", ("package: p", "packages: p"), "settings", "packages: unknown key"),
        ("metacontrol.yaml", ("designs: all", "designs: [c]"), "settings", "'c' is none of the 2 variants"),
        ("metacontrol.yaml", ("{table", "{component: arm, table"), "settings", "'arm' is no component"),
        ("table.csv", ("nav.speed", "speed"), "table", "nothing says what column 'speed' sets"),
        ("table.csv", ("b,2", "a,2"), "table", "name 'a' stands twice"),
        ("qa.csv", ("b,0.2\n", ""), "table", "no row for b"),
        ("qa.csv", ("b,0.2", "b,0.2\nc,0.3"), "table", "'c' is none of the 2 variants"),
        ("qa.csv", ("0.2", "7"), "level", "b expects 7 of 'safety', whose range is [0, 1]"),
    ],
)
def test_project_that_reads_well_but_is_wrong_ends_with_status_1(run, project, name, change, rule, message):
    path = project.parent / name
    path.write_text(path.read_text().replace(*change))
    status, out, _ = run("check", "--format", "json", project.parent)
    findings = json.loads(out)
    assert status == 1
    assert rule in {finding["rule"] for finding in findings if message in finding["message"]}


TWO_FUNCTIONS = """package: p
base: base.rossystem
variants:
  - {component: nav, table: table.csv, qa: qa.csv}
  - {component: arm, table: grips.csv}
functions: {f: {designs: [a, b]}, f_grip: {designs: [soft, hard]}}
quality_attributes: {safety: {direction: lower_is_better, range: [0, 1]}}
utility: safety
objectives: {o: {function: f}}
"""


def test_qualities_are_demanded_of_the_designs_of_one_function_only(run, project, model):
    model(TWO_FUNCTIONS, "metacontrol.yaml")
    arm = ", ComponentInterface { name arm FromRosNode 'p.arm.arm' } )"
    base = project.parent / "base.rossystem"
    base.write_text(base.read_text().replace(" )", arm))
    parameter = "Parameters { Parameter { name speed type Integer } }"
    nodes = (f"Artifact {name} {{ Node {{ name {name} {parameter} }} }}" for name in ("nav", "arm"))
    model(f"PackageSet {{ CatkinPackage p {{ {', '.join(nodes)} }} }}", "p.ros")
    model("name,arm.speed\nsoft,1\nhard,2\n", "grips.csv")
    status, out, _ = run("check", project.parent)
    assert (status, "safety" in out) == (0, False)
    assert run("generate", "all", project.parent, "-o", project.parent / "out")[0] == 0
    model(TWO_FUNCTIONS.replace("grips.csv}", "grips.csv, qa: qa2.csv}"), "metacontrol.yaml")
    model("name,safety\nsoft,\nhard,\n", "qa2.csv")
    assert run("check", project.parent)[0] == 0
    model("name,safety\nsoft,0.3\nhard,\n", "qa2.csv")
    status, out, _ = run("check", project.parent)
    assert status == 1
    assert "variant 'hard' has no value for 'qa_safety', as 'soft' has: add one" in out


@pytest.mark.parametrize(("name", "text"), [("metacontrol.yaml", "a: b: c"), ("qa.csv", 'name,"'), ("p.ros", "x")])
def test_project_that_can_not_be_read_ends_with_status_2(run, project, name, text):
    assert run("check", project.parent)[0] == 1  # its parameter is in no model
    (project.parent / name).write_text(text)
    status, out, _ = run("check", project.parent)
    assert (status, f"{name}:1:" in out) == (2, True)


@pytest.mark.parametrize("text", ["", "\x00\xff", "{" * 100_000, "RosSystem { Name 'x"])
def test_bad_file_ends_with_its_place_and_status_2(run, model, text):
    path = model(text)
    assert f"{path}:1:" in run("check", path)[1]
    for command in (["format"], ["show"]):
        status, _, err = run(*command, path)
        assert status == 2
        assert err.startswith(f"rosmodel: {path}:1:")
        assert len(err) < 1000


def test_hostile_names_break_no_line_and_command_no_terminal(run, model):
    name = r"'a\n\u001b[2J\ud800'"
    component = f"ComponentInterface {{ name {name} }}"
    path = model(f"RosSystem {{ Name x RosComponents ( {component}, {component} ) }}")
    status, out, _ = run("check", path)
    assert status == 1
    assert r"error: component 'a\n\x1b[2J\ud800' stands twice" in out
    assert "\x1b" not in out
    other = model("RosSystem { Name x }", "other.rossystem")
    assert run("diff", path, other)[1] == "- component 'a\\n\\x1b[2J\\ud800'\n"
    for form in ("github", "json", "sarif"):
        assert "\x1b" not in run("check", "--format", form, path)[1]


def test_errors_are_shown_in_their_lines(run, model):
    path = model("RosSystem {\n\tName x\n\tColour red\n\tParameters { Parameter { nam y } }\n}\n")
    status, _, err = run("show", path)
    assert status == 2
    lines = err.splitlines()
    assert lines[0].startswith(f"rosmodel: {path}:3:2: expected ")
    assert lines[1:3] == ["    \tColour red", "    \t^~~~~~"]
    assert lines[3].endswith("near 'nam': did you mean 'name'?")
    assert lines[4:] == ["    \tParameters { Parameter { nam y } }", "    \t                         ^~~"]


def test_format_writes_the_canonical_form_once(run, model):
    path = model("// kept\nRosSystem{Name good}")
    assert run("format", "--check", path)[0] == 1
    assert run("format", path)[0] == 0
    assert path.read_text() == "// kept\nRosSystem {\n    Name 'good'\n}\n"
    assert run("format", "--check", path) == (0, "", "")


def test_show_names_components_and_parameters(run, model):
    path = model(
        "RosSystem { Name s RosComponents ( ComponentInterface { name arm FromRosNode 'p.a.n' RosParameters {"
        " RosParameter r { RefParameter 'p.a.n.rate' value 5 } } } ) }"
    )
    _, out, _ = run("show", path)
    assert "arm" in out
    assert "rate = 5" in out


def test_unknown_generator_is_refused(run, tmp_path):
    models = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/models"
    status, _, err = run("generate", "poems", models, "-o", tmp_path)
    assert status == 2
    assert "no generator 'poems'" in err


def test_folder_without_a_project_is_refused(run, tmp_path):
    status, _, err = run("generate", "launch", tmp_path, "-o", tmp_path)
    assert status == 2
    assert "metacontrol.yaml: No such file" in err


def test_missing_argument_is_refused(run):
    assert run("generate", "launch")[0] == 2


def test_package_outside_adds_a_generator(run, tmp_path, monkeypatch):
    source = tmp_path / "src" / "poetry"
    source.mkdir(parents=True)
    (source / "package.xml").write_text(
        "<package format='2'><name>poetry</name><version>0.0.1</version><description>x</description>"
        "<maintainer email='a@b.example'>a</maintainer><license>x</license><exec_depend>ros_model</exec_depend>"
        "<export><ros_model generator='poems' function='poetry_generator:write'/></export></package>"
    )
    (tmp_path / "poetry_generator.py").write_text(
        "def write(project, output):\n"
        "    path = output / 'poem.txt'\n"
        "    path.write_text(project.base.name)\n"
        "    return [path]\n"
    )
    package = Path(__file__).parents[4] / "catkin_ws" / "src"
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{source.parent}:{package}")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    status, out, err = run("generate", "poems", package / "metacontrol_sim" / "models", "-o", tmp_path)
    assert (status, err) == (0, "")
    assert out.startswith("poems: 1 file")
    assert (tmp_path / "poem.txt").read_text() == "d2"


def test_generated_variant_reads_back(run, tmp_path):
    models = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/models"
    assert run("generate", "variants", models, "-o", tmp_path)[0] == 0
    assert read_system(tmp_path / "models/variants/f2_v2_r2.rossystem").name == "f2_v2_r2"
