"""`rosmodel generate observer`: a model, a plug-in that the monitor loads, a test that fails until it is written."""

import importlib
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from geometry_msgs.msg import Twist
from ros_model.cli.rosmodel import main
from ros_model.errors import ModelError
from ros_model.generators.observer import write_observers
from ros_model.io.models import read_packages
from ros_model.language.metamodel import PortKind
from ros_model.project.observers import ObserverModel, camel_case, snake_case, variables
from rosgraph_monitor.observer import TopicObserver
from rosgraph_monitor.observers.plugins import available, make
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
DESCRIPTION = {
    "name": "ComfortQualityObserver",
    "quality_attribute": "comfort",
    "topics": {"imu/data": "sensor_msgs/Imu", "/cmd_vel": "geometry_msgs/Twist"},
    "rate": 5,
    "range": [1.0, 5.0],
    "max_age": 0.5,
}
MANIFEST = """<package format="2"><name>{name}</name><version>0.1.0</version><description>x</description>
<maintainer email="a@b.example">a</maintainer><license>x</license><exec_depend>rosgraph_monitor</exec_depend>
{export}</package>"""


@pytest.fixture
def package(tmp_path):
    """A package with a name of its own for each test, since Python imports a name once."""
    name = f"robot_{abs(hash(tmp_path))}"
    folder = tmp_path / name
    models = folder / "models"
    models.mkdir(parents=True)
    (models / "b.rossystem").write_text("RosSystem { Name b }")
    (models / "v.rossystem").write_text("RosSystem { Name v }")
    (folder / "package.xml").write_text(MANIFEST.format(name=name, export=""))

    def describe(*observers):
        settings = {
            "package": name,
            "base": "b.rossystem",
            "variants": {"files": ["v.rossystem"]},
            "functions": {"f": {"designs": "all"}},
            "quality_attributes": {"comfort": {"direction": "lower_is_better"}},
            "utility": "comfort",
            "objectives": {"o": {"function": "f"}},
            "observers": list(observers),
        }
        (models / "metacontrol.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
        return folder

    return describe


@pytest.fixture
def generate(capsys):
    def run(folder, what="observer"):
        with pytest.raises(SystemExit) as done:
            main(["generate", what, str(folder / "models"), "-o", str(folder)])
        captured = capsys.readouterr()
        assert (done.value.code, captured.err) == (0, "")
        return captured.out

    return run


@pytest.fixture
def generated(package, generate):
    folder = package(DESCRIPTION)
    generate(folder)
    return folder


@pytest.fixture
def exported(generated, monkeypatch):
    """The package on ROS's and Python's paths, with the export line in its package.xml; the name of its module."""
    target = f"{generated.name}.comfort_quality_observer"
    export = f'<export><rosgraph_monitor observer="{target}:ComfortQualityObserver"/></export>'
    (generated / "package.xml").write_text(MANIFEST.format(name=generated.name, export=export))
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{generated.parent}:{SOURCES}")
    monkeypatch.syspath_prepend(str(generated / "src"))
    yield target
    sys.modules.pop(target, None)
    sys.modules.pop(generated.name, None)


def write_formula(folder):
    path = folder / "src" / folder.name / "comfort_quality_observer.py"
    lines = path.read_text().splitlines()
    (number,) = (number for number, line in enumerate(lines) if "raise NotImplementedError" in line)
    lines[number] = "        return self.status_of(abs(imu_data.linear_acceleration.y) + abs(cmd_vel.angular.z))"
    path.write_text("\n".join(lines) + "\n")


def fed(observer, acceleration, now=0.0):
    imu = Imu()
    imu.linear_acceleration.y = acceleration
    for (topic, _), message in zip(observer.topics, (imu, Twist()), strict=True):
        observer.receive(topic, message, now)
    return observer


def test_model_of_the_observer(generated):
    node = read_packages(generated / "models" / "observers.ros").node(
        generated.name, "comfort_quality_observer", "comfort_quality_observer"
    )
    assert {(port.kind, port.name, port.type) for port in node.ports} == {
        (PortKind.PUBLISHER, "/diagnostics", "diagnostic_msgs/DiagnosticArray"),
        (PortKind.SUBSCRIBER, "imu/data", "sensor_msgs/Imu"),
        (PortKind.SUBSCRIBER, "/cmd_vel", "geometry_msgs/Twist"),
    }


def test_monitor_finds_and_makes_it(exported):
    assert available()["ComfortQualityObserver"] == f"{exported}:ComfortQualityObserver"
    observer = make("ComfortQualityObserver")
    assert isinstance(observer, TopicObserver)
    assert (observer.rate_hz, observer.qa_name, observer.max_age) == (5.0, "comfort", 0.5)
    assert observer.topics == [("imu/data", Imu), ("/cmd_vel", Twist)]


def test_one_method_is_left_to_write_and_it_is_the_published_one(exported):
    observer = fed(make("ComfortQualityObserver"), 1.0)
    with pytest.raises(NotImplementedError, match="from imu_data, cmd_vel"):
        observer.evaluate(0.0)
    own = {name for name, value in vars(type(observer)).items() if callable(value)}
    assert own == {"__init__", "calculate_attr", "status_of"}


@pytest.mark.parametrize(("acceleration", "level"), [(1.0, 0.0), (3.0, 0.5), (5.0, 1.0), (0.0, 0.0), (9.0, 1.0)])
def test_written_observer_normalises_and_clips(generated, exported, acceleration, level):
    write_formula(generated)
    (status,) = fed(make("ComfortQualityObserver"), acceleration).evaluate(0.1)
    assert (status.message, status.values[0].key) == ("QA status", "comfort")
    assert float(status.values[0].value) == level


def test_written_observer_is_stale_when_a_topic_is_silent_or_no_number(generated, exported):
    write_formula(generated)
    (late,) = fed(make("ComfortQualityObserver"), 1.0).evaluate(0.6)
    (mad,) = fed(make("ComfortQualityObserver"), float("nan")).evaluate(0.0)
    assert [status.message for status in (late, mad)] == ["QA stale"] * 2


def run_generated_test(folder):
    paths = [
        *(str(SOURCES / name / "src") for name in ("rosgraph_monitor", "ros_model")),
        *sys.path,
    ]
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder / "test")],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_generated_test_fails_until_the_formula_is_written(generated):
    before = run_generated_test(generated)
    assert before.returncode == 1
    assert "NotImplementedError: write the formula here" in before.stdout
    assert "1 failed, 1 passed" in before.stdout
    write_formula(generated)
    after = run_generated_test(generated)
    assert after.returncode == 0, after.stdout


