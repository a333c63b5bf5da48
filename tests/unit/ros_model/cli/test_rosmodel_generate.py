"""`rosmodel generate`: what it writes and where, and what it refuses."""

from pathlib import Path

import pytest
import yaml
from helpers import launch_files
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from ros_model.language.metamodel import compose
from ros_model.language.remappings import remappings_of, remark

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
BASE = """RosSystem { Name base
    RosComponents (
        ComponentInterface { name robot FromRosNode 'p.robot.robot'
            RosPublishers { RosPublisher odom { RefPublisher 'p.robot.robot.odom' } } },
        ComponentInterface { name guard FromRosNode 'p.guard.guard'
            RosSubscribers { RosSubscriber odom { RefSubscriber 'p.guard.guard.odom' } } },
        ComponentInterface { name nav FromRosNode 'p.nav.nav'
            RosParameters { RosParameter speed { RefParameter 'p.nav.nav.speed' value 1.0 } } } )
    TopicConnections { TopicConnection odom { From ( 'robot.odom' ) To ( 'guard.odom' ) } }
}"""
SETTINGS = {
    "package": "robot",
    "base": "base.rossystem",
    "variants": {"component": "nav", "table": "v.yaml", "parameters": {"speed": ["speed"]}},
    "functions": {"f": {"designs": "all"}},
    "quality_attributes": {"q": {"direction": "lower_is_better"}},
    "utility": "q",
    "objectives": {"o": {"function": "f"}},
}


@pytest.fixture
def models(tmp_path):
    def write(table, base_text=BASE, folder="models", **settings):
        path = tmp_path / folder
        path.mkdir(parents=True, exist_ok=True)
        (path / "base.rossystem").write_text(base_text)
        (path / "v.yaml").write_text(yaml.safe_dump(table))
        (path / "metacontrol.yaml").write_text(yaml.safe_dump(SETTINGS | settings))
        return path

    return write


def test_variant_without_its_component_has_an_empty_launch_file_and_the_monitor_expects_no_such_node(
    run, models, tmp_path
):
    section = {"component": "guard", "table": "v.yaml", "nodes": {"guard": {"yes": "p.guard.guard", "no": []}}}
    folder = models({"safe": {"guard": "yes"}, "bold": {"guard": "no"}}, variants=section)
    (folder / "p.ros").write_text(
        "PackageSet { CatkinPackage p { Artifact guard { Node { name guard "
        "Subscribers { Subscriber { name odom message 'nav_msgs.Odometry' } } } }, "
        "Artifact robot { Node { name robot Publishers { Publisher { name odom message 'nav_msgs.Odometry' } } } }, "
        "Artifact nav { Node { name nav Parameters { Parameter { name speed type Double } } } } } }"
    )
    assert run("check", folder)[0] == 0
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 0
    monitor = yaml.safe_load((tmp_path / "config/rosgraph_monitor.yaml").read_text())
    assert monitor["desired_rossystem"] == "package://robot/models/base.core.rossystem"
    core = read_system(folder / "base.core.rossystem")
    expected = {
        name: [c.name for c in compose(core, read_system(folder / "variants" / f"{name}.rossystem")).components]
        for name in ("safe", "bold")
    }
    assert expected == {"safe": ["robot", "nav", "guard"], "bold": ["robot", "nav"]}
    nodes = {
        name: [node.name for node in launch_files.read(tmp_path / f"launch/variants/{name}.launch").nodes]
        for name in ("safe", "bold")
    }
    assert nodes == {"safe": ["guard"], "bold": []}
    status, out, _ = run("check", folder)
    assert status == 0
    assert out.count("variant bold starts no node, so the manipulator refuses it") == 1
    assert "variant safe starts no node" not in out


