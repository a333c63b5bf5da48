"""Reads a reasoner's journal and decisions from a bag, without ROS; if there is no journal, its inputs.

What is lost of a damaged bag is told by a warning.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

from metacontrol_bags import messages, ownership
from metacontrol_bags.bag_file import BagError, BagFile, Connection
from metacontrol_bags.decision import Decision
from metacontrol_bags.decoding import decode
from node_kit.yaml_text import YamlError, parse_yaml

from mros1_reasoner.loop.entries import ActiveFact, Entry
from mros1_reasoner.loop.entry_text import read_entry
from mros1_reasoner.replay.recording import Recording, RecordingError, Run, Statuses

_log = logging.getLogger(__name__)

_JOURNAL = "mros1_reasoner/journal"
_DECISION = "mros1_reasoner/decision"
_ACTIVE = "rosgraph_manipulator/active_configuration"


def read_decisions(path: Path, namespace: str | None = None) -> list[Decision]:
    """Return the decisions in a bag, each from its last message.

    Raises:
        RecordingError: the bag can't be read, or holds several reasoners and no namespace is given.
    """
    last: dict[str, Decision] = {}
    topics, _ = _contents(path)
    found, lost = _messages(path, [_topic(path, topics, _DECISION, namespace)], _decision)
    for problem in lost:
        if not found:
            raise RecordingError(f"{path}: {problem}")
        _log.warning("%s: %s", path, problem)
    for _, _, decision in found:
        last[decision.id] = decision
    return list(last.values())


def read_recording(path: Path, namespace: str | None = None) -> Recording:
    """Return what a bag holds of a reasoner.

    Raises:
        RecordingError: the bag or a message can't be read, or it holds several reasoners and no namespace is given.
    """
    topics, start = _contents(path)
    recording = Recording(start)
    journal, decision, active = (_topic(path, topics, name, namespace) for name in (_JOURNAL, _DECISION, _ACTIVE))
    robot = "/" if namespace is None else namespace
    for topic, name in ((decision, _DECISION), (active, _ACTIVE)):
        robot = topic.removesuffix(name) if topic and namespace is None else robot
    readers = {journal: _part, decision: _decision, active: _active}

    def read(connection: Connection, now: float, message: Any) -> Any:
        if connection.topic in readers:
            return readers[connection.topic](connection, now, message)
        own = ownership.own(message.status, robot, connection.publisher)
        return Statuses(now, messages.seconds(message.header.stamp), tuple(own))

    raw = [] if journal in topics else [active, ownership.TOPIC]
    found, lost = _messages(path, [journal, decision, *raw], read)
    if lost:
        raise RecordingError(f"{path}: {lost[0]}: it can't be replayed")
    for topic, now, content in found:
        if topic == journal:
            _add(path, recording, content)
        elif topic == decision:
            recording.decisions.append((now, content))
        elif topic == active:
            recording.active += [(now, fact) for fact in content]
        else:
            recording.diagnostics.append(content)
    return recording


class JournalReader:
    """Reads the journal of a running reasoner, message by message, and keeps nothing of what it has passed on."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._recording = Recording()

    def take(self, message: Any) -> tuple[Run, list[Entry]]:
        """Take a metacontrol_msgs/ReasonerJournal.

        Returns:
            The run, without parameters as long as its beginning has not come, and the entries that are new since then.

        Raises:
            RecordingError: a part is missing, or this one makes no sense. Later ones can't be read either.
        """
        part = _message_part(message)
        run = next((run for run in self._recording.runs if run.name == part.name), None)
        if run is not None and not part.parameters:
            if part.first + len(part.entries) <= run.first:
                return run, []  # the beginning had it already
        elif run is None:
            self._recording.runs.clear()  # another reasoner
        _add(Path("the journal"), self._recording, part)
        run = self._recording.runs[0]
        if not run.parameters:
            return run, []
        fresh, run.entries = run.entries, []
        run.first += len(fresh)
        return run, fresh


