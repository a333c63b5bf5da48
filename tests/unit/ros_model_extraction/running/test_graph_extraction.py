"""Models of a running graph, from what a master answers."""

from __future__ import annotations

import xmlrpc.client
from pathlib import Path

import pytest
from ros_model.checks.systems import check_system
from ros_model.generators.launch import launch_file
from ros_model.graph.snapshot import GraphSnapshot, build_snapshot
from ros_model.language.graph_names import resolve
from ros_model.language.library import Library
from ros_model.language.metamodel import ConnectionKind, PortKind, RosSystem
from ros_model.language.packages_reader import parse_packages
from ros_model.language.remappings import remappings_of
from ros_model.language.system_reader import parse_system
from ros_model.language.system_writer import write_system
from ros_model.language.typed_values import fault
from ros_model_extraction.io.live_nodes import executable_of
from ros_model_extraction.names import as_seen_from
from ros_model_extraction.running.details import Details, Origin
from ros_model_extraction.running.graph import NO_PACKAGE, Models, models_of
from ros_model_extraction.values import UnwritableValueError, leaves, typed
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

ACTION_TYPES = {
    "goal": "demo_msgs/MoveActionGoal",
    "cancel": "actionlib_msgs/GoalID",
    "status": "actionlib_msgs/GoalStatusArray",
    "feedback": "demo_msgs/MoveActionFeedback",
    "result": "demo_msgs/MoveActionResult",
}


def graph(publishers=(), subscribers=(), services=(), types=(), parameters=None) -> GraphSnapshot:
    nodes = {node for part in (publishers, subscribers, services) for _, names in part for node in names}
    return build_snapshot(
        (list(publishers), list(subscribers), list(services)), list(types), parameters or {}, dict.fromkeys(nodes, "u")
    )


def extracted(snapshot: GraphSnapshot, details: Details | None = None, *, everything: bool = False) -> Models:
    models = models_of(snapshot, details or Details(), "live", everything=everything)
    again = parse_system(write_system(models.system))
    assert again == models.system
    assert check_system(again) == ()
    return models


def ports(system: RosSystem, component: str) -> set[tuple[PortKind, str]]:
    found = system.component(component)
    assert found
    return {(port.kind, port.name) for port in found.ports}


def test_publisher_and_subscriber_of_a_topic_are_connected_and_typed():
    models = extracted(
        graph([["/scan", ["/laser"]]], [["/scan", ["/map_maker"]]], types=[["/scan", "sensor_msgs/LaserScan"]])
    )
    (connection,) = models.system.connections
    assert (connection.name, connection.kind) == ("scan", ConnectionKind.TOPIC)
    assert [str(end) for end in (*connection.sources, *connection.targets)] == ["laser.scan", "map_maker.scan"]
    declared = models.packages.node(NO_PACKAGE, "laser", "laser")
    assert declared and declared.ports[0].type == "sensor_msgs/LaserScan"


@pytest.mark.parametrize(("written", "kind"), [("Double", "Double"), ("Integer", "Integer"), (None, "Integer")])
def test_whole_number_is_a_double_where_the_source_says_so(written, kind):
    declared = f"Parameters {{ Parameter {{ name power type {written} }} }}" if written else ""
    text = f"PackageSet {{ CatkinPackage wells {{ Artifact pump {{ Node {{ name any_name {declared} }} }} }} }}"
    details = Details(origins={"/well/pump": Origin("wells", "pump")})
    snapshot = graph([["/flow", ["/well/pump"]]], parameters={"well": {"pump": {"power": 10}}})
    models = models_of(snapshot, details, "live", sources=Library(parse_packages(text).packages))
    (parameter,) = models.packages.node("wells", "pump", "pump").parameters
    assert parameter.type.kind == kind
    assert parameter.is_by_value == (written is None)


