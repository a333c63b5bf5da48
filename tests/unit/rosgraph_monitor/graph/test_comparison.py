"""What runs against what should run."""

import pytest
from ros_model.graph.snapshot import GraphSnapshot, NodeState, build_snapshot
from ros_model.language.metamodel import Component, Reference, RosParameter, RosSystem, SystemParameter
from ros_model.language.packages_reader import parse_packages
from rosgraph_monitor.diagnostics.status import Level
from rosgraph_monitor.graph.comparison import Scope, compare, wrong_topic_types
from rosgraph_monitor.graph.defaults import parameter_defaults
from rosgraph_monitor.graph.findings import (
    NO_NODE,
    NOT_SET,
    AdditionalNode,
    MissingNode,
    WrongParameter,
    WrongType,
    finding_statuses,
)
from rosgraph_monitor.graph.names import instance, instances, is_ignored_node, relative, resolved
from rosgraph_monitor.graph.values import same_value


def graph(*nodes, **parameters):
    return GraphSnapshot(nodes={n: NodeState(n, f"http://host{n}") for n in nodes}, parameters=parameters)


def system(*components):
    return RosSystem("s", components=components)


def parameter(name, value):
    return RosParameter("label", Reference("p", "a", "n", name), value)


BASE = Component("base", parameters=(parameter("local/speed", 0.5), parameter("unset", None)))


def test_graph_as_desired_has_no_findings():
    assert compare(graph("/base", base={"local": {"speed": 0.5}}), system(BASE), dead={}) == ()


def test_node_that_is_not_registered_is_missing():
    assert compare(graph(), system(BASE), dead={}) == (MissingNode("base", "absent", "not registered with the master"),)


def test_node_that_is_registered_but_dead_is_missing():
    assert compare(graph("/base"), system(BASE), dead={"/base": ("dead", "no answer")}) == (
        MissingNode("base", "dead", "no answer"),
    )


def test_excused_node_raises_no_alarm():
    assert compare(graph(), system(BASE), dead={}, excused={"base"}) == ()


def test_wrong_parameter_has_expected_and_actual_value():
    findings = compare(graph("/base", base={"local": {"speed": 0.3}}), system(BASE), dead={})
    assert findings == (WrongParameter("base", "local/speed", 0.5, 0.3),)
    (status,) = finding_statuses(findings)
    assert status.message == "Wrong param configuration"
    assert status.name == "base"
    assert status.values == (("local/speed", "0.3"), ("expected/local/speed", "0.5"))


def test_parameter_that_is_not_set_is_wrong():
    (status,) = finding_statuses(compare(graph("/base"), system(BASE), dead={}))
    assert status.values[0] == ("local/speed", "<not set>")


def test_additional_node_is_a_warning():
    findings = compare(graph("/base", "/stray", base={"local": {"speed": 0.5}}), system(BASE), dead={})
    assert findings == (AdditionalNode("stray"),)
    (status,) = finding_statuses(findings)
    assert (status.level, status.name, status.message) == (Level.WARN, "stray", "Additional node")


def test_nodes_of_a_second_robot_are_not_additional_but_strays_of_the_own_one_are():
    nodes = ("/rosgraph_monitor", "/arm/stray", "/stray", "/cell_2/rosgraph_monitor", "/cell_2/eye/driver")
    assert compare(graph(*nodes), system(), dead={}) == (AdditionalNode("arm/stray"), AdditionalNode("stray"))


def test_modelled_node_in_the_namespace_of_a_second_robot_is_still_missed():
    live = graph("/cell_2/rosgraph_monitor", "/cell_2/eye")
    assert compare(live, system(Component("cell_2/lamp")), dead={}) == (
        MissingNode("cell_2/lamp", "absent", "not registered with the master"),
    )


def test_dead_node_is_not_additional():
    assert compare(graph("/stray"), system(), dead={"/stray": ("dead", "no answer")}) == ()


@pytest.mark.parametrize(
    "name", ["action_relay", "rosout", "rosgraph_monitor", "rviz_1700000000123", "any_4711_1700000000123"]
)
def test_tools_and_anonymous_nodes_are_ignored(name):
    assert compare(graph(f"/{name}"), system(), dead={}) == ()


def test_additional_patterns_are_a_setting():
    assert is_ignored_node("tool_a", ("/tool_*",))
    assert not is_ignored_node("driver_2", ("tool_*",))


def test_system_in_a_namespace():
    live = graph("/robot/base", "/other", robot={"base": {"local": {"speed": 0.5}}})
    assert compare(live, system(BASE), dead={}, scope=Scope(namespace="/robot")) == ()
    assert resolved("ns/base", "/robot") == "/robot/ns/base"
    assert relative("/other", "/robot") is None


@pytest.mark.parametrize(
    ("expected", "actual", "same"),
    [
        (0.5, 0.5000000001, True),
        (15, 15.0, True),
        (0.5, 0.51, False),
        (True, 1, False),
        ("15", 15, True),
        ("true", True, True),
        ("scan", "scan", True),
        ("scan", "point_cloud", False),
        ([0.1, [1]], [0.1, [1]], True),
        ([0.1], [0.1, 0.2], False),
        ({"a": 1}, {"a": 1, "b": 2}, True),
        ({"a": 1}, {"b": 2}, False),
        ({"a": 1}, 1, False),
    ],
)
def test_same_value(expected, actual, same):
    assert same_value(expected, actual) is same


def test_nan_equals_nan_only():
    assert same_value(float("nan"), float("nan"))
    assert not same_value(float("nan"), 1.0)


