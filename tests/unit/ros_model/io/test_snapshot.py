"""The snapshot of the graph, over a master that answers from a table."""

import contextlib
import json
import socket
import threading
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from node_kit.io.xml_rpc import CallError, GoneError
from ros_model.graph.snapshot import build_snapshot
from ros_model.io.master import MasterClient, take_snapshot

STATE = [
    [
        ["/scan", ["/laser"]],
        ["/move/status", ["/move"]],
        ["/move/feedback", ["/move"]],
        ["/move/result", ["/move"]],
        ["/move/goal", ["/mission"]],
        ["/move/cancel", ["/mission"]],
        ["/fake/goal", ["/laser"]],
    ],
    [
        ["/scan", ["/move", "/ghost"]],
        ["/move/goal", ["/move", "/watcher"]],
        ["/move/cancel", ["/move"]],
        ["/move/status", ["/mission", "/watcher"]],
        ["/move/feedback", ["/mission"]],
        ["/move/result", ["/mission"]],
    ],
    [["/move/clear", ["/move"]]],
]
TYPES = [["/scan", "sensor_msgs/LaserScan"], ["/move/goal", "move_base_msgs/MoveBaseActionGoal"]]
ADDRESSES = {name: f"http://host:{i}/" for i, name in enumerate(("/laser", "/move", "/mission", "/watcher"))}
PARAMETERS = {"move": {"speed": 0.5, "layers": {"scan": {"topic": "scan"}}}}


@contextlib.contextmanager
def master(**methods):
    server = SimpleXMLRPCServer(
        (QUIET_HOST, 0), requestHandler=SimpleXMLRPCRequestHandler, logRequests=False, allow_none=True
    )
    for name, function in methods.items():
        server.register_function(function, name)
    server.register_multicall_functions()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"http://{QUIET_HOST}:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()


def answers(calls):
    def lookup(_caller, name):
        return [1, "", ADDRESSES[name]] if name in ADDRESSES else [-1, "unknown node", ""]

    def counted(name, value):
        calls.append(name)
        return [1, "", value]

    return {
        "getSystemState": lambda _caller: counted("getSystemState", STATE),
        "getTopicTypes": lambda _caller: counted("getTopicTypes", TYPES),
        "getParam": lambda _caller, key: counted(f"getParam {key}", PARAMETERS),
        "lookupNode": lookup,
    }


@pytest.fixture
def graph():
    return build_snapshot(STATE, TYPES, PARAMETERS, ADDRESSES)


def test_action_is_folded_from_its_five_topics(graph):
    action = graph.actions["/move"]
    assert (action.type, action.servers, action.clients) == (
        "move_base_msgs/MoveBaseAction",
        ("/move",),
        ("/mission",),
    )
    assert graph.actions.keys() == {"/move"}
    assert graph.nodes["/move"].publications == ()
    assert graph.nodes["/laser"].publications == ("/fake/goal", "/scan")


def test_who_only_listens_to_an_actions_topics_is_no_server_and_no_client(graph):
    watcher = graph.nodes["/watcher"]
    assert (watcher.action_servers, watcher.action_clients) == ((), ())
    assert watcher.subscriptions == ("/move/goal", "/move/status")
    assert graph.topics["/move/goal"].subscribers == ("/move", "/watcher")


def test_server_that_sends_goals_itself_is_a_server_and_a_publisher():
    publishers, *rest = STATE
    sent = [[topic, [*nodes, "/move"] if topic == "/move/goal" else nodes] for topic, nodes in publishers]
    node = build_snapshot([sent, *rest], TYPES, PARAMETERS, ADDRESSES).nodes["/move"]
    assert (node.action_servers, node.action_clients, node.publications) == (("/move",), (), ("/move/goal",))


def test_action_without_a_server_still_has_its_client():
    gone = {name: uri for name, uri in ADDRESSES.items() if name != "/move"}
    graph = build_snapshot(STATE, TYPES, PARAMETERS, gone)
    assert (graph.actions["/move"].servers, graph.actions["/move"].clients) == ((), ("/mission",))


def test_five_topics_that_nobody_serves_or_asks_for_are_no_action():
    watched = {name: uri for name, uri in ADDRESSES.items() if name in ("/watcher", "/laser")}
    assert build_snapshot(STATE, TYPES, PARAMETERS, watched).actions == {}


def test_node_knows_its_ends(graph):
    node = graph.nodes["/move"]
    assert node.subscriptions == ("/scan",)
    assert node.services == ("/move/clear",)
    assert node.action_servers == ("/move",)
    assert node.uri == ADDRESSES["/move"]


def test_topic_has_type_and_only_nodes_that_exist(graph):
    assert graph.topics["/scan"].type == "sensor_msgs/LaserScan"
    assert graph.topics["/scan"].subscribers == ("/move",)
    assert "/ghost" not in graph.nodes