@dataclass(frozen=True)
class _Part:
    """What a message of the journal adds: entries from the number `first` on, as `read_entry` takes them."""

    name: str
    first: int
    parameters: str
    files: dict[str, str]
    entries: list[tuple[float, str, tuple[str, ...]]]


def _part(_connection: Connection, _now: float, message: Any) -> _Part:
    return _message_part(message)


def _message_part(message: Any) -> _Part:
    return _Part(
        str(message.name),
        int(message.first),
        str(message.parameters),
        dict(zip(message.files, message.contents, strict=False)),
        [(float(item.now), str(item.kind), tuple(map(str, item.values))) for item in message.entries],
    )


def _decision(_connection: Connection, now: float, message: Any) -> Decision:
    return messages.decision(message, now)


def _active(_connection: Connection, _now: float, message: Any) -> list[ActiveFact]:
    return [ActiveFact(f.function, f.configuration, f.state) for f in message.functions]


def _add(path: Path, recording: Recording, part: _Part) -> None:
    """Add a part of the journal. The beginning may come second: a subscriber also hears what is published meanwhile.

    Raises:
        RecordingError: an earlier part is missing, or this one makes no sense.
    """
    run = next((run for run in recording.runs if run.name == part.name), None)
    if run is None:
        run = Run(part.name, first=part.first)
        recording.runs.append(run)
    if part.parameters and not run.parameters:
        try:
            parameters = parse_yaml(part.parameters)
        except YamlError as error:
            raise RecordingError(f"{path}: the reasoner's parameters are no YAML: {error}") from error
        run.parameters = parameters if isinstance(parameters, dict) else {}
        run.files = part.files
    held = run.first + len(run.entries)
    if part.first > held or part.first + len(part.entries) < run.first:
        raise RecordingError(f"{path}: a part of the reasoner's journal is missing: it can't be replayed")
    try:
        run.entries[:0] = [read_entry(*entry) for entry in part.entries[: max(0, run.first - part.first)]]
        run.entries += [read_entry(*entry) for entry in part.entries[held - part.first :]]
    except ValueError as error:
        raise RecordingError(f"{path}: {error}: it can't be replayed") from error
    run.first = min(run.first, part.first)


def _contents(path: Path) -> tuple[frozenset[str], float]:
    """Return the topics of a bag, and when it begins in s.

    Raises:
        RecordingError: it can't be read.
    """
    try:
        with BagFile(path) as bag:
            bag.scan()  # without an index, only its end tells
    except BagError as error:
        raise RecordingError(str(error)) from error
    return frozenset(connection.topic for connection in bag.connections.values()), (bag.first or 0) * 1e-9


def _topic(path: Path, topics: Collection[str], name: str, namespace: str | None) -> str:
    """Return the topic of that name in the namespace, or in the only namespace; empty if there is none."""
    if namespace is not None:
        return f"/{namespace.strip('/')}/{name}".replace("//", "/")
    found = sorted(topic for topic in topics if topic.endswith(f"/{name}"))
    if len(found) > 1:
        spaces = ", ".join(topic.removesuffix(name) for topic in found)
        raise RecordingError(f"{path}: holds several reasoners: choose one with --namespace: {spaces}")
    return found[0] if found else ""


def _messages(
    path: Path, topics: Collection[str], read: Callable[[Connection, float, Any], Any]
) -> tuple[list[tuple[str, float, Any]], tuple[str, ...]]:
    """Return topic, time of recording and content of each message, in the order of recording, and what is lost.

    Args:
        path: of the bag.
        topics: those that are read.
        read: returns the content of a message, given its connection, its time of recording in s and itself.
    """
    found: list[tuple[str, float, Any]] = []

    def take(connection: Connection, stamp: int, message: Any) -> None:
        found.append((connection.topic, stamp * 1e-9, read(connection, stamp * 1e-9, message)))

    with BagFile(path) as bag:
        lost = decode(bag, lambda connection: connection.topic in topics, take)
        for problem in bag.problems:
            _log.warning("%s: %s", path, problem)
    return sorted(found, key=itemgetter(1)), lost
