"""A parameter that a node keeps for the next one of its name, on a master of this process."""

import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import DEADLINE_S, wait_for
from node_kit.ros.kept_parameter import KeptParameter


class Master:
    """Keeps parameters, unless it is to refuse."""

    def __init__(self):
        self.parameters, self.refuses, self.calls, self.goes_on = {}, 0, 0, threading.Event()
        self.goes_on.set()

    def set(self, _caller, name, value):
        self.calls += 1
        self.goes_on.wait(DEADLINE_S)
        if self.refuses:
            self.refuses -= 1
            return -1, "not now", 0
        self.parameters[name] = value
        return 1, "", 0


@pytest.fixture
def master(monkeypatch):
    master = Master()
    with SimpleXMLRPCServer((QUIET_HOST, 0), logRequests=False) as server:
        server.register_function(master.set, "setParam")
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        monkeypatch.setenv("ROS_MASTER_URI", f"http://{QUIET_HOST}:{server.server_address[1]}/")
        yield master
        server.shutdown()
        thread.join()


def test_value_is_there_when_it_was_waited_for(master):
    KeptParameter("/barn/asked").set([["pause"]], patience=DEADLINE_S)
    assert master.parameters == {"/barn/asked": [["pause"]]}


def test_nobody_waits_for_a_silent_master_and_the_last_value_is_written(master):
    kept = KeptParameter("/barn/remembered")
    master.goes_on.clear()
    kept.set({"failed": ["fan"]})
    wait_for(lambda: master.calls, "the master is asked")
    kept.set({"failed": []})
    kept.set({"failed": ["pump"]})
    master.goes_on.set()
    wait_for(lambda: master.parameters.get("/barn/remembered") == {"failed": ["pump"]}, "the last value is written")


def test_value_that_the_master_did_not_take_is_written_again(master):
    master.refuses = 1
    kept = KeptParameter("/barn/asked")
    kept.set([["pause"]])
    wait_for(lambda: master.parameters, "it is written")
    assert (master.calls, master.refuses) == (2, 0)
