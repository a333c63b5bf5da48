"""`rosmodel init`: a first metacontrol.yaml that checks clean as it is, and never takes the place of one."""

import errno
import io
import itertools
import os
import subprocess
from pathlib import Path

import pytest
import yaml
from ros_model.io.project import load_project

D2 = Path(__file__).parents[4] / "catkin_ws" / "src" / "metacontrol_sim" / "models" / "d2.rossystem"
ARM = """RosSystem { Name 'Arm-7 "x"'
    RosComponents (
        ComponentInterface { name cell FromRosNode 'p.cell.cell' RosPublishers { RosPublisher light { RefPublisher 'p.cell.cell.light' } } },
        ComponentInterface { name arm NameSpace left FromRosNode 'p.arm.arm'
            RosActionServers { RosActionServer move { RefServer 'p.arm.arm.move' } }
            RosParameters {
                RosParameter speed { RefParameter 'p.arm.arm.limits/speed' value 0.5 },
                RosParameter speed { RefParameter 'p.arm.arm.other/speed' value 1 },
                RosParameter on { RefParameter 'p.arm.arm.on' value true },
                RosParameter id { RefParameter 'p.arm.arm.id' value '15' },
                RosParameter tool { RefParameter 'p.arm.arm.tool' value 'a, "b"' },
                RosParameter joints { RefParameter 'p.arm.arm.joints' value { 1, 2 } },
                RosParameter rate { RefParameter 'p.arm.arm.rate' } } } ) }"""  # noqa: E501


@pytest.fixture
def base(tmp_path):
    def write(text, name="base.rossystem"):
        folder = tmp_path / "my_robot" / "models"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
        return folder / name

    return write


@pytest.mark.parametrize(
    "text", [D2.read_text(), ARM, ARM.replace("name arm", "name 'arm'").replace("left", "'/left'")]
)
def test_first_project_checks_clean_and_generates(run, base, text):
    path = base(text)
    assert run("init", path)[0] == 0
    assert run("check", path.parent)[0] == 0
    status, out, _ = run("generate", "all", path.parent, "-o", path.parent.parent)
    assert status == 0
    assert "launch: 1 file" in out


def test_what_varies_is_what_acts_or_what_is_said(run, base):
    assert run("init", base(D2.read_text()))[0] == 0
    project = load_project(base(D2.read_text()).parent)
    assert project.settings["variants"]["component"] == "move_base"
    other = base(D2.read_text()).parent.parent / "other.rossystem"
    other.write_text(D2.read_text())
    named = ("--package", "mine", "-o", other.parent)
    assert run("init", other, "--component", "camera", *named, "--qa", "safety", "--qa", "energy")[0] == 0
    settings = yaml.safe_load((other.parent / "mine" / "models" / "metacontrol.yaml").read_text())
    assert (settings["variants"]["component"], settings["package"]) == ("camera", "mine")
    assert list(settings["quality_attributes"]) == ["safety", "energy", "performance"]


def test_table_has_the_values_of_the_base(run, base):
    path = base(ARM)
    assert run("init", path)[0] == 0
    header, row = (path.parent / "variants.csv").read_text().splitlines()
    assert header == "name,speed,other/speed,on,tool"
    assert row == 'arm_7_x_default,0.5,1,true,"a, ""b"""'
    (variant,) = load_project(path.parent).variants
    (arm,) = variant.components
    values = {parameter.key: parameter.value for parameter in arm.parameters}
    assert values == {
        "limits/speed": 0.5,
        "other/speed": 1,
        "on": True,
        "tool": 'a, "b"',
        "id": "15",
        "joints": [1, 2],
        "rate": None,
    }


@pytest.mark.parametrize("keys", list(itertools.permutations(["DWA/freq", "freq", "nav/freq", "nav/nav/freq"])))
def test_each_parameter_has_a_column_whatever_the_others_are_called(run, base, keys):
    parameters = ", ".join(
        f"RosParameter p{number} {{ RefParameter 'p.nav.nav.{key}' value {number} }}" for number, key in enumerate(keys)
    )
    nav = f"ComponentInterface {{ name nav FromRosNode 'p.nav.nav' RosParameters {{ {parameters} }} }}"
    path = base(f"RosSystem {{ Name x RosComponents ( {nav} ) }}")
    assert run("init", path)[0] == 0
    columns = yaml.safe_load((path.parent / "metacontrol.yaml").read_text())["variants"]["parameters"]
    assert sorted(key for (key,) in columns.values()) == sorted(keys)
    assert columns["freq"] == ["freq"]
    assert run("check", path.parent)[0] == 0