def test_five_topics_become_an_action_and_a_watcher_of_its_result_stays_a_subscriber():
    models = extracted(
        graph(
            [[f"/move/{part}", ["/client"]] for part in ("goal", "cancel")]
            + [[f"/move/{part}", ["/server"]] for part in ("status", "feedback", "result")],
            [[f"/move/{part}", ["/server"]] for part in ("goal", "cancel")]
            + [[f"/move/{part}", ["/client"]] for part in ("status", "feedback")]
            + [["/move/result", ["/client", "/watcher"]]],
            types=[[f"/move/{part}", kind] for part, kind in ACTION_TYPES.items()],
        )
    )
    assert ports(models.system, "server") == {(PortKind.ACTION_SERVER, "move")}
    assert ports(models.system, "client") == {(PortKind.ACTION_CLIENT, "move")}
    assert ports(models.system, "watcher") == {(PortKind.SUBSCRIBER, "move/result")}
    assert [(c.kind, c.name) for c in models.system.connections] == [(ConnectionKind.ACTION, "move")]
    declared = models.packages.node(NO_PACKAGE, "server", "server")
    assert declared and declared.ports[0].type == "demo_msgs/MoveAction"


def test_who_sends_goals_but_does_not_hear_all_that_a_server_says_is_a_publisher_and_a_listener():
    models = extracted(
        graph(
            [["/move/goal", ["/keeper"]], ["/move/cancel", ["/keeper"]]]
            + [[f"/move/{part}", ["/server"]] for part in ("status", "feedback", "result")],
            [["/move/goal", ["/keeper", "/server"]], ["/move/cancel", ["/server"]], ["/move/result", ["/keeper"]]],
            types=[[f"/move/{part}", kind] for part, kind in ACTION_TYPES.items()],
        )
    )
    assert ports(models.system, "server") == {(PortKind.ACTION_SERVER, "move")}
    assert ports(models.system, "keeper") == {
        (PortKind.PUBLISHER, "move/goal"),
        (PortKind.PUBLISHER, "move/cancel"),
        (PortKind.SUBSCRIBER, "move/goal"),
        (PortKind.SUBSCRIBER, "move/result"),
    }


def test_what_every_node_has_is_left_out_and_said_so():
    snapshot = graph(
        [["/rosout", ["/talker"]], ["/chatter", ["/talker"]]],
        [["/clock", ["/talker"]], ["/rosout", ["/rosout"]]],
        [["/talker/get_loggers", ["/talker"]], ["/talker/reset", ["/talker"]]],
        [["/chatter", "std_msgs/String"]],
        {
            "run_id": "x",
            "roslaunch": {"uris": {"host": "u"}},
            "node_kit": {"began_with": {"r": "x"}},
            "use_sim_time": True,
        },
    )
    models = extracted(snapshot)
    assert ports(models.system, "talker") == {
        (PortKind.PUBLISHER, "chatter"),
        (PortKind.SERVICE_SERVER, "talker/reset"),
    }
    assert [p.name for p in models.system.parameters] == ["use_sim_time"]
    assert models.system.component("rosout") is None
    assert "~get_loggers" in models.system.header
    everything = extracted(snapshot, everything=True)
    assert (PortKind.SUBSCRIBER, "/clock") in ports(everything.system, "talker")
    assert everything.system.component("rosout")


def test_service_has_the_type_that_its_node_told_and_what_is_not_known_is_said():
    snapshot = graph(services=[["/a/reset", ["/a"]], ["/b/reset", ["/b"]]], subscribers=[["/odd", ["/a"]]])
    details = Details({"/a": Origin("demo", "a.py")}, {"/b": "it does not answer"}, {"/a/reset": "std_srvs/Empty"})
    models = extracted(snapshot, details)
    declared = models.packages.node("demo", "a.py", "a")
    assert declared and {port.name: port.type for port in declared.ports} == {"odd": "", "a/reset": "std_srvs/Empty"}
    header = models.packages.header
    assert "who calls which service" in header
    assert "the types of the services /b/reset." in header
    assert "the types of the topics /odd." in header
    assert "the package and executable of /b: it does not answer." in header


