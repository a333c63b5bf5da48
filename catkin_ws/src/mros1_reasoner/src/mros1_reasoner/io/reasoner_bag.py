"""Reads a reasoner's journal and decisions from a bag, without ROS; if there is no journal, its inputs."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from metacontrol_bags import messages, ownership
from metacontrol_bags.bag import publisher_of
from metacontrol_bags.decision import Decision
from metacontrol_bags.typestore import typestore
from node_kit.io.input_files import is_file
from node_kit.yaml_text import YamlError, parse_yaml
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import TypesysError

from mros1_reasoner.loop.entries import ActiveFact
from mros1_reasoner.loop.entry_text import read_entry
from mros1_reasoner.replay.recording import Recording, RecordingError, Run, Statuses

_JOURNAL = "mros1_reasoner/journal"
_DECISION = "mros1_reasoner/decision"
_ACTIVE = "rosgraph_manipulator/active_configuration"
_UNREADABLE = (ReaderError, TypesysError, AttributeError, IndexError, UnicodeDecodeError)


def read_decisions(path: Path, namespace: str | None = None) -> list[Decision]:
    """Return the decisions in a bag, each from its last message.

    Raises:
        RecordingError: the bag can't be read, or holds several reasoners and no namespace is given.
    """
    last: dict[str, Decision] = {}
    with _open(path) as reader:
        topic = _topic(path, reader, _DECISION, namespace)
        for _, now, message in _messages(path, reader, [topic] if topic else []):
            decision = messages.decision(message, now)
            last[decision.id] = decision
    return list(last.values())


def read_recording(path: Path, namespace: str | None = None) -> Recording:
    """Return what a bag holds of a reasoner.

    Raises:
        RecordingError: the bag can't be read, or holds several reasoners and no namespace is given.
    """
    recording = Recording()
    with _open(path) as reader:
        journal = _topic(path, reader, _JOURNAL, namespace)
        decision = _topic(path, reader, _DECISION, namespace)
        active = _topic(path, reader, _ACTIVE, namespace)
        robot = "/" if namespace is None else namespace
        for topic, name in ((decision, _DECISION), (active, _ACTIVE)):
            robot = topic.removesuffix(name) if topic and namespace is None else robot
        raw = [] if journal else [active, ownership.TOPIC]
        recording.start = reader.start_time * 1e-9
        wanted = [topic for topic in (journal, decision, *raw) if topic]
        for connection, now, message in _messages(path, reader, wanted):
            topic = connection.topic
            if topic == journal:
                _add_journal(path, recording, message)
            elif topic == decision:
                recording.decisions.append((now, messages.decision(message, now)))
            elif topic == active:
                recording.active += [(now, ActiveFact(f.function, f.configuration, f.state)) for f in message.functions]
            else:
                own = ownership.own(message.status, robot, publisher_of(connection))
                recording.diagnostics.append(Statuses(now, messages.seconds(message.header.stamp), tuple(own)))
    return recording


def _add_journal(path: Path, recording: Recording, message: Any) -> None:
    runs = [run for run in recording.runs if run.name == message.name]
    if not runs:
        runs = [Run(str(message.name), first=int(message.first))]
        recording.runs += runs
    run = runs[-1]
    if message.parameters and not run.parameters:
        try:
            parameters = parse_yaml(message.parameters)
        except YamlError as error:
            raise RecordingError(f"{path}: the reasoner's parameters are no YAML: {error}") from error
        run.parameters = parameters if isinstance(parameters, dict) else {}
        run.files = dict(zip(message.files, message.contents, strict=False))
    held = run.first + len(run.entries)
    if int(message.first) > held:
        raise RecordingError(f"{path}: a part of the reasoner's journal is missing: it can't be replayed")
    fresh = message.entries[held - int(message.first) :]
    run.entries += [read_entry(float(item.now), str(item.kind), tuple(map(str, item.values))) for item in fresh]


@contextmanager
def _open(path: Path) -> Iterator[Reader]:
    """Open a bag; any error becomes a RecordingError."""
    if not is_file(path):
        raise RecordingError(f"{path}: no such bag")
    try:
        with Reader(path) as reader:
            yield reader
    except _UNREADABLE as error:
        hint = "; it was not closed: run `rosbag reindex`" if path.suffix == ".active" else ""
        raise RecordingError(f"{path}: not a readable bag ({error}){hint}") from error


def _topic(path: Path, reader: Reader, name: str, namespace: str | None) -> str:
    """Return the topic of that name in the namespace, or in the only namespace; empty if there is none."""
    if namespace is not None:
        return f"/{namespace.strip('/')}/{name}".replace("//", "/")
    found = sorted({c.topic for c in reader.connections if c.topic == f"/{name}" or c.topic.endswith(f"/{name}")})
    if len(found) > 1:
        spaces = ", ".join(topic.removesuffix(name) for topic in found)
        raise RecordingError(f"{path}: holds several reasoners: choose one with --namespace: {spaces}")
    return found[0] if found else ""


def _messages(path: Path, reader: Reader, topics: Collection[str]) -> Iterator[tuple[Connection, float, Any]]:
    """Yield connection, time of recording and message, in the order of recording."""
    connections = [connection for connection in reader.connections if connection.topic in topics]
    if not connections:
        return
    store = typestore(connections)
    for connection, nanoseconds, data in reader.messages(connections=connections):
        try:
            message = store.deserialize_ros1(data, connection.msgtype)
        except (SerdeError, ValueError, struct.error, AssertionError) as error:
            raise RecordingError(f"{path}: a message on {connection.topic} does not fit its definition") from error
        yield connection, nanoseconds * 1e-9, message
