"""Looks at the graph, with a master that answers as the test wants."""

import queue

import pytest
from node_kit.io.xml_rpc import CallError
from ros_model.graph.snapshot import GraphSnapshot, NodeState
from rosgraph_monitor.health.liveness import Life
from rosgraph_monitor.io.graph_poller import GraphPoller

GRAPH = GraphSnapshot(nodes={name: NodeState(name, f"http://host{name}") for name in ("/laser", "/monitor")})
DEADLINE = 30.0
HOURLY = 3600.0


class Master:
    def __init__(self):
        self.answers = queue.Queue()
        self.closed = False
        self.problem = ""

    def snapshot(self):
        answer = self.answers.get(timeout=DEADLINE)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self):
        self.closed = True


class Connections:
    def __init__(self):
        self.watched = {}
        self.known = {("/laser", "http://host/laser"): Life.ALIVE}

    def lives(self):
        return dict(self.known)

    def watch(self, nodes):
        self.watched = dict(nodes)


class Stand:
    def __init__(self, period):
        self.master, self.connections, self.polls = Master(), Connections(), queue.Queue()
        self.poller = GraphPoller(self.master, self.connections, period, "/monitor", lambda: self.polls.put(True))

    def answer(self, *answers):
        for answer in answers:
            self.master.answers.put(answer)
        for _ in answers:
            self.polls.get(timeout=DEADLINE)


@pytest.fixture
def stand(request):
    made = Stand(getattr(request, "param", 0.01))
    made.poller.start()
    yield made
    made.master.answers.put(CallError("the test is over"))
    made.poller.close()


def test_poll_has_what_was_known_and_tells_whom_to_watch(stand):
    stand.answer(GRAPH)
    assert stand.poller.latest.snapshot is GRAPH
    assert stand.poller.latest.lives == stand.connections.known
    assert stand.connections.watched == {"/laser": "http://host/laser"}


def test_poll_says_what_of_it_is_older(stand):
    stand.master.problem = "parameter /js can't be read"
    stand.answer(GRAPH)
    assert stand.poller.latest.problem == "parameter /js can't be read"


def test_poll_that_fails_leaves_the_latest_and_the_next_one_counts_again(stand):
    stand.answer(GRAPH)
    stand.master.answers.put(CallError("no answer"))
    later = GraphSnapshot()
    stand.answer(later)
    assert stand.poller.latest.snapshot is later
    assert stand.poller.count == 2


@pytest.mark.parametrize("stand", [HOURLY], indirect=True)
def test_look_on_request_does_not_wait_until_one_is_due(stand):
    stand.answer(GRAPH)
    stand.poller.request()
    stand.answer(GRAPH)
    assert stand.poller.count == 2
    stand.poller.request()


def test_error_that_nobody_foresaw_costs_one_look(stand, caplog):
    stand.master.answers.put(RuntimeError("unforeseen"))
    stand.answer(GRAPH)
    assert stand.poller.latest.snapshot == GRAPH
    assert "the graph could not be looked at" in caplog.text