@pytest.mark.parametrize(
    ("place", "options"),
    [
        ("launch/variants/safe.launch", []),
        ("models/variants/safe.rossystem", []),
        ("config/reasoner.yaml", []),
        ("safe/package.xml", ["--packages"]),
    ],
)
def test_file_of_the_user_is_not_replaced_by_a_generated_one(run, models, tmp_path, place, options):
    folder = models({"safe": {"speed": 1}, "bold": {"speed": 2}}, folder="robot/models" if options else "models")
    mine = tmp_path / place
    mine.parent.mkdir(parents=True, exist_ok=True)
    mine.write_text("<!-- mine -->")
    status, _, err = run("generate", "all", folder, "-o", tmp_path, *options)
    assert status == 2
    assert f"{place}: is there, and rosmodel has not generated it" in err
    assert mine.read_text() == "<!-- mine -->"
    mine.unlink()
    for _ in range(2):  # what was generated is replaced
        assert run("generate", "all", folder, "-o", tmp_path, *options)[0] == 0


def test_variant_with_the_name_of_a_launch_file_of_the_package_is_told(run, models, tmp_path):
    folder = models({"safe": {"speed": 1}, "bold": {"speed": 2}})
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "bold.launch").write_text("<launch/>")
    status, out, _ = run("generate", "launch", folder, "-o", tmp_path)
    assert status == 0
    assert [line.split(" has the name of ")[0] for line in out.splitlines()[1:]] == [
        f"  {tmp_path}/launch/variants/bold.launch"
    ]
    assert "`roslaunch robot bold.launch` refuses both: rename the variant" in out


def test_optional_component_is_no_part_of_the_base_that_the_monitor_expects(run, models, tmp_path):
    section = {**SETTINGS["variants"], "components": {"guarded": ["guard"]}}
    table = {"safe": {"speed": 1, "guarded": True}, "bold": {"speed": 2.5, "guarded": False}}
    folder = models(table, variants=section)
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 0
    monitor = yaml.safe_load((tmp_path / "config/rosgraph_monitor.yaml").read_text())
    assert monitor["desired_rossystem"] == "package://robot/models/base.core.rossystem"
    core = read_system(folder / "base.core.rossystem")
    safe, bold = (read_system(folder / "variants" / f"{name}.rossystem") for name in ("safe", "bold"))
    assert [component.name for component in compose(core, safe).components] == ["robot", "guard", "nav"]
    assert [component.name for component in compose(core, bold).components] == ["robot", "nav"]
    nodes = {
        name: [node.name for node in launch_files.read(tmp_path / f"launch/variants/{name}.launch").nodes]
        for name in ("safe", "bold")
    }
    assert nodes == {"safe": ["guard", "nav"], "bold": ["nav"]}


def test_generating_twice_gives_the_same_bytes(run, models, tmp_path):
    folder = models({"a": {"speed": 1}, "b": {"speed": 0.5}})
    for output in ("one", "two"):
        assert run("generate", "all", folder, "-o", tmp_path / output)[0] == 0
    one, two = (
        {path.relative_to(root): path.read_bytes() for path in root.rglob("*") if path.is_file()}
        for root in (tmp_path / "one", tmp_path / "two")
    )
    assert one == two
    assert len(one) == 2 + 2 + 3 + 1


def test_files_of_a_variant_that_is_gone_are_told_and_left(run, models, tmp_path):
    assert run("generate", "all", models({"a": {"speed": 1}, "b": {"speed": 0.5}}), "-o", tmp_path)[0] == 0
    (tmp_path / "launch/variants/mine.launch").write_text("<launch/>")
    _, out, _ = run("generate", "all", models({"a": {"speed": 1}}), "-o", tmp_path)
    told = [line.split()[0] for line in out.splitlines() if "delete it" in line]
    assert told == [str(tmp_path / "models/variants/b.rossystem"), str(tmp_path / "launch/variants/b.launch")]
    assert all(Path(path).is_file() for path in told)


def test_hand_written_variants_are_left_alone_and_others_put_beside_them(run, models, tmp_path):
    folder = models({}, variants=[{}, {"files": ["arm.rossystem"]}])
    (folder / "arm.rossystem").write_text("RosSystem { Name one_arm }")
    (folder / "variants").mkdir()
    mine = folder / "variants" / "mine.rossystem"
    mine.write_text("RosSystem{Name mine}")
    assert run("generate", "variants", folder, "-o", tmp_path)[0] == 0
    assert mine.read_text() == "RosSystem{Name mine}"
    assert read_system(folder / "variants" / "one_arm.rossystem").name == "one_arm"


