"""The wizard of `rosmodel generate observer`, answered line by line."""

import pytest
import yaml
from click.testing import CliRunner
from ros_model.cli.rosmodel import command
from ros_model.io.models import read_packages
from ros_model.io.project import load_project
from ros_model.project.yaml_file import with_entry
from rosgraph_monitor.observer import TopicObserver

BASE = """RosSystem { Name base
    RosComponents (
        ComponentInterface { name robot FromRosNode 'p.robot.robot'
            RosPublishers { RosPublisher odom { RefPublisher 'p.robot.robot.odom' }, RosPublisher imu { RefPublisher 'p.robot.robot.imu' } } },
        ComponentInterface { name nav FromRosNode 'p.nav.nav'
            RosPublishers { RosPublisher out { RefPublisher 'p.nav.nav.out' } } RosSubscribers { RosSubscriber odom { RefSubscriber 'p.nav.nav.odom' } } } )
    TopicConnections { TopicConnection 'odometry/filtered' { From ( 'robot.odom' ) To ( 'nav.odom' ) } }
}"""  # noqa: E501
PACKAGES = """PackageSet { CatkinPackage p { Artifact robot { Node { name robot Publishers {
    Publisher { name 'odom' message 'nav_msgs.Odometry' },
    Publisher { name 'imu' message 'sensor_msgs.Imu' } } } } } }"""
SETTINGS = """# Mine, with comments.
package: robot_models
base: base.rossystem
variants: {files: [base.rossystem]}
functions: {f: {designs: all}}
quality_attributes:
  safety: {direction: higher_is_better}  # of the robot
utility: safety
objectives: {o: {function: f}}
"""


