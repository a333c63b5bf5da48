"""Subscribers that come while the journal is published get whole messages: rospy has one buffer for both."""

import threading
from io import BytesIO
from xmlrpc.client import Binary, DateTime

import pytest
import rospy
import yaml
from helpers.waiting import DEADLINE_S
from metacontrol_msgs.msg import JournalEntry, ReasonerJournal
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.loop.entries import ComponentFact, Entry, LevelFact, Lock, Pause
from mros1_reasoner.loop.entry_text import kind_of, values_of
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


def received(message):
    """What a subscriber makes of a message."""
    sent = BytesIO()
    sent.write(b"before")
    message.serialize(sent)
    return ReasonerJournal().deserialize(sent.getvalue()[len(b"before") :])


def test_messages_have_the_entries_that_were_appended(publisher, tmp_path):
    model = tmp_path / "model.owl"
    model.write_text("<näht/>")
    topic = JournalTopic("reasoner-1", Parameters({"history": 3}), [model])
    told = []
    publisher[0].publish = told.append
    entries = [Entry(1.5, LevelFact("énergie", 0.25, "move", 1.0)), Entry(2.0, Lock()), Entry(2.5, Pause())]
    for entry in entries[:2]:
        topic.append(entry)
    topic.flush()
    topic.append(entries[2])
    topic.flush()
    publisher[0].listener.peer_subscribe("", None, told.append)
    messages = [received(message) for message in told]
    assert [(message.first, len(message.entries)) for message in messages] == [(0, 2), (2, 1), (0, 3)]
    wanted = [JournalEntry(entry.now, kind_of(entry.content), list(values_of(entry.content))) for entry in entries]
    assert messages[0].entries + messages[1].entries == messages[2].entries == wanted
    assert (messages[2].files, messages[2].contents) == ([str(model)], ["<näht/>"])
    assert [yaml.safe_load(message.parameters) for message in messages] == [None, None, {"history": 3}]


def test_beginning_of_a_long_journal_has_what_still_holds(publisher):
    topic = JournalTopic("reasoner-1", Parameters({}), [])
    topic.append(Entry(0.0, ComponentFact("laser", "FALSE", 0.0, "it is dead")))
    for number in range(60_000):
        topic.append(Entry(float(number), Pause()))
    topic.flush()
    told = []
    publisher[0].listener.peer_subscribe("", None, told.append)
    entries = received(told[0]).entries
    assert told[0].first + len(entries) == 60_001
    assert (entries[0].kind, entries[0].values) == ("component", ["laser", "FALSE", "0.0", "it is dead"])
    assert entries[-1] == JournalEntry(59_999.0, "pause", [])