def test_lone_system_gets_a_launch_file(run, models, tmp_path):
    folder = models({"a": {"speed": 1}})
    status, out, _ = run("generate", "launch", folder / "base.rossystem", "-o", tmp_path)
    assert (status, out) == (0, f"launch: {tmp_path / 'launch/base.launch'}\n")
    config = launch_files.read(tmp_path / "launch/base.launch")
    assert [node.name for node in config.nodes] == ["robot", "guard", "nav"]


def test_models_that_generated_files_would_not_find_are_refused(run, models, tmp_path):
    folder = models({"a": {"speed": 1}}, folder="my_models")
    status, _, err = run("generate", "all", folder, "-o", tmp_path)
    assert status == 2
    assert f"generated files look for the models in {tmp_path / 'models'}" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my_models"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["launch"], "Missing 'MODELS'"),
        (["launch", "models"], "Missing option '-o'"),
        (["poems", "{models}", "-o", "."], "no generator 'poems': there are deployment, launch"),
        (
            ["deployment", "{models}/base.rossystem", "-o", "."],
            "base.rossystem: is one system, and deployment needs a p",
        ),
        (["deployment", "{models}/r.ros", "-o", "."], "r.ros: is no project: give the folder of metacontrol.yaml"),
        (["all", "{models}/none", "-o", "."], "No such file"),
        (["launch", "{models}/v.yaml", "-o", "."], "v.yaml:1:1: package: is missing"),
    ],
)
def test_wrong_arguments_are_refused(run, models, arguments, message):
    folder = models({"a": {"speed": 1}})
    (folder / "r.ros").touch()
    status, _, err = run("generate", *(argument.format(models=folder) for argument in arguments))
    assert status == 2
    assert message in err


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("'p.nav.nav'", "'../../bin.sh.x'", "base.rossystem:7:51: reference '../../bin.sh.x' is not"),
        ("'p.nav.nav'", "'p.$(env HOME).nav'", "base.rossystem:7:51: '$(env HOME)' can't name a package or executable"),
        ("'p.nav.nav'", "'p.bin/sh.nav'", "base.rossystem:7:51: 'bin/sh' can't name a package or executable"),
        ("name nav", "name 'nav\" args=\"x'", "base.rossystem:7:9: 'nav\" args=\"x' is no name of ROS"),
        ("name nav", "name '$(arg x)'", "is no name of ROS"),
        ("name nav", "name nav NameSpace '../up'", "is no name of ROS"),
    ],
)
def test_model_that_reaches_outside_or_injects_is_refused_at_its_place(run, models, tmp_path, old, new, message):
    folder = models({}, base_text=BASE.replace(old, new), variants={"files": ["base.rossystem"]})
    status, _, err = run("generate", "launch", folder, "-o", tmp_path / "out")
    assert status == 2
    assert message in err.splitlines()[0]
    assert not (tmp_path / "out").exists()


NAV = """PackageSet { CatkinPackage p { Artifact nav { Node { name nav
    Parameters { Parameter { name speed type Double } } } }, Artifact robot { Node { name robot
    Publishers { Publisher { name odom message 'nav_msgs.Odometry' } } } }, Artifact guard { Node { name guard
    Subscribers { Subscriber { name odom message 'nav_msgs.Odometry' } } } } } }"""
OBSERVER = {"name": "Tilt", "quality_attribute": "q", "topics": {"imu": "sensor_msgs/Imuu"}, "rate": 1, "range": [0, 1]}