@pytest.mark.parametrize(
    "age",
    [
        "self.age(scan)",
        "self.now() - scan.header.stamp.to_sec()",
        "rospy.get_time() - scan.header.stamp.to_sec()",
        "(rospy.Time.now() - scan.header.stamp).to_sec()",
    ],
)
def test_generated_test_has_a_clock_for_formulas_that_need_the_time(package, generate, age):
    folder = package(
        {**DESCRIPTION, "name": "ScanAgeObserver", "topics": {"scan": "sensor_msgs/LaserScan"}, "range": [0.0, 2.0]}
    )
    generate(folder)
    plugin, test = folder / "src" / folder.name / "scan_age_observer.py", folder / "test" / "test_scan_age_observer.py"
    formula = plugin.read_text().replace("raise NotImplementedError(", f"return self.status_of({age})  # (")
    plugin.write_text(formula.replace("import sensor_msgs.msg", "import rospy\nimport sensor_msgs.msg"))
    stamped = "sensor_msgs.msg.LaserScan(header=std_msgs.msg.Header(stamp=rospy.Time(99)))"
    cases = test.read_text().replace("sensor_msgs.msg.LaserScan(),), 0.0", f"{stamped},), 0.5")
    test.write_text(cases.replace("import sensor_msgs.msg", "import sensor_msgs.msg\nimport std_msgs.msg"))
    done = run_generated_test(folder)
    assert done.returncode == 0, done.stdout


