"""The journal of a running reasoner is read message by message, whatever comes first."""

from types import SimpleNamespace as Thing

import pytest
from mros1_reasoner.io.reasoner_bag import JournalReader
from mros1_reasoner.loop.entries import Pause, Resume
from mros1_reasoner.replay.recording import RecordingError


def message(first, *kinds, parameters="", name="reasoner-1"):
    entries = [Thing(now=float(first + i), kind=kind, values=[]) for i, kind in enumerate(kinds)]
    return Thing(name=name, parameters=parameters, files=[], contents=[], first=first, entries=entries)


def beginning(*kinds, **changes):
    return message(0, *kinds, parameters="{utility: calm}", **changes)


def fresh(reader, told):
    return [type(entry.content) for entry in reader.take(told)[1]]


def test_each_entry_is_passed_on_once():
    reader = JournalReader()
    assert fresh(reader, beginning("pause")) == [Pause]
    assert fresh(reader, message(1, "resume")) == [Resume]
    assert fresh(reader, message(2, "pause", "resume")) == [Pause, Resume]


def test_beginning_that_comes_late_brings_what_was_before():
    reader = JournalReader()
    assert fresh(reader, message(1, "resume")) == []
    assert fresh(reader, beginning("pause", "resume")) == [Pause, Resume]


def test_what_the_beginning_had_already_is_not_repeated():
    reader = JournalReader()
    assert fresh(reader, beginning("pause", "resume")) == [Pause, Resume]
    assert fresh(reader, message(1, "resume")) == []
    assert fresh(reader, message(2, "pause")) == [Pause]


def test_hole_is_told():
    reader = JournalReader()
    reader.take(beginning("pause"))
    with pytest.raises(RecordingError, match="missing"):
        reader.take(message(5, "resume"))


def test_another_reasoner_begins_anew():
    reader = JournalReader()
    reader.take(beginning("pause"))
    run, entries = reader.take(beginning("resume", name="reasoner-2"))
    assert (run.name, len(entries)) == ("reasoner-2", 1)
