"""Read a mission's bag, without ROS, into a `MissionRecord`.

Message types come from the bag itself: every connection of a bag carries the definition of its messages. Only the
topics that the record needs are decoded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from metacontrol_bags import messages, ownership
from metacontrol_bags.bag_file import BagError, BagFile
from metacontrol_bags.decoding import decode
from metacontrol_bags.gaps import is_mission, nothing_of_a_mission
from metacontrol_bags.record import (
    FARTHEST_M,
    ComponentReport,
    CostReport,
    MissionRecord,
    OccupancyMap,
    QualityReport,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator
    from pathlib import Path

    from metacontrol_bags.bag_file import Connection

TOPICS = (
    "/amcl_pose",
    "/power_load",
    "/odom",
    "/imu/data",
    "/d_obstacle",
    "/diagnostics",
    "/move_base/goal",
    "/move_base/cancel",
    "/move_base/status",
    "/move_base/result",
    "/move_base/NavfnROS/plan",
    "/cmd_vel",
    "/ground_truth/state",
    "/ground_truth/safety",
    "/ground_truth/energy",
    "/ground_truth/contacts",
    "/ground_truth/obstacles",
    "/tf",
    "/tf_static",
    "/map",
    "/rosgraph_manipulator/active_configuration",
    "/rosgraph_manipulator_action_server/goal",
    "/rosgraph_manipulator_action_server/result",
    "/mros1_reasoner/decision",
    "/mros1_reasoner/journal",
    "/mission/event",
    "/rosout",
)
"""What a mission records: published topics, ground truth, frames, plans, every adaptation; no clouds or scans."""

_OF_A_META_CONTROLLER = ("/rosgraph_manipulator/active_configuration", "/mros1_reasoner/decision")
"""Topics that tell in which namespaces a bag has a meta-controller."""

_OCCUPIED = 50
"""Cells of an OccupancyGrid from this value on are drawn as obstacles (unknown is -1, free 0, occupied 100)."""

_CUBE = 1
"""Type of a visualization_msgs/Marker that shows clutter; people are cylinders."""


@dataclass(frozen=True)
class Salvaged:
    """What could be read of a bag.

    Attributes:
        record: of the mission.
        topics: all topics of the bag; those of the robot as they are called in the root namespace.
        problems: what is lost, each in words; empty where nothing is.
    """

    record: MissionRecord
    topics: frozenset[str]
    problems: tuple[str, ...]


def read_record(path: Path) -> MissionRecord:
    """Return the record of a mission from its bag, which must be whole.

    Raises:
        BagError: the file is missing, no bag, not closed, holds messages that do not fit their definition, or nothing
            of a mission.
    """
    return read_whole(path).record


def read_whole(path: Path) -> Salvaged:
    """Return a mission from its bag, which must be whole, and which topics the bag has.

    Raises:
        BagError: as of `read_record`.
    """
    found = salvage(path)
    if found.problems:
        raise BagError(f"{path}: not a readable mission bag ({found.problems[0]})")
    if not is_mission(found.record):
        raise BagError(f"{path}: {nothing_of_a_mission(found)}")
    return found


def salvage(path: Path, topics: Collection[str] = (), namespace: str = "/") -> Salvaged:
    """Return what can be read of a mission from its bag, however damaged it is.

    Args:
        path: of the bag.
        topics: the only ones to read, as they are called in the root namespace; all that the record needs where empty.
        namespace: of the robot; /diagnostics is there for all robots.

    Raises:
        BagError: the file is missing, unreadable, empty or no bag.
    """
    builder = _Builder(namespace)
    wanted = set(topics or builder.handlers)
    with BagFile(path) as bag:
        lost = decode(bag, lambda connection: builder.topic_of(connection) in wanted, builder.take)
        connections = (bag.connections[number] for number, count in bag.counts.items() if count)
        held = frozenset(builder.topic_of(connection) or connection.topic for connection in connections)
        record = builder.build((bag.first or 0) * 1e-9, (bag.last or 0) * 1e-9)
    return Salvaged(record, held, (*bag.problems, *lost))


def robots(path: Path) -> tuple[str, ...]:
    """Return the namespaces of the robots with a meta-controller that a bag holds.

    Raises:
        BagError: the file is missing, unreadable or no bag.
    """
    with BagFile(path) as bag:
        bag.scan()
        topics = [bag.connections[number].topic for number, count in bag.counts.items() if count]
    found = {topic.removesuffix(end) or "/" for topic in topics for end in _OF_A_META_CONTROLLER if topic.endswith(end)}
    return tuple(sorted(found))


class _Builder:
    """Collects what the messages say; one handler for each topic, with the time of recording in s and the message."""

    def __init__(self, namespace: str = "/") -> None:
        self._home = namespace.rstrip("/")
        self._found: dict[str, list[tuple[int, Any]]] = {}
        self.handlers: dict[str, Callable[[float, Any, str], Iterable[Any]]] = {
            "/mission/event": lambda t, m, _: [messages.event(m, t)],
            "/diagnostics": lambda t, m, publisher: messages.diagnostics(m, t, namespace, publisher),
            "/mros1_reasoner/decision": lambda t, m, _: [messages.decision(m, t)],
            "/move_base/goal": lambda t, m, _: [messages.goal(m, t)],
            "/move_base/result": lambda t, m, _: [messages.result(m, t)],
            "/rosgraph_manipulator/active_configuration": lambda t, m, _: messages.configurations(m, t),
            "/ground_truth/state": _pose,
            "/ground_truth/safety": _sample,
            "/ground_truth/energy": _sample,
            "/ground_truth/contacts": _sample,
            "/cmd_vel": lambda t, _m, _p: [t],
            "/ground_truth/obstacles": _obstacles,
            "/map": _map,
        }

    def topic_of(self, connection: Connection) -> str:
        """Return what the topic of a connection is called in the root namespace; empty where it is another robot's."""
        topic = connection.topic
        if topic == ownership.TOPIC or not self._home:
            return topic
        return topic.removeprefix(self._home) if topic.startswith(f"{self._home}/") else ""

    def take(self, connection: Connection, nanoseconds: int, message: Any) -> None:
        """Keep what a message says."""
        topic = self.topic_of(connection)
        said = self.handlers[topic](nanoseconds * 1e-9, message, connection.publisher)
        self._found.setdefault(topic, []).extend((nanoseconds, item) for item in said)

    def build(self, first: float, last: float) -> MissionRecord:
        """Return the record; `first` and `last` are the stamps in s of the bag's first and last message."""
        reports = self._of("/diagnostics")
        maps = self._of("/map")
        places = dict.fromkeys(self._of("/ground_truth/obstacles"))
        return MissionRecord(
            events=self._of("/mission/event"),
            poses=np.array(self._of("/ground_truth/state"), dtype=np.float64).reshape(-1, 3),
            true_quality={name: self._of(f"/ground_truth/{name}") for name in ("safety", "energy")},
            contacts=self._of("/ground_truth/contacts"),
            components=tuple(report for report in reports if isinstance(report, ComponentReport)),
            observed=tuple(report for report in reports if isinstance(report, QualityReport)),
            costs=tuple(report for report in reports if isinstance(report, CostReport)),
            configurations=self._of("/rosgraph_manipulator/active_configuration"),
            decisions=self._of("/mros1_reasoner/decision"),
            goals=self._of("/move_base/goal"),
            results=self._of("/move_base/result"),
            commands=self._of("/cmd_vel"),
            obstacles=tuple((x, y) for _, x, y in places),
            map=maps[-1] if maps else None,
            first_stamp=first,
            last_stamp=last,
        )

    def _of(self, topic: str) -> tuple[Any, ...]:
        """Return what was said on a topic, in the order of recording."""
        return tuple(item for _, item in sorted(self._found.pop(topic, ()), key=itemgetter(0)))