@pytest.mark.parametrize(
    ("packages", "settings", "message"),
    [
        (NAV.replace("name speed", "name sped"), {}, "'p.nav.nav' declares no parameter 'speed'"),
        (NAV.replace("type Double", "type Double default fast"), {}, "'fast' of 'speed' is no Double"),
        (NAV.replace("Subscriber { name odom", "Subscriber { name pose"), {}, "no subscriber 'odom': it declares pose"),
        (NAV, {"functions": {"f": {"designs": ["a"]}}}, "functions: none has b among its designs: add it to one"),
        (NAV, {"observers": [OBSERVER]}, "observers[0].topics.imu: package 'sensor_msgs' declares no message 'Imuu'"),
    ],
)
def test_what_check_refuses_is_refused_before_anything_is_written(run, models, tmp_path, packages, settings, message):
    folder = models({"a": {"speed": 1.0}, "b": {"speed": 0.5}}, **settings)
    (folder / "p.ros").write_text(packages)
    status, out, _ = run("check", folder)
    assert (status, message in out) == (1, True)
    status, out, err = run("generate", "all", folder, "-o", tmp_path)
    assert (status, out, message in err) == (2, "", True)
    assert [path.name for path in tmp_path.iterdir()] == ["models"]


def test_model_that_is_generated_anew_does_not_stand_in_the_way_of_its_correction(run, models, tmp_path):
    good = {**OBSERVER, "topics": {"imu": "sensor_msgs/Imu"}}
    assert run("generate", "all", models({"a": {"speed": 1}}, observers=[good]), "-o", tmp_path)[0] == 0
    observers = tmp_path / "models" / "observers.ros"
    observers.write_text(observers.read_text().replace("sensor_msgs.Imu'", "sensor_msgs.Imuu'"))
    assert run("check", tmp_path / "models")[0] == 0
    assert run("check", observers)[0] == 1
    assert run("generate", "all", tmp_path / "models", "-o", tmp_path)[0] == 0
    assert "sensor_msgs.Imu'" in observers.read_text()


def test_lone_system_that_check_refuses_gets_no_launch_file(run, models, tmp_path):
    folder = models({"a": {"speed": 1}}, base_text=BASE.replace("'guard.odom'", "'guard.odo'"))
    status, _, err = run("generate", "launch", folder / "base.rossystem", "-o", tmp_path)
    assert (status, "'guard' has no port 'odo'" in err, (tmp_path / "launch").exists()) == (2, True, False)


def test_lone_variant_of_a_project_gets_a_launch_file(run, models, tmp_path):
    folder = models({"a": {"speed": 1}}, variants={**SETTINGS["variants"], "components": {"g": ["guard"]}})
    (folder / "v.yaml").write_text("a: {speed: 1, g: true}\n")
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 0
    assert run("generate", "launch", folder / "variants" / "a.rossystem", "-o", tmp_path)[0] == 0


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("base", "../other.rossystem", "metacontrol.yaml:1:1: base: ../other.rossystem leaves the folder"),
        ("base", "/etc/passwd", "metacontrol.yaml:1:1: base: /etc/passwd leaves the folder"),
        ("variants", {"table": "/etc/v.csv"}, "variants.table: /etc/v.csv leaves the folder"),
        ("variants", {"files": ["../../v.rossystem"]}, "variants.files[0]: ../../v.rossystem leaves the folder"),
        ("package", "../up", "package: is '../up', must be a name"),
        ("base", "a\0b", "base: 'a\\x00b' is no name of a file"),
    ],
)
def test_path_outside_the_models_is_refused_at_its_place(run, models, tmp_path, key, value, line):
    folder = models({"a": {"speed": 1}}, **{key: value})
    status, _, err = run("generate", "all", folder, "-o", tmp_path / "out")
    assert status == 2
    assert line in err
    assert not (tmp_path / "out").exists()


def test_value_that_roslaunch_would_evaluate_is_refused_at_its_row(run, models, tmp_path):
    folder = models({"a": {"speed": 1.0}, "b": {"speed": "$(eval 1)"}})
    status, _, err = run("generate", "launch", folder, "-o", tmp_path / "out")
    assert status == 2
    assert "v.yaml:3:1: '$(eval 1)' holds '$('" in err
    assert not (tmp_path / "out").exists()


