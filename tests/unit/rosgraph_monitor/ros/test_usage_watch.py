"""The thread that measures what nodes use, with launchers that answer badly."""

import threading

import pytest
import rospy
from helpers.waiting import DEADLINE_S, wait_for
from ros_model.graph.snapshot import build_snapshot
from rosgraph_launcher.usage import Sample, Use
from rosgraph_monitor.ros import usage

HOSTS = {"arm": "198.51.100.1", "leg": "198.51.100.2"}


def graph():
    """Two robots' parts on two other hosts, each with a launcher and a driver."""
    addresses = {f"/{part}/{name}": f"http://{host}:40001/" for part, host in HOSTS.items() for name in ("up", "drive")}
    publishers = [["/rosgraph_launcher/functions", [f"/{part}/up" for part in HOSTS]], ["/rosout", list(addresses)]]
    parameters = {part: {"up": {"addresses": [host]}} for part, host in HOSTS.items()}
    return build_snapshot([publishers, [], []], [], parameters, addresses)


@pytest.fixture
def watch(monkeypatch):
    """Return a function that begins to watch, given how each launcher answers; what is told grows in its result."""
    ended = threading.Event()
    monkeypatch.setattr(usage, "_PERIOD", 0.01)
    monkeypatch.setattr(rospy, "is_shutdown", ended.is_set)

    def begin(read, look=graph):
        told = []
        monkeypatch.setattr(usage, "_read", read)
        pids = {(name, node.uri): 7 for name, node in graph().nodes.items()}
        usage.UsageWatch([f"/{part}/drive" for part in HOSTS], look, lambda: pids, told.extend)
        return told

    yield begin
    ended.set()
    for thread in threading.enumerate():
        if thread.name == "usage":
            thread.join(DEADLINE_S)


def test_bad_answer_of_a_launcher_costs_the_figures_of_its_host_only(watch):
    def read(launcher, _nodes, _alone):
        if launcher == "/arm/up":
            raise ValueError("garbage")
        return {7: Sample(0.0, {(7, 0.0): Use(1.0, 20.0)})}

    told = watch(read)
    wait_for(lambda: len(told) > 3, "look after look is told")
    assert {status.name for status in told} == {"/leg/drive"}


def test_look_that_fails_is_followed_by_the_next_one(watch):
    looks = []

    def look():
        looks.append(None)
        if len(looks) < 3:
            raise RuntimeError("not now")
        return graph()

    told = watch(lambda *_: {7: Sample(0.0, {})}, look)
    wait_for(lambda: told, "the third look is told")
