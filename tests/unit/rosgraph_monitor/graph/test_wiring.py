"""Interfaces, types and connections against the model."""

import pytest
from ros_model.graph.snapshot import build_snapshot
from ros_model.language.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    Port,
    PortKind,
    PortPath,
    Reference,
    RosSystem,
)
from ros_model.language.packages import Artifact, Node, Package, PackageSet, PortDeclaration
from rosgraph_monitor.diagnostics.status import Level
from rosgraph_monitor.graph.comparison import Scope, compare
from rosgraph_monitor.graph.findings import (
    AdditionalNode,
    AdditionalPort,
    MissingConnection,
    MissingPort,
    WrongType,
    finding_statuses,
)
from rosgraph_monitor.graph.wiring import port_types

PUB, SUB, SRV = PortKind.PUBLISHER, PortKind.SUBSCRIBER, PortKind.SERVICE_SERVER
SERVER, CLIENT = PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT
PARTS = {"goal": True, "cancel": True, "status": False, "feedback": False, "result": False}


def port(name, kind, inside=None, namespace=None):
    return Port(name, kind, Reference("p", "a", "n", inside or name), namespace)


def connection(name, source, target, kind=ConnectionKind.TOPIC):
    return Connection(name, kind, (PortPath.parse(source),), (PortPath.parse(target),))


def system(*connections, **ports):
    return RosSystem("s", tuple(Component(name, ports=tuple(p)) for name, p in ports.items()), connections)


def graph(pubs=(), subs=(), services=(), types=(), nodes=("/laser", "/nav")):
    addresses = {node: f"http://host{node}" for node in nodes}
    return build_snapshot([list(pubs), list(subs), list(services)], types, {}, addresses)


def action(name, servers, clients, type_name="m/MoveActionGoal"):
    pubs = [[f"{name}/{part}", clients if to_server else servers] for part, to_server in PARTS.items()]
    subs = [[f"{name}/{part}", servers if to_server else clients] for part, to_server in PARTS.items()]
    return {"pubs": pubs, "subs": subs, "types": [[f"{name}/goal", type_name]]}


MODEL = system(
    connection("scan", "laser.scan", "nav.scan"), laser=[port("scan", PUB)], nav=[port("scan", SUB), port("cmd", PUB)]
)
AS_MODELLED = {
    "pubs": [["/scan", ["/laser"]], ["/cmd", ["/nav"]], ["/rosout", ["/laser", "/nav"]]],
    "subs": [["/scan", ["/nav"]], ["/clock", ["/nav"]], ["/cmd", ["/driver"]]],
    "services": [["/nav/get_loggers", ["/nav"]]],
    "nodes": ("/laser", "/nav", "/driver"),
}
DRIVER = {"scope": Scope(ignored_nodes=("driver",))}


def findings(model, **live):
    return compare(graph(**live), model, dead={}, **DRIVER)


def test_wiring_as_modelled_has_no_findings():
    assert findings(MODEL, **AS_MODELLED) == ()


def test_missing_port_and_the_connection_that_goes_with_it():
    live = AS_MODELLED | {"pubs": [["/cmd", ["/nav"]]]}
    assert set(findings(MODEL, **live)) == {
        MissingPort("laser", "publisher", "scan"),
        MissingConnection(
            "scan", "laser.scan", "nav.scan", "laser.scan gives nothing, nav.scan takes scan", ("laser", "nav")
        ),
    }


def test_ports_on_different_topics_are_not_connected():
    model = system(connection("scan", "laser.scan", "nav.input"), laser=[port("scan", PUB)], nav=[port("input", SUB)])
    (finding,) = findings(model, pubs=[["/scan", ["/laser"]]], subs=[["/input", ["/nav"]], ["/scan", ["/driver"]]])
    assert finding.actual == "laser.scan gives scan, nav.input takes input"
    assert findings(model, pubs=[["/scan", ["/laser"]]], subs=[["/scan", ["/nav"]]]) == ()


def test_port_may_be_called_as_its_connection_or_as_in_the_code():
    model = system(laser=[port("front", PUB, inside="scan")])
    assert findings(model, pubs=[["/scan", ["/laser"]]], nodes=("/laser",)) == ()
    assert findings(model, pubs=[["/front", ["/laser"]]], nodes=("/laser",)) == ()
    wired = system(connection("/a/b", "laser.front", "nav.x"), laser=[port("front", PUB)], nav=[port("x", SUB)])
    assert findings(wired, pubs=[["/a/b", ["/laser"]]], subs=[["/a/b", ["/nav"]]]) == ()


def test_additional_ports_but_not_those_that_all_nodes_have():
    live = AS_MODELLED | {"pubs": [*AS_MODELLED["pubs"], ["/extra", ["/laser"]], ["/laser/own", ["/laser"]]]}
    assert findings(MODEL, **live) == (AdditionalPort("laser", "publisher", "extra"),)
    quiet = Scope(ignored_nodes=("driver",), ignored_ports=("/extra", "~*", "/rosout", "/clock"))
    assert compare(graph(**live), MODEL, dead={}, scope=quiet) == ()
    strict = Scope(ignored_nodes=("driver",), ignored_ports=("/rosout", "/clock", "*/get_loggers"))
    assert AdditionalPort("laser", "publisher", "laser/own") in compare(graph(**live), MODEL, dead={}, scope=strict)


