"""The journal on a topic, so that a bag holds what a replay needs."""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import rospy
import yaml
from metacontrol_msgs.msg import JournalEntry, ReasonerJournal

from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.entries import Entry
from mros1_reasoner.loop.entry_text import kind_of, values_of
from mros1_reasoner.loop.journal import Journal

_NUMBER = struct.Struct("<I")
"""Of the elements of an array, before them."""


class JournalTopic:
    """Publishes the inputs of the loop; a new subscriber gets the earlier ones, too.

    The loop's thread appends and flushes; subscribers come in rospy's threads.
    """

    def __init__(
        self,
        name: str,
        parameters: Parameters,
        files: Sequence[Path],
        at_start: Collection[str] | None = None,
    ) -> None:
        """Offer the topic.

        Args:
            name: beginning of the decisions' ids.
            parameters: of the node.
            files: the ontologies that it has loaded.
            at_start: names of the objectives that are asked for from the start; None: unknown.
        """
        self._name = name
        self._parameters = yaml.safe_dump(_plain(parameters.values))
        self._files = [str(path) for path in files]
        self._contents = [path.read_text(encoding="utf-8", errors="replace") for path in files]
        self._journal = Journal(_serialised, at_start=at_start)
        self._lock = threading.Lock()
        self._sending = threading.Lock()  # rospy does not lock what it sends to a new subscriber: both would be garbled
        self._fresh: list[bytes] = []
        self._first = 0
        listener = rospy.SubscribeListener()
        listener.peer_subscribe = self._greet
        self._publisher = rospy.Publisher(
            "mros1_reasoner/journal", ReasonerJournal, subscriber_listener=listener, queue_size=1000
        )

    def append(self, entry: Entry, objectives: Mapping[str, Objective] | None = None) -> None:
        """Add an entry; `objectives` are those that there are, by name."""
        with self._lock:
            number, serialised = self._journal.append(entry, objectives)
        if not self._fresh:
            self._first = number
        self._fresh.append(serialised)

    def flush(self) -> None:
        """Publish the entries since the last flush."""
        fresh, self._fresh = self._fresh, []
        if fresh and self._publisher.get_num_connections():
            with self._sending:
                self._publisher.publish(self._message(self._first, fresh))

    def _greet(self, _topic: str, _publish: object, publish_to_peer: Callable[[ReasonerJournal], None]) -> None:
        with self._sending:
            publish_to_peer(self._beginning())

    def _beginning(self) -> ReasonerJournal:
        with self._lock:
            first, entries = self._journal.snapshot()
        message = self._message(first, entries)
        message.parameters, message.files, message.contents = self._parameters, self._files, self._contents
        return message

    def _message(self, first: int, entries: Sequence[bytes]) -> ReasonerJournal:
        message = _Serialised(name=self._name, first=first)
        message.header.stamp = rospy.Time.now()
        message.serialised = entries
        return message


class _Serialised(ReasonerJournal):
    """A message whose entries are serialised already: as objects, 50,000 of them take 18 MB for each subscriber."""

    serialised: Sequence[bytes] = ()

    def serialize(self, buff: BytesIO) -> None:
        """Write the message; its entries come last, after their number."""
        super().serialize(buff)
        buff.seek(buff.tell() - _NUMBER.size)
        buff.write(_NUMBER.pack(len(self.serialised)))
        for entry in self.serialised:
            buff.write(entry)


def _serialised(entry: Entry) -> bytes:
    """Return a metacontrol_msgs/JournalEntry as it is within a message."""
    written = BytesIO()
    JournalEntry(entry.now, kind_of(entry.content), list(values_of(entry.content))).serialize(written)
    return written.getvalue()


def _plain(values: Any) -> Any:
    """Return parameters without those that YAML can't hold: the server also takes binaries and dates."""
    if isinstance(values, Mapping):
        return {key: _plain(value) for key, value in values.items() if _is_plain(value)}
    return [_plain(value) for value in values if _is_plain(value)] if isinstance(values, list) else values


def _is_plain(value: Any) -> bool:
    return value is None or isinstance(value, (str, bool, int, float, list, Mapping))