def test_private_parameters_go_to_their_node_and_the_others_to_the_system():
    tree = {"laser": {"filter": {"width": 3}, "name": "front"}, "max_vel": 0.5, "robot": {"arm": {"joints": [1, 2]}}}
    models = extracted(graph([["/scan", ["/laser"]], ["/x", ["/robot/arm"]]], parameters=tree))
    laser, arm = (models.system.component(name) for name in ("laser", "arm"))
    assert laser and {p.key: p.value for p in laser.parameters} == {"filter/width": 3, "name": "front"}
    assert arm and {p.key: p.value for p in arm.parameters} == {"joints": [1, 2]}
    assert [(p.name, p.value) for p in models.system.parameters] == [("max_vel", 0.5)]


def test_namespaces_are_kept_and_names_written_as_the_node_sees_them():
    models = extracted(graph([["/robot/scan", ["/robot/laser"]], ["/tf", ["/robot/laser"]]]))
    laser = models.system.component("laser")
    assert laser and laser.namespace == "/robot" and laser.graph_name == "robot/laser"
    assert ports(models.system, "laser") == {(PortKind.PUBLISHER, "scan"), (PortKind.PUBLISHER, "/tf")}


def test_same_node_in_two_namespaces_has_two_components_and_one_declaration():
    publishers = [["/left/scan", ["/left/laser"]], ["/right/scan", ["/right/laser"]]]
    origins = {"/left/laser": Origin("demo", "laser"), "/right/laser": Origin("demo", "laser")}
    models = extracted(graph(publishers, [["/left/scan", ["/fusion"]], ["/right/scan", ["/fusion"]]]), Details(origins))
    assert {c.graph_name for c in models.system.components} == {"fusion", "left/laser", "right/laser"}
    assert [[str(end) for end in c.sources] for c in models.system.connections] == [
        ["left/laser.scan"],
        ["right/laser.scan"],
    ]
    declared = models.packages.node("demo", "laser", "laser")
    assert declared and [port.name for port in declared.ports] == ["scan"]


def test_dead_node_is_left_out_and_said_so():
    models = extracted(graph([["/scan", ["/laser", "/other"]]]), Details(dead=frozenset({"/laser"})))
    assert [component.name for component in models.system.components] == ["other"]
    assert "/laser: the master lists them, but nobody listens there" in models.system.header


def test_artifact_is_the_executable_that_roslaunch_is_to_start():
    origins = {"/cell/eye": Origin("vision", "detector_fast.py"), "/odd": Origin("vision", "node_1.0")}
    models = extracted(graph([["/cell/found", ["/cell/eye"]], ["/x", ["/odd"]]]), Details(origins))
    text = launch_file(models.system)
    assert [f'type="{name}"' in text for name in ("detector_fast.py", "node_1.0")] == [True, True]


def test_parameters_of_nodes_that_have_ended_are_left_out_and_said():
    tree = {
        "eye": {"rate": 5},
        "old": {"costmap": {"width": 3}, "rate": 1},
        "cell": {"gone": {"rate": 2}, "speed": 0.5},
        "arm_controller": {"joints": ["a"]},
        "crashed": {"rate": 9},
        "max_vel": 0.5,
    }
    publishers = [["/found", ["/eye"]], ["/cell/x", ["/cell/arm", "/crashed"]], ["/arm_controller/x", ["/cell/arm"]]]
    models = extracted(graph(publishers, parameters=tree), Details(dead=frozenset({"/crashed"})))
    assert {p.name for p in models.system.parameters} == {"arm_controller/joints", "cell/speed", "max_vel"}
    assert "the parameters below /cell/gone, /old: no running node is there" in models.system.header
    everything = extracted(graph(publishers, parameters=tree), everything=True)
    assert "old/costmap/width" in {p.name for p in everything.system.parameters}


