"""The fault injector signals the process of the node that it is told, and no other one."""

import subprocess
import sys
import threading
from contextlib import contextmanager
from xmlrpc.server import SimpleXMLRPCServer

import psutil
import pytest
import rospy
from helpers.waiting import wait_for
from metacontrol_experiments.contingency.contingency import AT_START, InjectionError
from metacontrol_experiments.contingency.parsing import make, parse_contingency
from metacontrol_experiments.io import node_processes
from metacontrol_experiments.ros import fault_injection
from metacontrol_experiments.ros.fault_injection import FaultInjector
from node_kit.ros import services

NODE = """
import os, sys
from xmlrpc.server import SimpleXMLRPCServer
server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
server.register_function(lambda caller: [1, "", int(sys.argv[1]) or os.getpid()], "getPid")
print(server.server_address[1], flush=True)
server.serve_forever()
"""


class World:
    """A master that knows one node, and processes."""

    def __init__(self):
        self.address, self.processes = "", []
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._server.register_function(lambda _caller, _node: [1, "", self.address], "lookupNode")
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def start(self, *command):
        process = subprocess.Popen([sys.executable, "-c", *command], stdout=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def start_node(self, pid=0):
        """Start the node, which tells its own process, or another one."""
        process = self.start(NODE, str(pid))
        self.address = f"http://127.0.0.1:{process.stdout.readline().strip()}/"
        return process

    def close(self):
        self._server.shutdown()
        self._server.server_close()
        for process in self.processes:
            process.kill()
            process.wait()
            process.stdout.close()


@pytest.fixture
def world(monkeypatch):
    made = World()
    monkeypatch.setattr(node_processes.rosgraph, "get_master_uri", lambda: made.uri)
    monkeypatch.setattr(fault_injection.rospy.Time, "now", lambda: rospy.Time(1))
    yield made
    made.close()


@pytest.fixture
def injector():
    return FaultInjector({"lidar": "/lidar"}, psutil.pid_exists)


def inject(injector, kind):
    return injector.inject(parse_contingency(f"{kind}:lidar@share:0.5"), None).values


def is_stopped(process):
    return psutil.Process(process.pid).status() == psutil.STATUS_STOPPED


def test_node_of_this_host_is_killed(world, injector):
    node = world.start_node()
    assert inject(injector, "kill") == {"node": "/lidar", "pid": str(node.pid), "how": "kill"}
    wait_for(lambda: node.poll() is not None, "the node ends")


@pytest.mark.parametrize("kind", ["kill", "freeze"])
def test_process_that_has_the_number_of_a_node_in_a_container_is_left_alone(world, injector, kind):
    other = world.start("import signal; signal.pause()")
    node = world.start_node(other.pid)
    with pytest.raises(InjectionError, match=f"node /lidar: process {other.pid} of this host does not listen at .*"):
        inject(injector, kind)
    assert (node.poll(), other.poll(), is_stopped(other)) == (None, None, False)


def test_node_of_another_host_is_refused_and_not_asked(world, injector, monkeypatch):
    monkeypatch.setattr(node_processes, "is_this_host", lambda host: host != "robot2")
    world.address = "http://robot2:40000/"
    with pytest.raises(InjectionError, match="node /lidar runs on the host robot2"):
        inject(injector, "kill")


def test_frozen_node_is_thawed_though_it_does_not_tell_its_process(world, injector):
    node = world.start_node()
    inject(injector, "freeze")
    wait_for(lambda: is_stopped(node), "the node stops")
    inject(injector, "thaw")
    wait_for(lambda: not is_stopped(node), "the node goes on")
    inject(injector, "kill")
    wait_for(lambda: node.poll() is not None, "the node ends")


@pytest.mark.parametrize("is_reaped", [True, False])
def test_node_that_was_started_again_after_a_freeze_is_the_one_that_is_killed(world, injector, is_reaped):
    frozen = world.start_node()
    inject(injector, "freeze")
    frozen.kill()
    if is_reaped:
        frozen.wait()
    else:
        wait_for(lambda: psutil.Process(frozen.pid).status() == psutil.STATUS_ZOMBIE, "the frozen node ends")
    again = world.start_node()
    assert inject(injector, "kill")["pid"] == str(again.pid)
    wait_for(lambda: again.poll() is not None, "the node ends")


@contextmanager
def hanging_service(monkeypatch):
    released = threading.Event()
    monkeypatch.setattr(services.rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(services.rospy, "ServiceProxy", lambda *_: lambda *_, **__: released.wait())
    monkeypatch.setattr(services, "FIND_S", 0.02)
    monkeypatch.setattr(services, "ANSWER_S", 0.03)
    try:
        yield
    finally:
        released.set()


@pytest.mark.parametrize("kind, what", [("light", 0.1), ("power", 1.5), ("clutter", [[1.0, 2.0]])])
def test_service_that_does_not_answer_is_told_and_holds_up_nobody(world, injector, monkeypatch, kind, what):
    with hanging_service(monkeypatch), pytest.raises(InjectionError, match=r"has not answered within 0\.03 s: look at"):
        injector.inject(make(kind, what, AT_START, "test"), None)