def test_link_that_leads_out_of_the_output_is_not_followed(run, models, tmp_path):
    folder = models({"a": {"speed": 1}})
    (tmp_path / "out").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out" / "launch").symlink_to(tmp_path / "elsewhere")
    status, _, err = run("generate", "launch", folder, "-o", tmp_path / "out")
    assert status == 2
    assert "leaves the folder" in err
    assert not any((tmp_path / "elsewhere").iterdir())


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """A package outside, found on ROS_PACKAGE_PATH, with a generator of this text."""

    def write(text, function="poetry_by_{name}:write"):
        name = f"p{abs(hash(tmp_path))}"
        source = tmp_path / "outside" / "poetry"
        source.mkdir(parents=True)
        (source / "package.xml").write_text(
            "<package format='2'><name>poetry</name><version>0.0.1</version><description>x</description>"
            "<maintainer email='a@b.example'>a</maintainer><license>x</license><exec_depend>ros_model</exec_depend>"
            f"<export><ros_model generator='poems' function='{function.format(name=name)}'/></export></package>"
        )
        (source / f"poetry_by_{name}.py").write_text(text)
        monkeypatch.setenv("ROS_PACKAGE_PATH", f"{source.parent}:{SOURCES}")
        monkeypatch.syspath_prepend(str(source))

    return write


def test_generator_from_outside_runs_with_all_others(run, models, outside, tmp_path):
    outside(
        "from ros_model.generators import write_file\n"
        "def write(project, output):\n"
        "    return [write_file(output / 'poem.txt', ' '.join(v.name for v in project.variants), output)]\n"
    )
    status, out, _ = run("generate", "all", models({"a": {"speed": 1}, "b": {"speed": 2}}), "-o", tmp_path)
    assert status == 0
    assert [line.partition(":")[0] for line in out.splitlines()] == [
        "variants",
        "launch",
        "observer",
        "deployment",
        "poems",
        "tomasys",
    ]
    assert (tmp_path / "poem.txt").read_text() == "a b"
    assert "poems" in run("generate", "--help")[1]


@pytest.mark.parametrize(
    ("text", "function", "message"),
    [
        ("def write(project, output):\n    return 1 / 0\n", "poetry_by_{name}:write", "fails: ZeroDivisionError"),
        ("import nowhere_to_be_found\n", "poetry_by_{name}:write", "No module named 'nowhere_to_be_found'"),
        ("", "poetry_by_{name}:write", "has no attribute 'write'"),
        ("", "", "name one as MODULE:ATTRIBUTE"),
        (
            "from ros_model.generators import write_file\n"
            "def write(project, output):\n    return [write_file(output / '..' / 'x', '', output)]\n",
            "poetry_by_{name}:write",
            "leaves the folder",
        ),
    ],
)
def test_broken_generator_from_outside_is_told_in_one_line(run, models, outside, tmp_path, text, function, message):
    outside(text, function)
    status, _, err = run("generate", "poems", models({"a": {"speed": 1}}), "-o", tmp_path / "out")
    assert status == 2
    assert err.count("\n") == 1
    assert message in err


def test_help_names_the_generators(run):
    status, out, _ = run("generate", "--help")
    assert status == 0
    assert "variants, launch, observer, deployment" in " ".join(out.split())


def test_names_of_generators_complete(run):
    from click.shell_completion import ShellComplete
    from ros_model.cli.rosmodel import command

    found = ShellComplete(command, {}, "rosmodel", "_ROSMODEL_COMPLETE").get_completions(["generate"], "la")
    assert [item.value for item in found] == ["launch"]


def test_project_of_d2_loads_unchanged_through_its_file():
    assert load_project(SOURCES / "metacontrol_sim" / "models").base_file == "d2.rossystem"


def test_remapping_of_no_port_reaches_the_launch_files_and_models_of_the_variants(run, models, tmp_path):
    base = f"// A cart.\n// {remark('/nav', [('~late', 'map')])}\n// {remark('/guard', [('a', 'b')])}\n{BASE}"
    folder = models({"safe": {"speed": 1}}, base)
    for arguments in (["all", folder, "-o", tmp_path], ["launch", folder, "-o", tmp_path, "--packages"]):
        assert run("generate", *arguments)[0] == 0
    for place in ("launch/variants", "safe/launch"):
        (node,) = launch_files.read(tmp_path / place / "safe.launch").nodes
        assert [tuple(pair) for pair in node.remap_args] == [("~late", "map")]
    assert run("variants", folder, "-o", tmp_path / "whole", "--whole")[0] == 0
    for place in ("models/variants", "safe"):
        assert remappings_of(read_system(tmp_path / place / "safe.rossystem").header) == {"nav": (("~late", "map"),)}
    assert set(remappings_of(read_system(tmp_path / "whole" / "safe.rossystem").header)) == {"nav", "guard"}