@pytest.fixture
def robot(tmp_path, monkeypatch):
    models = tmp_path / "models"
    models.mkdir()
    (models / "base.rossystem").write_text(BASE)
    (models / "p.ros").write_text(PACKAGES)
    (models / "metacontrol.yaml").write_text(SETTINGS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def answer():
    def run(*lines, arguments=()):
        return CliRunner().invoke(command, ["generate", "observer", *arguments], input="".join(f"{x}\n" for x in lines))

    return run


def test_answers_become_an_observer_and_an_entry(robot, answer, monkeypatch):
    result = answer("", "comfort", "", "2 1", "5", "", "1", "20", "", "y")
    assert result.exit_code == 0, result.output
    assert "2  imu  sensor_msgs/Imu  from robot" in result.output
    text = (robot / "models" / "metacontrol.yaml").read_text()
    assert text.startswith("# Mine, with comments.\n")
    assert "# of the robot" in text
    settings = yaml.safe_load(text)
    assert settings["quality_attributes"]["comfort"] == {"direction": "lower_is_better"}
    assert settings["observers"] == [
        {
            "name": "ComfortQualityObserver",
            "quality_attribute": "comfort",
            "topics": {"imu": "sensor_msgs/Imu", "odometry/filtered": "nav_msgs/Odometry"},
            "rate": 5.0,
            "range": [1.0, 20.0],
        }
    ]
    load_project("models")
    monkeypatch.syspath_prepend(str(robot / "src"))
    from robot_models.comfort_quality_observer import ComfortQualityObserver

    observer = ComfortQualityObserver()
    assert isinstance(observer, TopicObserver)
    assert [topic for topic, _ in observer.topics] == ["imu", "odometry/filtered"]
    assert (robot / "test" / "test_comfort_quality_observer.py").is_file()
    assert read_packages("models/observers.ros").node(
        "robot_models", "comfort_quality_observer", "comfort_quality_observer"
    )
    assert 'add to package.xml: <export><rosgraph_monitor observer="robot_models.' in result.output


def test_wrong_answers_are_asked_again(robot, answer):
    result = answer(
        *("nowhere", "models", "ride comfort", "comfort", "no class", "Ride", "7", "imu?", "imu raw", "Nope"),
        "no_msgs/Nope",
        *("std_msgs/Flot32", "std_msgs/Float32", "0", "2", "sideways", "higher_is_better", "1", "1", "3", "", "n"),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    for complaint in (
        "nowhere",
        "a name of letters, digits and '_'",
        "the name of a Python class",
        "7 is none of the numbers 1 to 3",
        "'imu?' is neither a number of the list nor the name of a topic",
        "'Nope' names no message type",
        "declares the messages of 'no_msgs'",
        "package 'std_msgs' declares no message 'Flot32'",
    ):
        assert complaint in " ".join(result.output.split()), complaint
    assert (robot / "models" / "metacontrol.yaml").read_text() == SETTINGS
    assert "Put this into" in result.output
    assert "topics: {imu: sensor_msgs/Imu, raw: std_msgs/Float32}" in result.output


@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
def test_numbers_that_are_not_finite_are_asked_again(robot, answer, number):
    result = answer(
        *("models", "comfort", "Comf", "imu", number, "10", "lower_is_better", number, "0", number, "1", ".", "n")
    )
    assert result.exit_code == 0, result.output
    assert result.output.count("Error:") == 3
    assert "rate: 10.0, range: [0.0, 1.0]" in result.output
    compile((robot / "src/robot_models/comf.py").read_text(), "comf.py", "exec")


def test_direction_of_a_known_quality_is_not_asked_again(robot, answer):
    result = answer("", "safety", "", "3", "std_msgs/Float32", "", "", "", "", "y")
    assert result.exit_code == 0, result.output
    assert "Direction" not in result.output
    assert "higher is better" in (robot / "src/robot_models/safety_quality_observer.py").read_text()


def test_plugin_that_is_kept_is_told(robot, answer):
    kept = "kept src/robot_models/comf.py with another range, rate, topics: correct that, or delete it to have it made"
    assert "kept" not in answer("", "comfort", "Comf", "1", "10", "", "0", "1", ".", "n").output
    written = (robot / "src/robot_models/comf.py").read_bytes()
    assert kept in answer("", "comfort", "Comf", "2", "5", "", "0", "2", ".", "n").output
    assert (robot / "src/robot_models/comf.py").read_bytes() == written
    (robot / "src/robot_models/comf.py").unlink()
    assert "kept" not in answer("", "comfort", "Comf", "2", "5", "", "0", "2", ".", "n").output
    assert (robot / "src/robot_models/comf.py").read_bytes() != written


def test_second_observer_joins_the_first_in_the_model(robot, answer):
    assert answer("", "comfort", "", "1", "", "", "", "", "", "y").exit_code == 0
    result = answer("", "safety", "", "2", "", "", "", "", "y")
    assert result.exit_code == 0, result.output
    (package,) = read_packages("models/observers.ros").packages
    assert [artifact.name for artifact in package.artifacts] == ["comfort_quality_observer", "safety_quality_observer"]
    assert len(load_project("models").settings["observers"]) == 2


def test_output_may_be_given(robot, answer):
    result = answer("", "comfort", "", "1", "", "", "", "", "n", arguments=["-o", "elsewhere"])
    assert result.exit_code == 0, result.output
    assert (robot / "elsewhere/src/robot_models/comfort_quality_observer.py").is_file()


def test_end_of_input_ends_the_wizard_and_writes_nothing(robot, answer):
    result = answer("", "comfort")
    assert result.exit_code != 0
    assert not (robot / "src").exists()


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\n",
        "a: 1",
        "",
        "a: 1\nlist: [x, y] # end\nb: 2\n",
        "list: []\n",
        "list:\n- x\n- {y: 1}\n# end\nb: 2\n",
        "list:\n    - x\nb: 2\n",
        "list:\n\n  # first\n  - x\n",
    ],
)
def test_entry_joins_a_list_in_any_layout(text):
    before = yaml.safe_load(text) or {}
    added = with_entry(text, "list", None, {"name": "it's: #1", "n": [1, 2.5]})
    assert yaml.safe_load(added) == before | {"list": yaml.safe_load(added)["list"]}
    assert {"name": "it's: #1", "n": [1, 2.5]} in yaml.safe_load(added)["list"]
    assert len(yaml.safe_load(added)["list"]) == len(before.get("list", [])) + 1
    assert added.count("#") == text.count("#") + 1


@pytest.mark.parametrize("text", ["a: 1\n", "map: {x: 1}\n", "map: {}\n", "map:\n  x: 1\n  y: {z: 2}\nb: 1\n"])
def test_entry_joins_a_mapping_in_any_layout(text):
    added = yaml.safe_load(with_entry(text, "map", "new", {"d": "low"}))
    before = yaml.safe_load(text)
    assert added == before | {"map": before.get("map", {}) | {"new": {"d": "low"}}}