def test_parameter_by_its_resolved_name(graph):
    assert graph.parameter("/move/layers/scan/topic") == "scan"
    with pytest.raises(KeyError):
        graph.parameter("/move/speed/unit")


def test_snapshot_takes_four_calls():
    calls = []
    with master(**answers(calls)) as uri:
        graph = take_snapshot(uri)
    assert calls == ["getSystemState", "getTopicTypes", "getParam /"]
    assert set(graph.nodes) == set(ADDRESSES)


def test_empty_graph():
    assert build_snapshot([[], [], []], [], {}, {}).nodes == {}


def test_master_that_is_gone_is_named():
    with socket.socket() as free:
        free.bind((QUIET_HOST, 0))
        uri = f"http://{QUIET_HOST}:{free.getsockname()[1]}"
        with pytest.raises(GoneError, match=uri):
            take_snapshot(uri)


def test_silent_master_times_out():
    with socket.create_server((QUIET_HOST, 0)) as silent:
        uri = f"http://{QUIET_HOST}:{silent.getsockname()[1]}"
        with pytest.raises(CallError, match="does not answer getSystemState"):
            take_snapshot(uri, timeout=0.1)


@pytest.mark.parametrize("garbage", [1, "x", [1, "", "state"], [1, "", [[], []]], [1, "", [[["/t", [3]]], [], []]]])
def test_garbage_is_refused(garbage):
    table = answers([]) | {"getSystemState": lambda _caller: garbage}
    with master(**table) as uri, pytest.raises(CallError):
        take_snapshot(uri)


def test_error_of_the_master_is_passed_on():
    table = answers([]) | {"getTopicTypes": lambda _caller: [-1, "not today", 0]}
    with master(**table) as uri, pytest.raises(CallError, match="not today"):
        take_snapshot(uri)


def test_address_that_is_no_address():
    with pytest.raises(CallError, match="ROS_MASTER_URI"):
        MasterClient("localhost:11311")


def test_master_that_answers_by_drops_times_out():
    ended = threading.Event()
    with socket.create_server((QUIET_HOST, 0)) as server:

        def drip():
            connection, _ = server.accept()
            with connection, contextlib.suppress(OSError):
                connection.sendall(b"HTTP/1.1 200 OK\r\n")
                while not ended.wait(0.02):
                    connection.sendall(b"X-Slow: 1\r\n")

        thread = threading.Thread(target=drip, daemon=True)
        thread.start()
        try:
            with pytest.raises(CallError, match="does not answer getSystemState"):
                take_snapshot(f"http://{QUIET_HOST}:{server.getsockname()[1]}", timeout=0.3)
        finally:
            ended.set()
            thread.join()


def test_master_that_answers_slowly_is_waited_for():
    slow = threading.Event()

    def state(_caller):
        slow.wait(0.2)
        return [1, "", STATE]

    with master(**(answers([]) | {"getSystemState": state})) as uri:
        assert set(take_snapshot(uri, timeout=20.0).nodes) == set(ADDRESSES)


def test_ten_thousand_parameters():
    tree = {f"group_{i}": {f"parameter_{k}": float(k) for k in range(100)} for i in range(100)}
    with master(**(answers([]) | {"getParam": lambda _caller, key: [1, "", tree]})) as uri:
        graph = take_snapshot(uri, timeout=60.0)
    assert graph.parameter("/group_99/parameter_99") == 99.0


def test_snapshot_is_the_same_object_until_something_changes():
    tree = {"speed": 1}
    with master(**(answers([]) | {"getParam": lambda _caller, key: [1, "", tree]})) as uri:
        client = MasterClient(uri)
        first = client.snapshot()
        assert client.snapshot() is first
        tree["speed"] = True
        assert client.snapshot().parameter("/speed") is True
        client.close()


def test_answer_that_changes_every_time_makes_no_other_old():
    count = iter(range(100))
    with master(**(answers([]) | {"getParam": lambda _caller, key: [1, "", {"n": next(count)}]})) as uri:
        client = MasterClient(uri)
        assert [client.snapshot().parameter("/n") for _ in range(20)] == list(range(20))
        assert client.snapshot().nodes.keys() == ADDRESSES.keys()
        client.close()


def test_snapshot_compares_and_becomes_json(graph):
    assert graph == build_snapshot(STATE, TYPES, PARAMETERS, ADDRESSES)
    assert graph != build_snapshot(STATE, TYPES, {}, ADDRESSES)
    read = json.loads(json.dumps(graph.as_dict()))
    assert read["nodes"]["/move"]["action_servers"] == ["/move"]
    assert read["parameters"] == PARAMETERS
