"""Repairs of components: what metacontrol.yaml may say, what is refused, and what the manipulator is told."""

import copy

import pytest
import yaml
from ros_model.checks.whole_projects import check_project
from ros_model.errors import ModelError
from ros_model.generators.deployment import manipulator, monitor, reasoner
from ros_model.io import installed as installed_module
from ros_model.io.project import load_project
from ros_model.project.repairs import repair_lines


def component(name, space="", ports=""):
    where = f"NameSpace {space}" if space else ""
    return f"ComponentInterface {{ name {name} {where} FromRosNode 'crane.{name}.{name}' {ports} }}"


WIND = "RosPublishers {{ RosPublisher {0} {{ RefPublisher 'crane.anemometer.anemometer.{0}' }} }}"
# A crane on a ship: two winches of one name, an anemometer, and the hoist, which the variants bring.
BASE = f"""RosSystem {{ Name crane RosComponents (
    {component("winch", "bow")}, {component("winch", "stern")}, {component("anemometer", "mast", WIND.format("wind"))},
    ComponentInterface {{ name hoist FromRosNode 'crane.hoist.hoist'
        RosSubscribers {{ RosSubscriber wind {{ RefSubscriber 'crane.hoist.hoist.wind' }} }} }} )
    TopicConnections {{ TopicConnection wind {{ From ( 'anemometer.wind' ) To ( 'hoist.wind' ) }} }} }}"""
RESET = {"service": "mast/wind/reset", "duration": 2}
LAUNCH = {"launch": {"file": "launch/winch.launch", "args": {"port": "/dev/winch", "rate": 50, "brake": True}}}


@pytest.fixture
def settings():
    return {
        "package": "ship_crane",
        "base": "crane.rossystem",
        "variants": {"component": "hoist", "table": "hoist.csv", "parameters": {"speed": ["speed"]}},
        "functions": {"f_lift": {"designs": "all"}},
        "quality_attributes": {"pace": {"direction": "higher_is_better"}},
        "utility": "pace",
        "objectives": {"o_lift": {"function": "f_lift"}},
        "components": {
            "wind_sensor": {"node": "mast/anemometer", "repair": RESET | {"success": 0.95, "attempts": 4}},
            "bow/winch": {"required_by": "all", "repair": copy.deepcopy(LAUNCH) | {"duration": 12.5}},
            "battery": {"topic": "charge", "below": 0.2, "repair": {"service": "/ship/battery/swap", "duration": 300}},
            "stern/winch": {"node": "stern/winch"},
        },
    }