def test_nodes_of_the_meta_controller_and_their_parameters_are_left_out_and_said():
    watching = "/rosgraph_monitor", "/cell/reasoner", "/rosgraph_manipulator", "/my_launcher", "/reasoner"
    tree = {name.lstrip("/"): {"rate": 2} for name in ("/rosgraph_monitor", "/my_launcher", "/reasoner")}
    tree |= {"kill_nodes": ["/x"], "configurations": {"a": {"launch": "b"}}, "max_vel": 0.5}
    origins = {
        "/my_launcher": Origin("rosgraph_launcher", "rosgraph_launcher"),
        "/reasoner": Origin("logic", "reasoner"),  # somebody else's node of that name
    }
    snapshot = graph([["/diagnostics", [*watching, "/eye"]]], parameters=tree)
    models = extracted(snapshot, Details(origins))
    assert {c.name for c in models.system.components} == {"eye", "reasoner"}
    assert {p.name for p in models.system.parameters} == {"max_vel"}
    assert "/my_launcher, /rosgraph_manipulator, /rosgraph_monitor: the meta-controller's" in models.system.header
    assert len(extracted(snapshot, Details(origins), everything=True).system.components) == 6


def test_value_without_notation_is_left_out_and_said_so():
    models = extracted(graph([["/x", ["/a"]]], parameters={"a": {"limit": float("inf")}, "nothing": [{}]}))
    component = models.system.component("a")
    assert component and component.parameters[0].value is None
    assert "the value of the parameter a/limit: inf is no finite number" in models.system.header.replace("/a/", "a/")
    assert "/nothing" in models.system.header


@pytest.mark.parametrize(
    ("raw", "kind"),
    [
        (True, "Boolean"),
        (1, "Integer"),
        (1.5, "Double"),
        ("x\n", "String"),
        ([1, 2.5], "Array"),
        ([1, "a"], "List"),
        ([], "List"),
        ([{"a": 1}, {"a": 2}], "List"),
        ([[0.1, 0.2], [0.3, 0.4]], "Array"),
        ({"a": {"b": [1]}}, "Struct"),
        (xmlrpc.client.Binary(b"\0\xff"), "Base64"),
        (xmlrpc.client.DateTime(0), "Date"),
    ],
)
def test_every_kind_of_parameter_has_a_type_that_fits(raw, kind):
    assert typed(raw)[0].kind == kind
    extracted(graph([["/x", ["/a"]]], parameters={"p": raw} if not isinstance(raw, dict) else {"p": [raw]}))


FILTERS = [{"name": "range", "params": {"upper": 5.0}}, {"name": "box", "type": "Box"}]


@pytest.mark.parametrize("now", [FILTERS, FILTERS[:1], FILTERS[:1] * 2, [1, "a"], [], [[1, 2], ["a"]]])
@pytest.mark.parametrize("later", [FILTERS, FILTERS[1:], [], [*FILTERS, *FILTERS]])
def test_list_of_a_moment_is_no_limit_for_other_values(now, later):
    assert fault(later, typed(now)[0]) is None


def test_list_with_bytes_keeps_its_types():
    kind, value = typed([1, xmlrpc.client.Binary(b"hi")])
    assert ([element.kind for element in kind.elements], value) == (["Integer", "Base64"], [1, "aGk="])


def nested(depth, around, inside=1):
    for _ in range(depth):
        inside = around(inside)
    return inside


@pytest.mark.parametrize(
    ("around", "deepest"), [(lambda inside: [inside], 64), (lambda inside: {"a": inside}, 32)], ids=["lists", "structs"]
)
def test_value_may_be_nested_as_deep_as_the_language_reads(around, deepest):
    extracted(graph([["/x", ["/a"]]], parameters={"p": nested(deepest - 1, around, [1])}))
    for depth in (deepest + 1, 100_000):
        with pytest.raises(UnwritableValueError, match="nested deeper than 64 levels"):
            typed(nested(depth, around))


@pytest.mark.parametrize("value", [10**400, -(10**400), [[10**5000]]])
def test_number_that_the_language_can_not_hold_is_left_out_and_said(value):
    models = extracted(graph([["/x", ["/a"]]], parameters={"a": {"p": value}, "q": value}))
    assert [parameter.value for parameter in models.system.component("a").parameters] == [None]
    assert models.system.parameters == ()
    for name in ("/a/p", "/q"):
        assert f"Left out: the value of the parameter {name}: it is too large for a double." in models.system.header