def test_arguments_of_nodes_reach_the_launch_files(run, models, tmp_path):
    folder = models({"a": {"speed": 1}}, arguments={"nav": '--frame odom --name "left arm" <&>'})
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 0
    (node,) = launch_files.read(tmp_path / "launch/variants/a.launch").nodes
    assert (node.name, node.args) == ("nav", '--frame odom --name "left arm" <&>')


def test_parameter_files_are_loaded_by_the_launch_files_and_variants_take_precedence(run, models, tmp_path):
    file = "package://metacontrol_sim/config/move_base.yaml"
    folder = models({"a": {"speed": 1}}, parameter_files={"nav": file})
    assert run("check", folder)[0] == 0
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 0
    loaded = launch_files.read(tmp_path / "launch/variants/a.launch").params
    assert {name: loaded[f"/nav/{name}"].value for name in ("speed", "global_costmap/resolution")} == {
        "speed": 1,
        "global_costmap/resolution": 0.05,
    }


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (
            {"guard": "package://metacontrol_sim/config/move_base.yaml"},
            "parameter_files.guard: no variant starts such",
        ),
        (
            {"nav": "package://metacontrol_sim/config/moves.yaml"},
            "parameter_files.nav: the package 'metacontrol_sim'",
        ),
        (
            {"nav": "config/move_base.yaml"},
            "parameter_files.nav: is 'config/move_base.yaml', must be a file of",
        ),
        ({"nav": "package://metacontrol_sim/../x.yaml"}, "must be a file of a package, package://PACKAGE/FILE"),
        ({"nav": "package://metacontrol_sim/$(env HOME)"}, "must be a file of a package, package://PACKAGE/FILE"),
    ],
)
def test_parameter_files_that_can_not_be_loaded_are_refused(run, models, files, message):
    status, out, _ = run("check", models({"a": {"speed": 1}}, parameter_files=files))
    assert (status, message in out) == (1, True), out


@pytest.mark.parametrize("content", [b"[1, 2]", b"a: [1", b"hello", b"a:\t1\n\tb: 2", b"1: 2", b"a: \xff"])
def test_parameter_file_that_roslaunch_can_not_load_is_refused(run, models, tmp_path, content):
    folder = models({"a": {"speed": 1}}, parameter_files={"nav": "package://robot/config/nav.yaml"})
    (folder.parent / "config").mkdir()
    file = folder.parent / "config" / "nav.yaml"
    file.write_text("limits: {speed: 0.5}\nrate: !degrees 5\n")
    assert run("check", folder)[0] == 0
    file.write_bytes(content)
    status, out, _ = run("check", folder)
    assert status == 1
    assert f"error: parameter_files.nav: {file}" in out, out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"guard": "-x"}, "arguments.guard: no variant starts such a node: correct the name"),
        ({"navi": "-x"}, "arguments.navi: no variant starts such a node: correct the name"),
        ({"nav": "$(eval 1)"}, "arguments.nav: '$(eval 1)' holds '$(', which roslaunch would evaluate: take it out"),
        ({"nav": ""}, "arguments.nav: is '', must be a text"),
        ({"nav": ["-x"]}, "arguments.nav: is \"['-x']\", must be a text"),
    ],
)
def test_arguments_that_no_node_can_have_are_refused(run, models, tmp_path, arguments, message):
    folder = models({"a": {"speed": 1}}, arguments=arguments)
    status, out, _ = run("check", folder)
    assert (status, message in out) == (1, True)
    assert run("generate", "all", folder, "-o", tmp_path)[0] == 2