def test_package_is_the_one_around_the_models(run, base):
    path = base(ARM)
    (path.parent.parent / "package.xml").write_text(
        "<package format='2'><name>arm_models</name><version>0.1.0</version><description>x</description>"
        "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
    )
    assert run("init", path)[0] == 0
    assert load_project(path.parent).package == "arm_models"


def test_package_is_named_by_its_folder_without_a_package_xml(run, base):
    path = base(ARM)
    assert run("init", path)[0] == 0
    assert load_project(path.parent).package == "my_robot"


@pytest.mark.parametrize("name", ["metacontrol.yaml", "variants.csv", "qa.csv"])
def test_nothing_is_overwritten(run, base, name):
    path = base(ARM)
    (path.parent / name).write_text("mine")
    status, _, err = run("init", path)
    assert status == 2
    assert f"{path.parent / name}: is there already" in err
    assert sorted(file.name for file in path.parent.iterdir()) == sorted(["base.rossystem", name])
    assert (path.parent / name).read_text() == "mine"


def test_folder_in_place_of_the_base_is_refused(run, tmp_path):
    status, _, err = run("init", tmp_path)
    assert (status, err) == (2, f"rosmodel: {tmp_path}: is a folder: give the .rossystem file of the base system\n")


def test_file_that_can_not_be_written_is_told_by_its_own_name(run, base, monkeypatch):
    def refuse(*_arguments, **_options):
        raise PermissionError(errno.EACCES, "Permission denied")

    path = base(ARM)
    monkeypatch.setattr(os, "replace", refuse)
    status, _, err = run("init", path)
    written = path.parent / "metacontrol.yaml"
    assert (status, err) == (2, f"rosmodel: {written}: can't be written (Permission denied): check its folder\n")


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        ("RosSystem { Name empty }", [], "base.rossystem:1:1: has no component with a FromRosNode"),
        (ARM, ["--component", "leg"], "'leg' is no component with a FromRosNode; there are cell, arm"),
        (ARM, ["--package", "../up"], "--package '../up' is no name"),
        (ARM, ["--qa", "a b"], "--qa 'a b' is no name"),
        ("RosSystem {", [], "base.rossystem:1:12"),
    ],
)
def test_what_can_not_become_a_project_is_refused(run, base, text, arguments, message):
    path = base(text)
    status, _, err = run("init", path, *arguments)
    assert status == 2
    assert message in err
    assert [file.name for file in path.parent.iterdir()] == ["base.rossystem"]


TWO_CELLS = """RosSystem { Name cells RosComponents ( CELLS ) TopicConnections {
    TopicConnection 'left/image' { From ( 'left/camera.image' ) To ( 'left/picker.image' ) },
    TopicConnection 'right/image' { From ( 'right/camera.image' ) To ( 'right/picker.image' ) } } }""".replace(
    "CELLS",
    ",".join(
        f"""ComponentInterface {{ name '{side}/camera' FromRosNode 'p.camera.py.camera'
            RosPublishers {{ RosPublisher image {{ RefPublisher 'p.camera.py.camera.image' }} }} }},
        ComponentInterface {{ name '{side}/picker' FromRosNode 'p.picker.py.picker'
            RosSubscribers {{ RosSubscriber image {{ RefSubscriber 'p.picker.py.picker.image' }} }}
            RosParameters {{ RosParameter speed {{ RefParameter 'p.picker.py.picker.speed' value 0.5 }} }} }}"""
        for side in ("left", "right")
    ),
)