def test_what_the_developer_wrote_is_left_alone(generated, generate):
    write_formula(generated)
    path = generated / "src" / generated.name / "comfort_quality_observer.py"
    written = path.read_bytes()
    assert "observer: 1 file in" in generate(generated)
    assert path.read_bytes() == written


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({}, ""),
        ({"rate": 6}, "rate"),
        ({"range": [1.0, 6.0]}, "range"),
        ({"topics": {"imu/data": "sensor_msgs/Imu"}}, "topics"),
        ({"max_age": None}, "max_age"),
        ({"max_age": None, "rate": 6}, "max_age, rate"),
    ],
)
def test_plugin_that_is_not_as_described_any_more_is_told(package, generated, generate, change, part):
    write_formula(generated)
    package({key: value for key, value in {**DESCRIPTION, **change}.items() if value is not None})
    told = [line for line in generate(generated).splitlines() if line.startswith("  kept")]
    path = generated / "src" / generated.name / "comfort_quality_observer.py"
    message = f"  kept {path} with another {part}: correct that, or delete it to have it made anew"
    assert told == [message] * bool(part)


@pytest.mark.parametrize("text", ["", "class Other: pass", "class (", "class ComfortQualityObserver: max_age = 0.5"])
def test_plugin_of_another_form_is_its_developers_matter(generated, generate, text):
    (generated / "src" / generated.name / "comfort_quality_observer.py").write_text(text)
    assert "kept" not in generate(generated)


def test_export_line_is_told_until_it_is_there(package, generate):
    folder = package(DESCRIPTION)
    line = (
        f'<export><rosgraph_monitor observer="{folder.name}.comfort_quality_observer:ComfortQualityObserver"/></export>'
    )
    assert f"add to {folder / 'package.xml'}: {line}" in generate(folder)
    (folder / "package.xml").write_text(MANIFEST.format(name=folder.name, export=line))
    assert "add to" not in generate(folder)


def test_export_lines_leave_one_export_in_package_xml(package, generate):
    folder = package(DESCRIPTION, {**DESCRIPTION, "name": "Other"})
    tags = [
        f'<rosgraph_monitor observer="{folder.name}.{target}"/>'
        for target in ("comfort_quality_observer:ComfortQualityObserver", "other:Other")
    ]
    assert f"package.xml: <export>{''.join(tags)}</export>\n" in generate(folder)
    (folder / "package.xml").write_text(MANIFEST.format(name=folder.name, export=f"<export>{tags[0]}</export>"))
    assert f"package.xml: {tags[1]} inside its <export>\n" in generate(folder)


def test_observer_that_exists_gets_its_model_only(package, generate):
    folder = package({**DESCRIPTION, "plugin": "elsewhere.comfort:ComfortQualityObserver"}, "SafetyQualityObserver")
    assert f"observer: 1 file in {folder / 'models/observers.ros'}\n" == generate(folder)
    (found,) = read_packages(folder / "models" / "observers.ros").packages
    assert found.name == "elsewhere"


def test_monitor_is_told_to_load_all_of_them(package, generate):
    folder = package(DESCRIPTION, "SafetyQualityObserver")
    generate(folder, "deployment")
    monitor = yaml.safe_load((folder / "config" / "rosgraph_monitor.yaml").read_text())
    assert monitor["observers"] == ["ComfortQualityObserver", "SafetyQualityObserver"]


