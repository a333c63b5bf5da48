"""Pellet's process starts before the node imports anything else, if the node's parameter asks for it."""

import subprocess
import sys
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from mros1_reasoner.io.reasoners import PELLET
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.pellet.process import NoJavaError
from mros1_reasoner.ros import start


@pytest.fixture
def parameters():
    """Return the parameters that a master has."""
    return {}


@pytest.fixture
def environment(parameters):
    """Return the environment of a node with a master that answers for its parameters."""

    def get_param(_, key):
        return (1, "", parameters[key]) if key in parameters else (-1, f"Parameter [{key}] is not set", 0)

    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        server.register_function(get_param, "getParam")
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield {"ROS_MASTER_URI": f"http://127.0.0.1:{server.server_address[1]}"}
        server.shutdown()
        thread.join()


@pytest.fixture(autouse=True)
def pellet(monkeypatch):
    """Return what stands for Pellet's process."""
    process = object()
    monkeypatch.setattr(start, "PelletReasoner", lambda: process)
    return process


def test_pellet_starts_where_no_parameter_says_otherwise(environment, pellet):
    assert start.start_pellet(["node"], environment) is pellet


def test_pellet_starts_by_its_name(environment, parameters, pellet):
    parameters["/reasoner/reasoner"] = PELLET
    assert start.start_pellet(["node"], environment) is pellet


def test_no_pellet_for_the_rule_engine(environment, parameters):
    parameters["/reasoner/reasoner"] = "rules"
    assert start.start_pellet(["node"], environment) is None


@pytest.mark.parametrize("by", ["arguments", "environment"])
def test_parameters_of_a_node_with_another_name_in_a_namespace_count(environment, parameters, pellet, by):
    parameters["/left/planner/reasoner"] = "rules"
    arguments = ["node", "__name:=planner", *(["__ns:=left"] if by == "arguments" else [])]
    others = {"ROS_NAMESPACE": "left"} if by == "environment" else {}
    assert start.start_pellet(arguments, {**environment, **others}) is None
    assert start.start_pellet(["node"], environment) is pellet


def test_command_line_comes_before_the_parameter_server(environment, parameters, pellet):
    parameters["/reasoner/reasoner"] = PELLET
    assert start.start_pellet(["node", "_reasoner:=rules"], environment) is None
    parameters["/reasoner/reasoner"] = "rules"
    assert start.start_pellet(["node", f"_reasoner:={PELLET}"], environment) is pellet


@pytest.mark.parametrize("uri", ["http://127.0.0.1:1", "nonsense"])
def test_without_a_master_the_node_does_the_rest(uri):
    assert start.start_pellet(["node"], {"ROS_MASTER_URI": uri}) is None


@pytest.mark.parametrize("error", [NoJavaError("no Java"), ReasonerError("no jars"), OSError("no memory")])
def test_where_pellet_cannot_start_the_node_tells_it(environment, monkeypatch, error):
    def fail():
        raise error

    monkeypatch.setattr(start, "PelletReasoner", fail)
    assert start.start_pellet(["node"], environment) is None


def test_node_imports_no_numpy_and_its_plug_ins_may():
    code = (
        "import sys; from mros1_reasoner.ros import start; start._import_genpy_without_numpy(); "
        "import mros1_reasoner.ros.reasoner, genpy; assert 'numpy' not in sys.modules; "
        "import numpy; assert numpy.ones(2).sum() == 2"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
