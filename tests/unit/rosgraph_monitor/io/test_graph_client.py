"""The graph of a master that holds parameters that it can't tell."""

import contextlib
import threading
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from node_kit.io.xml_rpc import CallError
from rosgraph_monitor.io.graph_client import GraphClient

TOO_LONG = 1700000000000  # ms: XML-RPC has integers of 32 bits


class KeepAlive(SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"


class Master:
    """What a master answers: rosmaster takes any integer, and fails when it has to tell one that is too long."""

    def __init__(self):
        self.publishers, self.parameters, self.asked = ["/belt"], {"belt": {"speed": 1.0}, "cell": "left"}, []

    def value(self, name):
        self.asked.append(name)
        value = self.parameters
        for part in filter(None, name.split("/")):
            if part not in value:
                return [-1, f"{name} is not set", 0]
            value = value[part]
        return [1, "", value]

    def names(self):
        def leaves(tree, above):
            for key, value in tree.items():
                yield from leaves(value, f"{above}/{key}") if isinstance(value, dict) else [f"{above}/{key}"]

        return [1, "", [*leaves(self.parameters, ""), "/deleted/meanwhile"]]


@pytest.fixture
def master():
    made = Master()
    server = SimpleXMLRPCServer((QUIET_HOST, 0), requestHandler=KeepAlive, logRequests=False)
    server.register_function(lambda _: [1, "", [[["/items", made.publishers]], [], []]], "getSystemState")
    server.register_function(lambda _: [1, "", [["/items", "std_msgs/Int32"]]], "getTopicTypes")
    server.register_function(lambda _, name: made.value(name), "getParam")
    server.register_function(lambda _: made.names(), "getParamNames")
    server.register_function(lambda _, name: [1, "", f"http://host{name}/"], "lookupNode")
    server.register_multicall_functions()
    made.uri = f"http://{QUIET_HOST}:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    with contextlib.closing(GraphClient(made.uri, "/monitor", 60.0)) as made.client:
        yield made
    server.shutdown()
    thread.join()
    server.server_close()


def test_graph_is_followed_while_a_parameter_can_not_be_told(master):
    before = master.client.snapshot()
    assert (before.parameter("/belt/speed"), master.client.problem) == (1.0, "")
    master.parameters = {"belt": {"speed": 2.0}, "js": {"started": TOO_LONG}}
    master.publishers = ["/belt", "/js"]
    found = master.client.snapshot()
    assert set(found.nodes) == {"/belt", "/js"}
    assert found.parameter("/belt/speed") == 1.0, "as it was"
    assert "/js/started" in master.client.problem and "rosparam delete /js/started" in master.client.problem
    said = master.client.problem
    master.asked.clear()
    assert master.client.snapshot() is found, "nothing has changed"
    assert (master.client.problem, master.asked) == (said, ["/"])
    del master.parameters["js"]
    assert master.client.snapshot().parameter("/belt/speed") == 2.0
    assert master.client.problem == ""


def test_parameters_that_can_be_told_are_known_from_the_beginning(master):
    master.parameters["belt"]["started"] = TOO_LONG
    found = master.client.snapshot()
    assert found.parameters == {"belt": {"speed": 1.0}, "cell": "left"}
    assert "/belt/started" in master.client.problem


def test_garbage_that_is_not_of_parameters_is_an_error(master):
    master.publishers = [1]
    with pytest.raises(CallError, match="garbage"):
        master.client.snapshot()
    assert master.client.problem == ""