@pytest.fixture
def load(tmp_path, settings):
    def write_and_load(**components):
        settings["components"].update(components)
        (tmp_path / "models").mkdir(exist_ok=True)
        (tmp_path / "models" / "crane.rossystem").write_text(BASE)
        (tmp_path / "models" / "hoist.csv").write_text("name,speed\nslow,1\nfast,2\n")
        (tmp_path / "models" / "metacontrol.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
        return load_project(tmp_path / "models")

    return write_and_load


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Make a package of the robot's drivers that is on this machine, beside that of the models."""
    folder = tmp_path / "src" / "winch_driver"
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>winch_driver</name></package>")
    (folder / "launch" / "again.launch").write_text("<launch/>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    installed_module._packages.cache_clear()
    yield folder
    installed_module._packages.cache_clear()


def test_manipulator_is_told_the_means_and_the_package_of_a_launch_file(load):
    assert manipulator(load())["repairs"] == {
        "wind_sensor": {"service": "mast/wind/reset"},
        "bow/winch": {
            "launch": {
                "package": "ship_crane",
                "file": "launch/winch.launch",
                "args": {"port": "/dev/winch", "rate": "50", "brake": "true"},
            }
        },
        "battery": {"service": "/ship/battery/swap"},
    }


def test_package_of_a_launch_file_stays(load):
    launch = {"package": "winch_driver", "file": "again.launch"}
    repairs = manipulator(load(**{"stern/winch": {"repair": {"launch": launch, "duration": 1}}}))["repairs"]
    assert repairs["stern/winch"] == {"launch": launch}


def test_without_repairs_nothing_is_said_of_them(load, settings):
    settings["components"] = {"wind_sensor": {"node": "mast/anemometer"}}
    assert "repairs" not in manipulator(load())


def test_monitor_and_reasoner_hear_of_components_only_what_stands_for_them(load):
    expected = {
        "wind_sensor": {"node": "mast/anemometer"},
        "battery": {"topic": "charge", "below": 0.2},
        "stern/winch": {"node": "stern/winch"},
    }
    assert monitor(load())["components"] == reasoner(load())["components"] == expected


def test_repairs_are_listed(load):
    assert list(repair_lines(load())) == [
        "repair of wind_sensor: the service mast/wind/reset, 2 s, 95% succeed, at most 4 in a row",
        "repair of bow/winch: launch/winch.launch of ship_crane, 12.5 s",
        "repair of battery: the service /ship/battery/swap, 300 s",
    ]


@pytest.mark.parametrize(
    ("repair", "message"),
    [
        (None, "components.gauge.repair: is empty, must be a mapping with duration, and service or launch"),
        ({"service": "r"}, "components.gauge.repair.duration: is missing, must be a number over 0"),
        ({"service": "r", "duration": 0}, "repair.duration: is '0', must be a number over 0"),
        ({"service": "r", "duration": float("inf")}, "repair.duration: is 'inf', must be a number over 0"),
        ({"duration": 1}, "components.gauge.repair: has neither service nor launch: add one"),
        (RESET | LAUNCH, "components.gauge.repair: has both service and launch: take one out"),
        (RESET | {"service": "~r"}, "repair.service: is '~r', must be a name of letters, digits, '_' and '/'"),
        (RESET | {"success": 1.1}, "repair.success: is '1.1', must be a number from 0 to 1"),
        (RESET | {"success": -0.1}, "repair.success: is '-0.1', must be a number from 0 to 1"),
        (RESET | {"attempts": 0}, "repair.attempts: is '0', must be a whole number from 1"),
        (RESET | {"attempts": 1.5}, "repair.attempts: is '1.5', must be a whole number from 1"),
        (RESET | {"often": 2}, "repair.often: unknown key, allowed here: service, launch, duration, success, attempts"),
        ({"launch": {}, "duration": 1}, "repair.launch.file: is missing, must be the path of a launch file in its"),
        ({"launch": {"file": "/a.launch"}, "duration": 1}, "repair.launch.file: is '/a.launch', must be the path of"),
        ({"launch": {"file": "x/../../a"}, "duration": 1}, "repair.launch.file: is 'x/../../a', must be the path of"),
        ({"launch": {"file": "a", "args": {"b": [1]}}, "duration": 1}, "launch.args.b: is '[1]', must be a number, a"),
    ],
)
def test_wrong_repair_is_refused_at_its_place(load, repair, message):
    with pytest.raises(ModelError, match=r"models/metacontrol\.yaml:\d+:\d+: ") as caught:
        load(gauge={"topic": "depth", "repair": repair})
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "entry", "message"),
    [
        ("hoist", {}, "hoist.repair: slow brings hoist itself, and what a design brings is started again without a"),
        ("lifter", {"node": "hoist"}, "lifter.repair: slow brings lifter itself"),
        ("winch", {}, "winch.repair: may be of bow/winch or stern/winch: give each of them an entry of its own"),
        ("anemometer", {}, "anemometer.repair: wind_sensor has a repair of wind_sensor, too: take one out"),
        ("sonar", {}, "components.sonar: is no component of the base or of a variant"),
    ],
)
def test_repair_of_what_cannot_be_repaired_is_refused(load, name, entry, message):
    with pytest.raises(ModelError) as caught:
        load(**{name: entry | {"repair": RESET}})
    assert message in str(caught.value)


def findings(project):
    found = [str(finding) for finding in check_project(project, project.library)]
    return [finding for finding in found if "repair" in finding]


@pytest.mark.usefixtures("package")
def test_launch_file_that_is_not_in_the_package_is_an_error(load, tmp_path):
    (finding,) = findings(load())
    assert finding.endswith(
        "error: components.bow/winch.repair.launch.file: the package 'ship_crane' has no file launch/winch.launch in "
        f"{tmp_path}: add it, or correct the name"
    )
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "winch.launch").write_text("<launch/>")
    assert findings(load()) == []


def test_launch_file_of_another_package_is_looked_for_there(load, settings, package):
    launch = settings["components"]["bow/winch"]["repair"]["launch"]
    launch |= {"package": "winch_driver", "file": "launch/again.launch"}
    assert findings(load()) == []
    launch["file"] = "again.launch"
    assert f"the package 'winch_driver' has no file again.launch in {package}: add it" in findings(load())[0]
    launch["package"] = "winch_drivers"
    (finding,) = findings(load())
    assert "warning: components.bow/winch.repair.launch.file: the package 'winch_drivers' is not on this" in finding


def test_argument_that_roslaunch_would_evaluate_is_an_error(load, settings, package):
    launch = {"package": package.name, "file": "launch/again.launch", "args": {"port": "$(env HOME)"}}
    settings["components"]["bow/winch"]["repair"]["launch"] = launch
    (finding,) = findings(load())
    assert "error: components.bow/winch.repair.launch.args.port: '$(env HOME)' holds '$('" in finding