def test_messages_of_one_name_do_not_clash(package, generate, monkeypatch):
    folder = package(
        {**DESCRIPTION, "topics": {"a": "std_msgs/Header", "class": "std_msgs/Float32", "b/a": "nav_msgs/Path"}}
    )
    generate(folder)
    monkeypatch.syspath_prepend(str(folder / "src"))
    module = importlib.import_module(f"{folder.name}.comfort_quality_observer")
    assert [kind._type for _, kind in module.ComfortQualityObserver().topics] == [
        "std_msgs/Header",
        "std_msgs/Float32",
        "nav_msgs/Path",
    ]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": 'X"); import os #'}, "must be the name of a Python class"),
        ({"name": "../X"}, "must be the name of a Python class"),
        ({"topics": {'a"]); x(': "std_msgs/Header"}}, "must be a name of letters"),
        ({"topics": {"a": "std_msgs/Header; import os"}}, "must be a message type, PACKAGE/TYPE"),
        (
            {"topics": {"a": "std_msgs/Flot32"}},
            "observers[0].topics.a: package 'std_msgs' declares no message 'Flot32'",
        ),
        ({"topics": {}}, "must be a mapping of topics to message types"),
        ({"rate": 0}, "must be a number over 0"),
        ({"range": [1, 1]}, "the lower one first"),
        ({"quality_attribute": "speed"}, "'speed' is none of quality_attributes"),
        ({"plugin": "os"}, "must be MODULE:CLASS"),
        ({"outputs": {"a": "std_msgs/Header"}}, "is for an observer that exists: name it as plugin"),
    ],
)
def test_description_that_can_not_be_is_refused_at_its_place(package, capsys, change, message):
    folder = package({**DESCRIPTION, **change})
    with pytest.raises(SystemExit) as done:
        main(["generate", "observer", str(folder / "models"), "-o", str(folder)])
    assert done.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert "metacontrol.yaml:" in error
    assert not (folder / "src").exists()


@pytest.mark.parametrize(
    ("rate", "lowest", "highest"), [(float("nan"), 0, 1), (0, 0, 1), (1, 0, float("inf")), (1, float("nan"), 1)]
)
def test_numbers_that_python_can_not_say_are_never_written(tmp_path, rate, lowest, highest):
    observer = ObserverModel("O", "p", "q", "lower_is_better", (("a", "std_msgs/Header"),), rate, lowest, highest)
    with pytest.raises(ModelError, match="give finite numbers"):
        write_observers([observer], tmp_path)
    assert not any(tmp_path.iterdir())


def test_names_turn_into_each_other():
    assert snake_case("ComfortQualityObserver") == "comfort_quality_observer"
    assert snake_case("QAObserver2") == "qa_observer2"
    assert camel_case("ride_comfort") == "RideComfort"
    assert variables(["/scan", "scan", "imu/data", "class", "3d"]) == ["scan", "scan_", "imu_data", "class_", "_3d"]


def test_property_of_the_surroundings_is_observed_as_a_quality_is(package, generate):
    folder = package({**DESCRIPTION, "name": "LightObserver", "quality_attribute": "light"})
    path = folder / "models" / "metacontrol.yaml"
    environment = {"light": {"required_by": {"v": {"least": 0.25}}}}
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), "environment": environment}, sort_keys=False))
    generate(folder)
    text = (folder / "src" / folder.name / "light_observer.py").read_text()
    assert 'qa_name = "light"' in text
    assert "a property of the surroundings" in text


def test_observer_of_the_surroundings_tells_values_in_their_own_unit(package, generate, monkeypatch):
    described = {"name": "SlopeObserver", "quality_attribute": "slope", "topics": {"tilt": "std_msgs/Float32"}}
    folder = package({**described, "rate": 5, "range": [-90.0, 90.0]})
    path = folder / "models" / "metacontrol.yaml"
    environment = {"slope": {"required_by": {"v": {"most": 12.0}}}}
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), "environment": environment}, sort_keys=False))
    generate(folder)
    plugin = folder / "src" / folder.name / "slope_observer.py"
    formula = plugin.read_text().replace("raise NotImplementedError(", "return self.status_of(tilt.data)  # (")
    plugin.write_text(formula)
    monkeypatch.syspath_prepend(str(folder / "src"))
    observer = importlib.import_module(f"{folder.name}.slope_observer").SlopeObserver()
    told = []
    for degrees in (-20.0, 35.5, 400.0, math.nan):
        observer.receive("tilt", Float32(degrees), 0.0)
        (status,) = observer.evaluate(0.0)
        told.append(float(status.values[0].value) if status.message == "QA status" else status.message)
    assert told == [-20.0, 35.5, "QA stale", "QA stale"]