def test_parameter_in_a_namespace_of_the_node():
    component = Component("base", parameters=(RosParameter("speed", None, 0.5, namespace="local"),))
    assert compare(graph("/base", base={"local": {"speed": 0.5}}), system(component), dead={}) == ()


def test_parameter_of_the_system_is_compared_but_not_what_only_describes_it():
    described = RosSystem(
        "s", parameters=(SystemParameter("robot_name", value="r"), SystemParameter("qa_safety", value=0.4))
    )
    assert compare(graph(), described, dead={}) == (WrongParameter(NO_NODE, "robot_name", "r", NOT_SET),)
    assert compare(graph(robot_name="r"), described, dead={}) == ()


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("/talker", "/talker"),
        ("/listener", "/listener_1700000000000"),
        ("/pub_11_1600000000000", "/pub_4711_1700000000000"),
        ("/twin", "/twin_1_1700000000001"),
    ],
)
def test_anonymous_instance_stands_for_a_node_of_the_model(name, found):
    running = (
        *("/talker", "/listener_1700000000000", "/pub_4711_1700000000000"),
        *("/twin_1_1700000000001", "/twin_2_1700000000002"),
    )
    assert instance(name, running) == found


SERIALS = ("camera_819612070807", "camera_920312072311")
HOST = "/viewer_bench_12_9007199254740993123"  # as roslaunch names a node that has no name


@pytest.mark.parametrize("other", ["/camera_920312072311", "/camera_1", "/camera_4711_920312072311"])
def test_serial_number_is_not_the_time_of_an_anonymous_node(other):
    assert instance("/camera_819612070807", [other]) is None
    assert not is_ignored_node(other.lstrip("/"), ())


@pytest.mark.parametrize(
    "node", ["/viewer_1700000000", "/viewer_7_1700000000123", "/viewer_1700000000123456789", "/viewer_1700000000123"]
)
def test_times_as_nodes_write_them_are_anonymous(node):
    assert instance("/viewer", [node]) == node
    assert instance("/viewer_bench_99_9107199254740993123", [HOST]) == HOST


def test_device_that_died_is_missing_though_another_of_its_kind_runs():
    desired = system(*map(Component, SERIALS))
    assert compare(graph(f"/{SERIALS[1]}"), desired, dead={}) == (
        MissingNode(SERIALS[0], "absent", "not registered with the master"),
    )
    died = {f"/{SERIALS[0]}": ("dead", "no answer")}
    assert compare(graph(*(f"/{name}" for name in SERIALS)), desired, dead=died) == (
        MissingNode(SERIALS[0], "dead", "no answer"),
    )


def test_node_stands_for_one_component_only_and_first_for_its_own():
    one, other = "/pub_11_1600000000000", "/pub_12_1600000000001"
    assert instances([one, other], [other]) == {other: other}
    again = "/pub_4711_1700000000000"
    assert instances([one, other], [again]) == {one: again}
    assert instances([one, other], [again, other]) == {other: other, one: again}


def test_type_of_a_topic_by_settings():
    live = build_snapshot(
        [[["/scan", ["/laser"]]], [], []], [["/scan", "std_msgs/String"]], {}, {"/laser": "http://x:1/"}
    )
    assert wrong_topic_types(live, {"scan": "std_msgs/String", "absent": "a/B"}) == []
    assert wrong_topic_types(live, {"scan": "sensor_msgs/LaserScan"}) == [
        WrongType("laser", "scan", "sensor_msgs/LaserScan", "std_msgs/String")
    ]


SOURCE = """PackageSet { CatkinPackage p { Artifact pick.py { Node { name picker Parameters {
    Parameter { name speed type Double value 0.3 },
    Parameter { name limits/force type Double default 5.0 },
    Parameter { name grip type String }
} } } } }"""


@pytest.mark.parametrize(
    ("name", "value", "actual"),
    [
        ("speed", 0.3, None),
        ("speed", 0.5, "0.3 (not set: the code's default)"),
        ("limits/force", 5, None),
        ("limits/force", 7, "5.0 (not set: the code's default)"),
        ("grip", "soft", "<not set>"),
        ("other", 1, "<not set>"),
    ],
)
def test_parameter_that_nobody_set_has_the_default_of_the_code(name, value, actual):
    parameters = (RosParameter("label", Reference("p", "pick.py", "pick_1", name), value),)  # as a snapshot names it
    desired = system(Component("pick_1", namespace="cell", parameters=parameters))
    scope = Scope(defaults=parameter_defaults([parse_packages(SOURCE)]))
    found = compare(graph("/cell/pick_1"), desired, dead={}, scope=scope)
    assert [str(wrong.actual) for wrong in found] == ([actual] if actual else [])
    set_otherwise = graph(
        "/cell/pick_1", cell={"pick_1": {"speed": 9, "limits": {"force": 9}, "grip": "x", "other": 9}}
    )
    assert len(compare(set_otherwise, desired, dead={}, scope=scope)) == 1


def test_default_in_which_two_nodes_of_an_executable_differ_is_not_known():
    other = "Node { name other Parameters { Parameter { name speed type Double value 0.9 } } }"
    defaults = parameter_defaults(
        [parse_packages(SOURCE), parse_packages(SOURCE.replace("Node {", f"{other} Node {{"))]
    )
    parameters = (RosParameter("label", Reference("p", "pick.py", "picker", "speed"), 0.3),)
    (wrong,) = compare(
        graph("/a"), system(Component("a", parameters=parameters)), dead={}, scope=Scope(defaults=defaults)
    )
    assert str(wrong.actual) == "<not set>"
