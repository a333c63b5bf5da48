"""Whatever stands in metacontrol.yaml or a table: a project, or an error that names its place; never a traceback."""

import copy
import functools
from pathlib import Path

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ros_model.checks.whole_projects import check_project
from ros_model.errors import ModelError
from ros_model.generators.deployment import manipulator, monitor, reasoner
from ros_model.generators.launch import launch_file
from ros_model.io.project import load_project, problems_of
from ros_model.language.library import Library
from ros_model.language.metamodel import compose
from ros_model.language.packages_writer import write_packages
from ros_model.language.system_writer import write_system
from ros_model.project.observers import described_observers, observer_packages
from ros_model.project.repairs import repair_lines
from ros_model.project.requirements import requirement_lines

BASE = """RosSystem { Name base
    RosComponents (
        ComponentInterface { name robot FromRosNode 'p.robot.robot'
            RosPublishers { RosPublisher odom { RefPublisher 'p.robot.robot.odom' } } },
        ComponentInterface { name guard FromRosNode 'p.guard.guard'
            RosSubscribers { RosSubscriber odom { RefSubscriber 'p.guard.guard.odom' } } },
        ComponentInterface { name nav FromRosNode 'n.nav.nav'
            RosPublishers { RosPublisher cmd { RefPublisher 'n.nav.nav.cmd' } }
            RosParameters { RosParameter speed { RefParameter 'n.nav.nav.speed' value 1 } } } )
    TopicConnections { TopicConnection odom { From ( 'robot.odom' ) To ( 'guard.odom' ) } } }"""
KEPT = {"save_action": "a", "goal_msg_type": "b", "kill_nodes": ["nav"]}
SETTINGS = {
    "package": "p",
    "base": "base.rossystem",
    "variants": [
        {
            "component": "nav",
            "table": "v.yaml",
            "parameters": {"speed": ["speed", {"name": "acc", "factor": 2, "component": "nav"}]},
            "connections": {"wired": {"true": ["robot.odom", {"from": "robot.odom", "to": "nav.pose"}], "false": []}},
            "components": {"guarded": ["guard"]},
            "expected": {"risk": "safety"},
            "ignore": ["note"],
        }
    ],
    "functions": {"f": {"designs": ["a"], "requires": {"a": ["g"]}}, "g": {"designs": ["b"], "requires": [], **KEPT}},
    "quality_attributes": {"safety": {"direction": "lower_is_better", "range": [0, 1]}},
    "utility": "safety",
    "objectives": {"o": {"function": "f", "nfrs": {"safety": 0.5}}},
    "components": {
        "robot": {"node": "robot", "required_by": ["a"], "not_required_by": ["g"]},
        "guard": {"not_required_by": "all"},
        "battery": {
            "topic": "charge",
            "repair": {"service": "swap", "duration": 60, "success": 0.5, "attempts": 3},
        },
        "lamp": {
            "node": "lamp",
            "repair": {"launch": {"package": "p", "file": "l.launch", "args": {"on": True}}, "duration": 1.5},
        },
    },
    "observers": [
        "X",
        {
            "name": "Y",
            "quality_attribute": "safety",
            "topics": {"odom": "nav_msgs/Odometry"},
            "outputs": {"d": "std_msgs/Float32"},
            "rate": 1,
            "range": [0, 1],
            "max_age": 1,
            "plugin": "y:Y",
        },
    ],
    "manipulator": {"action_name": "c"},
    "arguments": {"nav": "--frame odom"},
    "requires": {"speed": {"1": "robot"}},
}
TABLE = {
    "a": {"speed": 0.5, "wired": True, "guarded": True, "risk": 0.1, "note": "x"},
    "b": {"speed": 1, "wired": False, "guarded": False, "risk": 0.2, "note": None},
}
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["", "all", "nav", "nav.cmd", "../x", "/etc/passwd", "$(env HOME)", 'a" b="', "\0", "é", "base"])
    | st.text(max_size=8)
    | st.dates()
    | st.binary(max_size=3)
)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(LEAVES, inner, max_size=3), max_leaves=6
)
SLOW = settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def places(value, keys=()):
    yield keys
    if isinstance(value, dict):
        for key, item in value.items():
            yield from places(item, (*keys, key))
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from places(item, (*keys, number))


def exchanged(content, keys, value):
    if not keys:
        return value
    changed = copy.deepcopy(content)
    functools.reduce(lambda part, key: part[key], keys[:-1], changed)[keys[-1]] = value
    return changed


def try_all(folder):
    """Load the project and generate what needs no other package; return its error, if there is one."""
    try:
        project = load_project(folder)
        for variant in project.variants:
            launch_file(variant, compose(project.base, variant), arguments=project.arguments)
            write_system(variant)
            project.required_functions(variant.name)
        for content in (manipulator(project), reasoner(project), monitor(project)):
            yaml.safe_dump(content)
        write_packages(observer_packages(described_observers(project)))
        assert list(requirement_lines(project))
        assert all(repair_lines(project))
        assert all(finding.message for finding in check_project(project, Library()))
    except ModelError as error:
        return error
    return None


def write(folder: Path, content=SETTINGS, table=TABLE):
    (folder / "base.rossystem").write_text(BASE)
    (folder / "v.yaml").write_text(yaml.safe_dump(table, sort_keys=False))
    (folder / "metacontrol.yaml").write_text(yaml.safe_dump(content, sort_keys=False))


def test_what_is_mutated_here_is_sound(tmp_path):
    write(tmp_path)
    assert try_all(tmp_path) is None


@SLOW
@given(st.sampled_from(list(places(SETTINGS))), VALUES)
def test_any_value_anywhere_in_the_settings(tmp_path, keys, value):
    write(tmp_path, content=exchanged(SETTINGS, keys, value))
    error = try_all(tmp_path)
    if error is not None:
        assert error.position is not None or str(tmp_path) in str(error)
        assert "\n" not in str(error)


@SLOW
@given(st.sampled_from(list(places(TABLE))), VALUES)
def test_any_value_anywhere_in_a_table(tmp_path, keys, value):
    write(tmp_path, table=exchanged(TABLE, keys, value))
    error = try_all(tmp_path)
    if error is not None:
        assert error.position is not None or str(tmp_path) in str(error)


@SLOW
@given(st.text(st.characters(codec="utf-8"), max_size=60))
def test_any_text_for_settings_and_tables(tmp_path, text):
    write(tmp_path)
    for name in ("metacontrol.yaml", "v.yaml"):
        before = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text)
        assert isinstance(try_all(tmp_path), ModelError)
        (tmp_path / name).write_text(before)
    (tmp_path / "metacontrol.yaml").write_text(text)
    try:
        assert problems_of(tmp_path / "metacontrol.yaml")
    except ModelError as error:
        assert "metacontrol.yaml" in str(error)