def test_both_copies_of_two_robots_are_components_and_what_varies_is_said(run, base):
    path = base(TWO_CELLS, "cells.rossystem")
    status, out, _ = run("init", path)
    assert status == 0
    settings = yaml.safe_load((path.parent / "metacontrol.yaml").read_text())
    assert settings["components"] == {name: {"node": name} for name in ("left/camera", "right/camera", "right/picker")}
    assert "right/picker runs the same executable as left/picker. Only left/picker varies" in out
    assert run("check", path.parent)[0] == 0
    assert run("generate", "all", path.parent, "-o", path.parent.parent)[0] == 0
    assert load_project(path.parent).required_components() == {"cells_default": {"left/camera"}}


def test_copies_told_apart_by_their_namespaces_are_both_components(run, base):
    text = TWO_CELLS.replace("name 'left/", "name 'left_").replace("'left/", "'left_")
    for name in ("camera", "picker"):
        text = text.replace(f"name 'left_{name}'", f"name {name} NameSpace left")
        text = text.replace(f"name 'right/{name}'", f"name {name} NameSpace right")
    path = base(text[: text.index("TopicConnections")] + "}", "cells.rossystem")
    assert run("init", path)[0] == 0
    settings = yaml.safe_load((path.parent / "metacontrol.yaml").read_text())
    assert set(settings["components"]) == {"left/camera", "right/camera", "right/picker"}


WELDER = """RosSystem { Name line RosComponents (
    ComponentInterface { name welder NameSpace cell_2 FromRosNode 'w.welder.welder'
        RosSubscribers { RosSubscriber seam { RefSubscriber 'w.welder.welder.seam' } }
        RosParameters { PARAMETERS } },
    ComponentInterface { name finder NameSpace cell_2 FromRosNode 'w.finder.finder'
        RosPublishers { RosPublisher seam { RefPublisher 'w.finder.finder.seam' } }
        RosParameters { RosParameter gain { RefParameter 'w.finder.finder.gain' value 2.0 } } } )
    TopicConnections { TopicConnection 'cell_2/seam' { From ( 'finder.seam' ) To ( 'welder.seam' ) } } }""".replace(
    "PARAMETERS",
    ",".join(
        f"RosParameter '{name}' {{ RefParameter 'w.welder.welder.{name}' value {number}.5 }}"
        for number, name in enumerate(["arc/current", "arc/voltage", *(f"limit_{number}" for number in range(8))])
    ),
)
SOURCES = """PackageSet { CatkinPackage w {
    Artifact finder { Node finder { Publishers { Publisher seam { message 'sensor_msgs.Image' } }
        Parameters { Parameter { name gain type Double } } } },
    Artifact 'laser_finder.py' { Node laser { Publishers { Publisher line { message 'sensor_msgs.Image' } }
        Parameters { Parameter { name 'power' type Double } } } },
    Artifact two { Node two { Publishers {
        Publisher left { message 'sensor_msgs.Image' }, Publisher right { message 'sensor_msgs.Image' } } } },
    Artifact sound { Node sound { Publishers { Publisher seam { message 'std_msgs.String' } } } },
    Artifact welder { Node welder { Subscribers { Subscriber seam { message 'sensor_msgs.Image' } }
        Parameters { NAMES } } } } }""".replace(
    "NAMES",
    ",".join(
        f"Parameter {{ name '{name}' type Double }}"
        for name in ("arc/current", "arc/voltage", *(f"limit_{number}" for number in range(8)))
    ),
)


def columns_of(folder):
    return (folder / "variants.csv").read_text().splitlines()[0].split(",")[1:]


def test_many_parameters_are_no_columns_unless_asked_for(run, base):
    path = base(WELDER)
    status, out, _ = run("init", path, "--component", "welder")
    assert (status, columns_of(path.parent)) == (0, [])
    assert "10 parameters of cell_2/welder are no column: arc/current, arc/voltage," in out
    assert "--vary 'cell_2/welder/arc/current'" in out
    assert run("check", path.parent)[0] == 0


@pytest.mark.parametrize(
    ("patterns", "columns"),
    [
        (["cell_2/welder/arc/*"], ["current", "voltage"]),
        (["limit_[01]", "arc/current"], ["limit_0", "limit_1", "current"]),
        (["finder/gain", "welder/arc/voltage"], ["gain", "voltage"]),
    ],
)
def test_parameters_that_vary_are_columns_also_those_of_other_components(run, base, patterns, columns):
    path = base(WELDER)
    options = [word for pattern in patterns for word in ("--vary", pattern)]
    assert run("init", path, "--component", "cell_2/welder", *options)[0] == 0
    assert columns_of(path.parent) == columns
    assert run("check", path.parent)[0] == 0
    assert run("generate", "all", path.parent, "-o", path.parent.parent)[0] == 0


