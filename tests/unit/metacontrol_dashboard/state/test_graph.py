"""The graph beside the desired one, of a boat in a namespace."""

import pytest
from metacontrol_dashboard.state.graph import entries_of_bag, graph_entries, judged
from metacontrol_dashboard.state.places import topics_of_places
from ros_model.graph.snapshot import build_snapshot
from ros_model.language.system_reader import parse_system
from rosgraph_monitor.diagnostics.overview import Row
from rosgraph_monitor.graph.desired import Desired

SYSTEM = """RosSystem { Name boat RosComponents (
  ComponentInterface { name sonar FromRosNode "sea.sonar.sonar"
    RosPublishers { RosPublisher echo { RefPublisher "sea.sonar.sonar.echo" } } },
  ComponentInterface { name pilot FromRosNode "sea.pilot.pilot"
    RosSubscribers { RosSubscriber sound { RefSubscriber "sea.pilot.pilot.sound" } } })
  TopicConnections { TopicConnection "echo" { From ("sonar.echo") To ("pilot.sound") } } }"""


def desired():
    return Desired(parse_system(SYSTEM, "boat.rossystem"))


def snapshot(publishers, subscribers):
    names = {node for _, nodes in (*publishers, *subscribers) for node in nodes}
    types = [(name, "std_msgs/Float32") for name, _ in publishers]
    return build_snapshot((publishers, subscribers, []), types, {}, {name: f"http://{name}" for name in names})


@pytest.fixture
def running():
    return snapshot([("/boat/echo", ["/boat/sonar"])], [("/boat/echo", ["/boat/pilot"])])


def test_running_and_wanted_are_alike(running):
    nodes, topics = graph_entries(running, desired(), {}, "/boat")
    assert {name: (node["state"], node["seen"], node["wanted"]) for name, node in nodes.items()} == {
        "/boat/sonar": ("ok", True, True),
        "/boat/pilot": ("ok", True, True),
    }
    assert topics["/boat/echo"]["wanted_pub"] == topics["/boat/echo"]["pub"] == ["/boat/sonar"]
    assert topics["/boat/echo"]["wanted_sub"] == ["/boat/pilot"]


def test_connection_has_the_name_that_its_ends_have_where_several_would_do():
    graph = snapshot(
        [("/boat/echo", ["/boat/other"]), ("/boat/sound", ["/boat/sonar"])], [("/boat/sound", ["/boat/pilot"])]
    )
    topics = graph_entries(graph, desired(), {}, "/boat")[1]
    assert topics["/boat/sound"]["wanted_pub"] == ["/boat/sonar"]
    assert topics["/boat/echo"]["wanted_pub"] == []


def test_missing_node_and_its_connection_are_there_all_the_same():
    nodes, topics = graph_entries(snapshot([], [("/boat/echo", ["/boat/pilot"])]), desired(), {}, "/boat")
    assert (nodes["/boat/sonar"]["state"], nodes["/boat/sonar"]["seen"]) == ("missing", False)
    assert (topics["/boat/echo"]["pub"], topics["/boat/echo"]["wanted_pub"]) == ([], ["/boat/sonar"])


@pytest.mark.parametrize(
    ("message", "values", "state"),
    [
        ("Missing node", {"actual": "dead", "reason": "dead: it ended"}, "missing"),
        ("Missing node", {"actual": "hung", "reason": "hung"}, "hung"),
        ("Wrong param configuration", {}, "drifted"),
        ("Additional port", {}, "wrong"),
        ("Additional node", {}, "additional"),
    ],
)
def test_findings_of_the_monitor_are_states(running, message, values, state):
    findings = {("sonar", message, ""): Row(0.0, 2, "text", values)}
    assert graph_entries(running, desired(), findings, "/boat")[0]["/boat/sonar"]["state"] == state


def test_the_worst_finding_counts(running):
    findings = {
        ("sonar", "Additional port", ""): Row(0.0, 2, ""),
        ("sonar", "Missing node", ""): Row(0.0, 2, "", {"actual": "hung"}),
        ("sonar", "Wrong param configuration", ""): Row(0.0, 2, ""),
    }
    assert graph_entries(running, None, findings, "/boat")[0]["/boat/sonar"]["state"] == "hung"


def test_silent_topic_is_marked(running):
    findings = {("echo", "Silent topic", ""): Row(0.0, 2, "", {"reason": "nothing for 3 s"})}
    topic = graph_entries(running, None, findings, "/boat")[1]["/boat/echo"]
    assert (topic["state"], topic["why"]) == ("silent", "nothing for 3 s")


def test_other_robots_are_left_out():
    graph = snapshot([("/boat/echo", ["/boat/sonar"]), ("/buoy/light", ["/buoy/lamp", "/buoy/rosgraph_monitor"])], [])
    assert set(graph_entries(graph, None, {}, "/boat")[0]) == {"/boat/sonar"}
    assert set(graph_entries(graph, None, {}, "/")[0]) == {"/boat/sonar"}


def test_action_is_one_topic_from_client_to_server():
    types = {end: f"sea/Dive{kind}" for end, kind in (("goal", "ActionGoal"), ("result", "ActionResult"))}
    to_server = [(f"/dive/{end}", ["/captain"]) for end in ("goal", "cancel")]
    to_client = [(f"/dive/{end}", ["/diver"]) for end in ("status", "feedback", "result")]
    heard = [(f"/dive/{end}", ["/diver"]) for end in ("goal", "cancel")]
    heard += [(f"/dive/{end}", ["/captain"]) for end in ("status", "feedback", "result")]
    graph = build_snapshot(
        (to_server + to_client, heard, []),
        [(f"/dive/{end}", kind) for end, kind in types.items()],
        {},
        {"/captain": "a", "/diver": "b"},
    )
    topics = graph_entries(graph, None, {})[1]
    assert list(topics) == ["/dive"]
    assert (topics["/dive"]["pub"], topics["/dive"]["sub"]) == (["/captain"], ["/diver"])


def test_bag_tells_who_published():
    nodes, topics = entries_of_bag([("/sonar", "/echo", "std_msgs/Float32"), ("", "/x", "y")])
    assert nodes["/sonar"]["pub"] == ["/echo"]
    assert topics["/echo"]["pub"] == ["/sonar"]


def test_findings_mark_nodes_of_a_bag_and_add_those_that_are_missing():
    findings = {
        ("sonar", "Missing node", ""): Row(0.0, 2, "", {"actual": "dead", "reason": "dead"}),
        ("lamp", "Additional node", ""): Row(0.0, 1, ""),
    }
    entries = entries_of_bag([("/boat/lamp", "/boat/light", "std_msgs/Float32")], "/boat")
    nodes, topics = judged(*entries, findings, "/boat")
    assert {name: (node["state"], node["seen"]) for name, node in nodes.items()} == {
        "/boat/lamp": ("additional", True),
        "/boat/sonar": ("missing", False),
    }
    assert topics["/boat/light"]["state"] == "ok"


def test_places_are_known_by_type_and_usual_name():
    topics = [
        ("/boat/chart/map", "nav_msgs/OccupancyGrid"),
        ("/boat/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped"),
        ("/boat/ground_truth/state", "nav_msgs/msg/Odometry"),
        ("/boat/odom", "nav_msgs/Odometry"),
        ("/boat/pilot/global_plan", "nav_msgs/Path"),
    ]
    assert topics_of_places(topics) == {
        "map": "/boat/chart/map",
        "pose": "/boat/ground_truth/state",
        "way": "/boat/pilot/global_plan",
    }