@pytest.mark.parametrize("namespace", ["/", "/rover"])
def test_parts_of_a_node_that_are_reconfigured_come_and_go(namespace):
    inner = [port("laser/range/set_parameters", SRV), port("laser/range/parameter_updates", PUB)]
    model = system(laser=[*inner, port("nav/range/set_parameters", SRV), port("laser/range/reset", SRV)])
    node = f"/{namespace.strip('/')}/laser".replace("//", "/")
    found = compare(graph(nodes=(node,)), model, dead={}, scope=Scope(namespace=namespace))
    missing = [finding.name for finding in found if isinstance(finding, MissingPort)]
    assert missing == ["nav/range/set_parameters", "laser/range/reset"]


def test_component_without_ports_in_the_model_is_not_judged():
    assert findings(system(laser=[]), pubs=[["/scan", ["/laser"]]], nodes=("/laser",)) == ()


def test_dead_node_has_no_findings_on_its_ports():
    live = graph(**(AS_MODELLED | {"pubs": [["/cmd", ["/nav"]]]}))
    found = compare(live, MODEL, dead={"/laser": ("dead", "x")}, **DRIVER)
    assert [type(f).__name__ for f in found] == ["MissingNode"]


def test_lazy_node_subscribes_when_somebody_listens():
    model = system(
        connection("rays", "laser.rays", "nav.rays"),
        laser=[port("rays", PUB)],
        nav=[port("rays", SUB), port("nav/points", PUB)],
    )
    idle = {"pubs": [["/rays", ["/laser"]], ["/nav/points", ["/nav"]]]}
    assert findings(model, **idle) == ()
    asked = idle | {"subs": [["/nav/points", ["/driver"]]], "nodes": ("/laser", "/nav", "/driver")}
    assert MissingPort("nav", "subscriber", "rays") in findings(model, **asked)


def test_service():
    model = system(nav=[port("clear", SRV)])
    assert findings(model, nodes=("/nav",)) == (MissingPort("nav", "service server", "clear"),)
    assert findings(model, services=[["/clear", ["/nav"]]], nodes=("/nav",)) == ()


def test_action_and_its_topics():
    model = system(
        connection("move", "nav.move", "laser.move", ConnectionKind.ACTION),
        nav=[port("move", SERVER)],
        laser=[port("move", CLIENT)],
    )
    assert findings(model, **action("/move", ["/nav"], ["/laser"])) == ()
    by_topics = system(nav=[port("move/goal", SUB), port("move/result", PUB)])
    assert findings(by_topics, **action("/move", ["/nav"], ["/driver"]), nodes=("/nav", "/driver")) == ()
    found = findings(model, **action("/move", [], ["/laser"]))
    assert [type(f).__name__ for f in found] == ["MissingPort", "MissingConnection"]


HAND = system(
    connection("grasp", "hand.grasp", "task.grasp", ConnectionKind.ACTION),
    hand=[port("grasp", SERVER)],
    task=[port("grasp", CLIENT), port("events", PUB)],
)
EVENTS = [["/events", ["/task"]]]
TASK = {"nodes": ("/hand", "/task", "/other"), "services": []}


def with_events(parts):
    return {**TASK, **parts, "pubs": [*parts["pubs"], *EVENTS]}


def test_client_of_an_action_that_is_made_for_each_goal_need_not_be_there():
    assert findings(HAND, **with_events(action("/grasp", ["/hand"], []))) == (AdditionalNode("other"),)


@pytest.mark.parametrize("server", [["/hand"], []])
def test_client_of_a_modelled_action_is_nothing_additional_even_while_its_server_restarts(server):
    model = system(hand=[port("grasp", SERVER)], task=[port("events", PUB)])
    additional = [f for f in findings(model, **with_events(action("/grasp", server, ["/task"]))) if "task" in f.node]
    assert additional == []


def test_client_of_an_action_that_a_node_outside_the_model_serves_is_nothing_additional():
    model = system(task=[port("events", PUB)])
    assert findings(model, **with_events(action("/grasp", ["/other"], ["/task"])))[:-2] == ()


def test_client_of_an_action_that_nobody_serves_is_additional():
    found = findings(HAND, **with_events(action("/gasp", [], ["/task"])))
    assert AdditionalPort("task", "action client", "gasp") in found