def test_namespaces_within_each_other_without_end_are_one_value():
    circle = {}
    circle["a"] = circle
    ((name, value),) = leaves(circle)
    assert len(name.split("/")) > 100
    with pytest.raises(UnwritableValueError):
        typed(value)


def test_none_and_empty_structs_have_no_notation():
    for raw in (None, {}, [None], object()):
        with pytest.raises(UnwritableValueError):
            typed(raw)
    assert list(leaves({"a": {"b": 1, "c": {}}, "d": 2})) == [("a/b", 1), ("d", 2)]


def test_names_resolve_and_are_seen_from_a_node():
    assert [resolve(name, "/robot/arm") for name in ("x", "~x", "/x", "x/y/")] == [
        "/robot/x",
        "/robot/arm/x",
        "/x",
        "/robot/x/y",
    ]
    assert [as_seen_from("/robot/arm", name) for name in ("/robot/x", "/x", "/robotic")] == ["x", "/x", "/robotic"]
    assert as_seen_from("/arm", "/tf") == "tf"


def test_executable_is_found_behind_an_interpreter(tmp_path: Path):
    script = tmp_path / "lib" / "demo" / "talker.py"
    script.parent.mkdir(parents=True)
    script.touch()
    wanted = Origin("demo", "talker.py")
    assert executable_of(["/usr/bin/python3", "-u", str(script), "__name:=x"], tmp_path, ["demo"]) == wanted
    line = ["lib/demo/talker.py", "__log:=x"]
    assert executable_of(line, tmp_path, ["demo"]) == wanted
    assert executable_of([str(script)], tmp_path, ["other"]) is None
    assert executable_of(["python3", "-m", "demo.talker"], tmp_path, ["demo"]) is None


def test_command_line_tells_remappings_and_arguments(tmp_path: Path):
    script = tmp_path / "lib" / "demo" / "talker.py"
    script.parent.mkdir(parents=True)
    script.touch()
    line = [str(script), "-f", "map", "~in:=/front", "__name:=x", "_rate:=5", "out:=back", ""]
    wanted = Origin("demo", "talker.py", (("~in", "/front"), ("out", "back")), ("-f", "map"))
    assert executable_of(["/usr/bin/python3", "-u", *line], tmp_path, ["demo"]) == wanted


def remapped(*remaps, arguments=()):
    origin = Origin("demo", "gate", remaps, arguments)
    publishers = [["/base/wheels", ["/base/gate"]], ["/joints", ["/base/gate"]]]
    subscribers = [["/base/mux", ["/base/gate"]], ["/base/wheels", ["/base/gate"]]]
    return extracted(graph(publishers, subscribers), Details({"/base/gate": origin}))


def test_remapped_interface_refers_to_its_name_in_the_code_and_a_launch_file_remaps_it_again():
    models = remapped(("~in", "/base/mux"), ("~out", "wheels"), ("~feedback", "wheels"), ("joint_states", "/joints"))
    system, packages = models.system, models.packages
    gate = system.component("gate")
    assert gate and {port.reference.name for port in gate.ports if port.reference} == {
        "~in",
        "~out",
        "~feedback",
        "joint_states",
    }
    declared = packages.node("demo", "gate", "gate")
    assert declared and {port.name for port in declared.ports} == {"~in", "~out", "~feedback", "joint_states"}
    wheels = "/base/wheels"
    assert launched_remaps(system) == {
        "~in": "/base/mux",
        "~out": wheels,
        "~feedback": wheels,
        "joint_states": "/joints",
    }


def test_remapped_action_refers_to_its_name_in_the_code():
    topics = ("goal", "cancel", "status", "result", "feedback")
    inputs = [[f"/base/grasp/{topic}", ["/base/hand"]] for topic in topics[:2]]
    outputs = [[f"/base/grasp/{topic}", ["/base/hand"]] for topic in topics[2:]]
    origin = Origin("demo", "hand", tuple((f"~do/{topic}", f"grasp/{topic}") for topic in topics))
    types = [[f"/base/grasp/{topic}", ACTION_TYPES[topic]] for topic in topics]
    models = extracted(graph(outputs, inputs, types=types), Details({"/base/hand": origin}))
    hand = models.system.component("hand")
    assert hand and [(port.kind, port.reference.name) for port in hand.ports if port.reference] == [
        (PortKind.ACTION_SERVER, "~do")
    ]
    assert "remapping" not in models.system.header