def _pose(received: float, message: Any, _publisher: str) -> list[tuple[float, float, float]]:
    position = message.pose.pose.position
    if not _is_place(position):
        return []
    return [(messages.header_stamp(message.header, received), position.x, position.y)]


def _sample(received: float, message: Any, _publisher: str) -> list[tuple[float, float]]:
    return [(received, float(message.data))] if math.isfinite(message.data) else []


def _obstacles(_received: float, message: Any, _publisher: str) -> Iterator[tuple[str, float, float]]:
    for marker in message.markers:
        place = marker.pose.position
        if marker.action == 0 and marker.type == _CUBE and _is_place(place):
            yield marker.ns, round(place.x, 1), round(place.y, 1)


def _map(_received: float, message: Any, _publisher: str) -> list[OccupancyMap]:
    info = message.info
    grid = np.asarray(message.data, dtype=np.int8)
    is_drawn = _is_place(info.origin.position) and 0.0 < info.resolution * max(info.width, info.height) < FARTHEST_M
    if not grid.size or grid.size != info.width * info.height or not is_drawn:
        return []
    cells = grid.reshape(info.height, info.width) >= _OCCUPIED
    origin = info.origin.position
    return [OccupancyMap(float(info.resolution), origin.x, origin.y, cells)]


def _is_place(position: Any) -> bool:
    return abs(position.x) < FARTHEST_M and abs(position.y) < FARTHEST_M  # nor is NaN