def test_pattern_that_fits_nothing_is_refused(run, base):
    path = base(WELDER)
    status, _, err = run("init", path, "--component", "welder", "--vary", "wleder/*")
    assert status == 2
    assert "--vary 'wleder/*' fits no parameter that a table can hold; there are cell_2/welder/arc/current," in err


def test_executables_with_the_same_outputs_are_offered_and_become_variants(run, base):
    path = base(WELDER)
    (path.parent / "w.ros").write_text(SOURCES)
    offer = "w/laser_finder.py publishes and serves what cell_2/finder does"
    arguments = ("init", path, "--component", "finder", "-o", path.parent.parent.parent, "--package", "line")
    status, out, err = run(*arguments, "--alternative", "w/laser_finder.py")
    assert status == 0, err
    assert "w/two" not in out
    assert "w/sound" not in out
    models = path.parent.parent.parent / "line" / "models"
    project = load_project(models)
    (variant,) = (variant for variant in project.variants if variant.name == "line_laser_finder")
    (finder,) = variant.components
    assert (finder.graph_name, str(finder.executable)) == ("cell_2/finder", "w.laser_finder.py.laser")
    assert [(port.name, port.reference.name) for port in finder.ports] == [("seam", "line")]
    launch = (models.parent / "launch" / "variants" / "line_laser_finder.launch").read_text()
    assert 'type="laser_finder.py"' in launch
    assert 'ns="cell_2"' in launch
    assert '<remap from="line" to="/cell_2/seam" />' in launch
    assert offer in run("init", path, "--component", "finder")[1]


def test_executable_without_the_outputs_is_no_alternative(run, base):
    path = base(WELDER)
    (path.parent / "w.ros").write_text(SOURCES)
    status, _, err = run("init", path, "--component", "finder", "--alternative", "w/sound")
    assert status == 2
    assert (
        "--alternative 'w/sound' does not publish and serve all that cell_2/finder does; there are w/laser_finder.py"
        in err
    )


def test_new_package_is_whole_and_lints_clean(run, base, tmp_path):
    path = base(WELDER)
    status, out, _ = run("init", path, "--package", "welding", "-o", tmp_path / "src")
    folder = tmp_path / "src" / "welding"
    assert status == 0
    assert "w: not on ROS_PACKAGE_PATH" in out
    for name in ("package.xml", "CMakeLists.txt", "setup.py", "launch/welding.launch", "config/reasoner.yaml"):
        assert (folder / name).is_file()
    assert load_project(folder / "models").package == "welding"
    assert run("check", folder / "models")[0] == 0
    lint = subprocess.run(["catkin_lint", "--strict", "-W2", str(folder)], check=False, capture_output=True, text=True)
    assert lint.returncode == 0, lint.stderr


def test_new_package_takes_no_folder_that_is_there(run, base, tmp_path):
    path = base(WELDER)
    (tmp_path / "welding").mkdir()
    status, _, err = run("init", path, "--package", "welding", "-o", tmp_path)
    assert (status, "is there already" in err) == (2, True)


def test_new_package_has_a_name_of_small_letters(run, base, tmp_path):
    status, _, err = run("init", base(WELDER), "--package", "Welding", "-o", tmp_path)
    assert (status, "is no name of a new package" in err) == (2, True)


def test_answers_on_a_terminal_choose_parameters_and_alternatives(run, base, monkeypatch):
    path = base(WELDER)
    (path.parent / "w.ros").write_text(SOURCES)
    monkeypatch.setattr("ros_model.cli.init._is_asked", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO("1\ny\n"))
    status, out, _ = run("init", path, "--component", "finder")
    assert status == 0
    assert "1  gain = 2.0" in out
    assert columns_of(path.parent) == ["finder", "gain"]
    assert {variant.name for variant in load_project(path.parent).variants} == {"line_default", "line_laser_finder"}
