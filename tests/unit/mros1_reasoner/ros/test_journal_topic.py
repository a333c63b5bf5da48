"""Subscribers that come while the journal is published get whole messages: rospy has one buffer for both."""

import threading
from xmlrpc.client import Binary, DateTime

import pytest
import rospy
import yaml
from helpers.waiting import DEADLINE_S
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.loop.entries import Entry, Pause
from mros1_reasoner.ros.journal import JournalTopic


class Buffer:
    """A publisher with one buffer that two threads must not fill at once."""

    def __init__(self, *_, subscriber_listener, **__):
        self.listener, self.used, self.clashes, self.sent = subscriber_listener, threading.Lock(), 0, 0
        self.begun = threading.Event()

    def get_num_connections(self):
        return 1

    def publish(self, _message):
        if not self.used.acquire(blocking=False):
            self.clashes += 1
            return
        self.begun.set()
        threading.Event().wait(0.05)
        self.used.release()
        self.sent += 1


@pytest.fixture
def publisher(monkeypatch):
    made = []
    monkeypatch.setattr(rospy, "Publisher", lambda *words, **options: made.append(Buffer(*words, **options)) or made[0])
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(1))
    return made


def test_beginning_for_a_new_subscriber_and_the_next_entries_are_sent_one_after_the_other(publisher):
    topic = JournalTopic("reasoner-1", Parameters({}), [])
    [buffer] = publisher
    topic.append(Entry(1.0, Pause()))
    flushing = threading.Thread(target=topic.flush)
    flushing.start()
    assert buffer.begun.wait(DEADLINE_S)
    buffer.listener.peer_subscribe("", buffer.publish, buffer.publish)
    flushing.join()
    assert (buffer.clashes, buffer.sent) == (0, 2)


def test_parameters_that_yaml_can_not_hold_are_left_out(publisher):
    odd = [Binary(b"x"), DateTime("20200101T00:00:00")]
    given = {"stray": odd[0], "day": odd[1], "history": 3, "components": {"laser": {"node": "scan", "x": odd[0]}}}
    JournalTopic("reasoner-1", Parameters({**given, "list": [1, *odd]}), [])
    told = []
    publisher[0].listener.peer_subscribe("", None, told.append)
    kept = {"history": 3, "components": {"laser": {"node": "scan"}}, "list": [1]}
    assert yaml.safe_load(told[0].parameters) == kept