def launched_remaps(system):
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load_string(launch_file(system), config, verbose=False)
    (node,) = config.nodes
    return {inside: resolve(outside, "/base/gate") for inside, outside in node.remap_args}


def test_arguments_are_told():
    assert "the arguments of /base/gate: -f map" in remapped(arguments=("-f", "map")).system.header


def test_launch_file_remaps_names_that_no_interface_has_yet():
    models = remapped(("unheard", "silence"), ("~in", "/base/mux"), ("~grasp/goal", "hand/goal"))
    found = launched_remaps(parse_system(write_system(models.system)))
    wanted = {"~in": "/base/mux", "unheard": "/base/silence", "~grasp/goal": "/base/hand/goal"}
    assert found.items() >= wanted.items()


def source_of(executable, subscribers):
    listed = ", ".join(f"Subscriber {{ name '{name}' message 'nav_msgs.Odometry' }}" for name in subscribers)
    return Library(
        parse_packages(
            f"PackageSet {{ CatkinPackage carts {{ Artifact {executable} {{ Node {{ name main"
            f" Subscribers {{ {listed} }} }} }} }} }}"
        ).packages
    )


NO_SOURCE = Library()


def follower(*remaps, subscribers=("/laser/odom",), sources=NO_SOURCE):
    snapshot = graph([["/laser/odom", ["/matcher"]]], [[name, ["/follower"]] for name in subscribers])
    details = Details({"/follower": Origin("carts", "follow.py", remaps)})
    models = models_of(snapshot, details, "live", sources=sources)
    found = models.system.component("follower")
    return models.system, [port.reference.name for port in found.ports if port.reference]


OWN_OUT = ("out", "/odom")
OUTER, OWN = ("/laser/odom", "laser/odom"), ("odometry", "laser/odom")


@pytest.mark.parametrize("remaps", [(OUTER, OWN), (OWN, OUTER)])
def test_remapping_to_a_relative_name_for_all_nodes_does_not_hide_that_of_the_node(remaps):
    system, names = follower(*remaps)
    assert names == ["odometry"]
    assert remappings_of(system.header) == {"follower": (OUTER,)}


@pytest.mark.parametrize("declared", ["odometry", "~start", "/odometry"])
def test_of_several_remappings_to_one_name_the_source_tells_which_is_meant(declared):
    remaps = [OUTER, ("~start", "laser/odom"), OWN]
    system, (name,) = follower(*remaps, sources=source_of("follow.py", [declared]))
    assert resolve(name, "/follower") == resolve(declared, "/follower")
    assert remappings_of(system.header)["follower"] == tuple(pair for pair in remaps if pair[0] != name)


def test_remappings_of_which_nothing_tells_which_is_meant_are_all_in_the_launch_file():
    system, _ = follower(("a", "laser/odom"), OUTER, ("b", "laser/odom"))
    text = launch_file(system)
    assert [f'from="{name}" to="laser/odom"' in text for name in ("a", "b", "/laser/odom")] == [True] * 3


def test_second_name_of_an_action_stays_beside_the_one_that_is_taken():
    topics = ("goal", "cancel", "status", "result", "feedback")
    inputs = [[f"/dock/{topic}", ["/arm"]] for topic in topics[:2]]
    outputs = [[f"/dock/{topic}", ["/arm"]] for topic in topics[2:]]
    pairs = {name: tuple((f"{name}/{topic}", f"dock/{topic}") for topic in topics) for name in ("/dock", "~go")}
    details = Details({"/arm": Origin("demo", "arm", (*pairs["/dock"], *pairs["~go"]))})
    types = [[f"/dock/{topic}", ACTION_TYPES[topic]] for topic in topics]
    system = extracted(graph(outputs, inputs, types=types), details).system
    (port,) = system.components[0].ports
    assert (port.kind, port.reference.name) == (PortKind.ACTION_SERVER, "~go")
    assert remappings_of(system.header) == {"arm": pairs["/dock"]}


