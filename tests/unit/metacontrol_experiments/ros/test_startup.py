"""A mission begins once its recorder receives: from all who publish what is recorded."""

import pytest
import rospy
from metacontrol_experiments.ros import startup as module
from metacontrol_experiments.ros.startup import StartError, Startup
from node_kit.io.xml_rpc import DeniedError, GoneError, SilentError

RECORDER, MISSION, BASE = "/recorder_1", "/mission_1", "/rover/base"
TOPICS = ("/rover/odom", "/rover/event")


class System:
    """A master and its nodes, as they answer.

    Attributes:
        records: topics that the recorder subscribes to.
        publishes: the publishers of topics, as the master knows them.
        links: of each node, its connections: to whom, in which direction, over which topic.
        error: what a node raises instead.
    """

    def __init__(self):
        self.records = list(TOPICS)
        self.publishes = {TOPICS[0]: [BASE, RECORDER], "/rosout": ["/rover/tool"]}
        self.links = {BASE: [(RECORDER, "o", TOPICS[0])], MISSION: [(RECORDER, "o", TOPICS[1])]}
        self.error = {}

    def client(self, uri, *_, **__):
        return Api(self, uri)

    def answer(self, uri, method, *arguments):
        if uri != "master":
            if uri in self.error:
                raise self.error[uri]
            return [[1, peer, way, "TCPROS", topic, True] for peer, way, topic in self.links.get(uri, ())]
        if method == "lookupNode":
            return arguments[0]
        return self.publishes.items(), [(topic, [RECORDER]) for topic in self.records], []


class Api:
    def __init__(self, system, uri):
        self.call = lambda method, *arguments: system.answer(uri, method, *arguments)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


class Publisher:
    resolved_name = TOPICS[1]


@pytest.fixture
def system(monkeypatch):
    system = System()
    monkeypatch.setattr(module, "Client", system.client)
    monkeypatch.setattr(module.rosgraph, "get_master_uri", lambda: "master")
    monkeypatch.setattr(module, "wait_until", lambda condition, _: condition())  # one look
    monkeypatch.setattr(rospy, "get_name", lambda: MISSION)
    return system


def waits_for():
    """What a mission still waits for; empty: for nothing."""
    try:
        Startup(lambda: None).wait_for_recorder(RECORDER, TOPICS, Publisher())
    except StartError as error:
        return str(error).partition(" for ")[2]
    return ""


CONNECTIONS = f"connections from all who publish what is recorded to the recorder {RECORDER}, which did not come"


def test_recorder_that_receives_from_all_is_waited_for_no_more(system):
    assert waits_for() == ""


@pytest.mark.parametrize("records", [[], TOPICS[:1]])
def test_recorder_that_has_not_subscribed_to_all_is_waited_for(system, records):
    system.records = records
    assert waits_for() == f"the recorder {RECORDER}, which did not come"


@pytest.mark.parametrize(
    "links",
    [
        [],
        [(RECORDER, "i", TOPICS[0])],
        [("/recorder_2", "o", TOPICS[0])],
        [(RECORDER, "o", "/rosout")],
    ],
)
@pytest.mark.parametrize("node", [BASE, MISSION])
def test_publisher_that_is_not_connected_to_the_recorder_is_waited_for(system, node, links):
    system.links[node] = links
    assert waits_for() == CONNECTIONS


def test_each_topic_of_a_publisher_needs_a_connection(system):
    system.publishes[TOPICS[1]] = [BASE]
    assert waits_for() == CONNECTIONS
    system.links[BASE].append((RECORDER, "o", TOPICS[1]))
    assert waits_for() == ""


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (GoneError("gone", "refused"), ""),
        (DeniedError("unknown node"), ""),
        (SilentError("silent", "timed out"), CONNECTIONS),
    ],
)
def test_publisher_that_has_ended_is_not_waited_for_but_one_that_hangs_is(system, error, said):
    system.error[BASE] = error
    assert waits_for() == said