@pytest.mark.parametrize("parts", [("goal",), ("goal", "cancel"), ("goal", "cancel", "status"), ("result", "feedback")])
def test_client_of_which_only_some_topics_are_there_is_on_its_way(parts):
    whole = action("/grasp", ["/hand"], [])
    live = {
        **whole,
        "pubs": [[t, [*n, "/task"] if t[7:] in parts and PARTS[t[7:]] else n] for t, n in whole["pubs"]],
        "subs": [[t, [*n, "/task"] if t[7:] in parts and not PARTS[t[7:]] else n] for t, n in whole["subs"]],
    }
    assert findings(HAND, **with_events(live)) == (AdditionalNode("other"),)
    by_topics = system(hand=[port("grasp", SERVER)], task=[port("grasp/goal", PUB), port("grasp/result", SUB)])
    assert [f for f in findings(by_topics, **live) if isinstance(f, MissingPort)] == []


def test_server_of_an_action_must_be_whole():
    (first, *_) = findings(HAND, **with_events({**action("/grasp", [], ["/task"]), "subs": []}))
    assert first == MissingPort("hand", "action server", "grasp")


DECLARED = PackageSet(
    (
        Package(
            "p",
            (
                Artifact(
                    "a",
                    (Node("n", (PortDeclaration("scan", PUB, "m/Scan"), PortDeclaration("move", SERVER, "m/Move"))),),
                ),
            ),
        ),
    )
)


@pytest.mark.parametrize(("actual", "differs"), [("m/Scan", False), ("m/Cloud", True), ("*", False)])
def test_type_of_a_topic_by_the_package_model(actual, differs):
    scope = Scope(types=port_types([DECLARED]))
    live = graph(pubs=[["/scan", ["/laser"]]], types=[["/scan", actual]], nodes=("/laser",))
    found = compare(live, system(laser=[port("scan", PUB)]), dead={}, scope=scope)
    assert found == ((WrongType("laser", "scan", "m/Scan", actual),) if differs else ())


@pytest.mark.parametrize(
    ("inside", "declared"), [("scan", "/cart/scan"), ("/cart/scan", "scan"), ("laser/scan", "~scan")]
)
def test_type_is_that_of_the_name_that_resolves_to_the_same(inside, declared):
    source = PackageSet((Package("p", (Artifact("a", (Node("n", (PortDeclaration(declared, PUB, "m/Scan"),)),)),)),))
    topic = "/cart/laser/scan" if "~" in declared else "/cart/scan"
    live = graph(pubs=[[topic, ["/cart/laser"]]], types=[[topic, "m/Cloud"]], nodes=("/cart/laser",))
    laser = Component("laser", namespace="cart", ports=(Port(inside, PUB, Reference("p", "a", "n", inside)),))
    found = compare(live, RosSystem("s", (laser,)), dead={}, scope=Scope(types=port_types([source])))
    assert found == (WrongType("cart/laser", topic[1:], "m/Scan", "m/Cloud"),)


def test_type_of_an_action_has_the_suffix_that_ros_gives_it():
    scope = Scope(types=port_types([DECLARED]))
    live = graph(**action("/move", ["/nav"], []), nodes=("/nav",))
    assert compare(live, system(nav=[port("move", SERVER)]), dead={}, scope=scope) == ()


def test_system_in_a_namespace():
    live = graph(pubs=[["/r1/scan", ["/r1/laser"]]], subs=[["/r1/scan", ["/r1/nav"]]], nodes=("/r1/laser", "/r1/nav"))
    model = system(connection("scan", "laser.scan", "nav.scan"), laser=[port("scan", PUB)], nav=[port("scan", SUB)])
    assert compare(live, model, dead={}, scope=Scope(namespace="/r1/")) == ()


def test_every_finding_says_what_was_expected_and_what_is():
    live = AS_MODELLED | {"pubs": [["/extra", ["/laser"]]]}
    statuses = finding_statuses(findings(MODEL, **live))
    assert {status.message for status in statuses} == {"Missing port", "Additional port", "Missing connection"}
    for status in statuses:
        values = dict(status.values)
        assert values["expected"] != values["actual"]
        assert status.level is (Level.WARN if status.message == "Additional port" else Level.ERROR)


@pytest.mark.parametrize("actual", ["m/Pose", "m/Scan"])
def test_topic_service_and_action_of_one_name_have_types_of_their_own(actual):
    ends = [(SUB, "m/Pose"), (SRV, "m/SetPose"), (SERVER, "m/MoveAction")]
    declared = tuple(PortDeclaration("pose", kind, type_name) for kind, type_name in ends)
    source = PackageSet((Package("p", (Artifact("a", (Node("n", declared),)),)),))
    parts = action("/pose", ["/laser"], ["/nav"])
    live = {
        "pubs": parts["pubs"],
        "subs": [*parts["subs"], ["/pose", ["/laser"]]],
        "types": [*parts["types"], ["/pose", actual]],
        "services": [["/pose", ["/laser"]]],
        "nodes": ("/laser", "/nav"),
    }
    scope = Scope(types=port_types([source]), ignored_nodes=("nav",))
    found = compare(graph(**live), system(laser=[port("pose", kind) for kind, _ in ends]), dead={}, scope=scope)
    assert found == ((WrongType("laser", "pose", "m/Pose", actual),) if actual != "m/Pose" else ())