@pytest.mark.parametrize(
    ("topic", "declared", "remaps", "seen", "code"),
    [
        ("/odom", ["/odom"], (), "/odom", "/odom"),
        ("/odom", ["odom"], (), "odom", "odom"),
        ("/odom", ["/odom", "odom"], (), "odom", "odom"),
        ("/odom", [], (), "odom", "odom"),
        ("/odom", ["/odom"], (("/odom", "odom"),), "odom", "/odom"),
        ("/odom", ["in"], (("in", "/odom"),), "/odom", "in"),
        ("/odom", ["in"], (("in", "odom"),), "odom", "in"),
        ("/diagnostics", [], (), "/diagnostics", "/diagnostics"),
        ("/diagnostics", ["diagnostics"], (), "diagnostics", "diagnostics"),
        ("/tf", [], (("/tf", "tf"),), "tf", "/tf"),
        ("/front/tf", [], (), "front/tf", "front/tf"),
    ],
)
def test_name_that_the_code_has_with_a_slash_keeps_it_in_a_snapshot_at_the_root(topic, declared, remaps, seen, code):
    snapshot = graph([], [[topic, ["/follower"]]])
    details = Details({"/follower": Origin("carts", "follow.py", remaps)})
    models = models_of(snapshot, details, "live", sources=source_of("follow.py", declared))
    (component,) = models.system.components
    assert [(port.name, port.reference.name) for port in component.ports] == [(seen, code)]
    node = models.packages.node("carts", "follow.py", "follower")
    assert node and [port.name for port in node.ports] == [code]


@pytest.mark.parametrize(("source", "name"), [(["/odom"], "/odom"), (["odom"], "odom")])
def test_connection_keeps_the_slash_that_all_its_ends_have(source, name):
    snapshot = graph([["/odom", ["/wheels"]], ["/tf", ["/wheels"]]], [[end, ["/follower"]] for end in ("/odom", "/tf")])
    details = Details({"/follower": Origin("carts", "follow.py"), "/wheels": Origin("carts", "drive.py", (OWN_OUT,))})
    system = models_of(snapshot, details, "live", sources=source_of("follow.py", source)).system
    assert {(c.name, str(c.sources[0]), str(c.targets[0])) for c in system.connections} == {
        ("/tf", "wheels./tf", "follower./tf"),
        (name, "wheels./odom", f"follower.{name}"),
    }


def test_interface_that_the_source_declares_and_the_node_does_not_have_is_told():
    sources = source_of("follow.py", ["odometry", "~late", "{topic}@follow.py:3"])
    system, _ = follower(OWN, sources=sources)
    assert "/follower does not have them now, though its source declares them: subscriber ~late. Use" in system.header
    assert "does not have them" not in follower(OWN)[0].header


def test_executable_in_a_source_tree_belongs_to_the_package_around_it(tmp_path: Path):
    script = tmp_path / "demo" / "scripts" / "talker"
    script.parent.mkdir(parents=True)
    script.touch()
    (tmp_path / "demo" / "package.xml").write_text("<package><name>demo</name></package>")
    assert executable_of([str(script)], tmp_path, []) == Origin("demo", "talker")


def test_executable_is_found_behind_a_module_that_runs_it(tmp_path: Path):
    runner, script = tmp_path / "lib" / "host" / "run.py", tmp_path / "lib" / "demo" / "talker"
    for path in (runner, script):
        path.parent.mkdir(parents=True)
        path.touch()
    script.chmod(0o755)
    arguments = ["/usr/bin/python3", str(runner), str(script), "__name:=x"]
    assert executable_of(arguments, tmp_path, ["demo", "host"]) == Origin("demo", "talker")
    assert executable_of(arguments[:2], tmp_path, ["demo", "host"]) == Origin("host", "run.py")
