"""Read a mission's bag, without ROS, into a `MissionRecord`.

Message types come from the bag itself: every connection of a bag carries the definition of its messages.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.typesys import TypesysError

from metacontrol_bags import messages
from metacontrol_bags.record import (
    ComponentReport,
    CostReport,
    GoalReport,
    MissionRecord,
    OccupancyMap,
    QualityReport,
)
from metacontrol_bags.typestore import typestore

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rosbags.interfaces import Connection

    from metacontrol_bags.decision import Decision
    from metacontrol_bags.record import ConfigurationReport, Event

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

_OCCUPIED = 50
"""Cells of an OccupancyGrid from this value on are drawn as obstacles (unknown is -1, free 0, occupied 100)."""

_CUBE = 1
"""Type of a visualization_msgs/Marker that shows clutter; people are cylinders."""


class BagError(ValueError):
    """A bag cannot be used; one line that names it and says what to do."""


def read_record(path: Path) -> MissionRecord:
    """Return the record of a mission from its bag.

    Raises:
        BagError: the file is missing, no bag, not closed, or holds messages that do not fit their definition.
    """
    if not os.path.isfile(path):  # False also for what can be no path
        raise BagError(f"{path}: no such bag")
    builder = _Builder()
    try:
        with Reader(path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in builder.handlers]
            store = typestore(wanted)
            for connection, nanoseconds, data in reader.messages(connections=wanted):
                message = store.deserialize_ros1(data, connection.msgtype)
                builder.publisher = publisher_of(connection)
                builder.handlers[connection.topic](nanoseconds * 1e-9, message)
            if not reader.message_count:
                raise BagError(f"{path}: holds no messages")
            first, last = reader.start_time * 1e-9, reader.end_time * 1e-9
    except (ReaderError, TypesysError, AttributeError, IndexError, UnicodeDecodeError) as error:
        hint = "; it was not closed: run `rosbag reindex`" if path.suffix == ".active" else ""
        raise BagError(f"{path}: not a readable mission bag ({error}){hint}") from error
    return builder.build(first, last)


def publisher_of(connection: Connection) -> str:
    """Return the name of the node that published the messages of a connection; empty where the bag does not tell."""
    return str(getattr(connection.ext, "callerid", None) or "")


class _Builder:
    """Collects what the messages say; one handler per topic, called with the time of recording in s and the message.

    Attributes:
        publisher: of the message that is handled now.
    """

    def __init__(self) -> None:
        self.publisher = ""
        self._events: list[Event] = []
        self._poses: list[tuple[float, float, float]] = []
        self._samples: dict[str, list[tuple[float, float]]] = {"safety": [], "energy": [], "contacts": []}
        self._diagnostics: list[messages.DiagnosticReport] = []
        self._configurations: list[ConfigurationReport] = []
        self._decisions: list[Decision] = []
        self._goals: list[GoalReport] = []
        self._results: list[GoalReport] = []
        self._commands: list[float] = []
        self._obstacles: dict[tuple[str, float, float], None] = {}
        self._map: OccupancyMap | None = None
        self.handlers: dict[str, Callable[[float, Any], None]] = {
            "/mission/event": lambda t, m: self._events.append(messages.event(m, t)),
            "/diagnostics": lambda t, m: self._diagnostics.extend(messages.diagnostics(m, t, publisher=self.publisher)),
            "/mros1_reasoner/decision": lambda t, m: self._decisions.append(messages.decision(m, t)),
            "/move_base/goal": lambda t, m: self._goals.append(messages.goal(m, t)),
            "/move_base/result": lambda t, m: self._results.append(messages.result(m, t)),
            "/rosgraph_manipulator/active_configuration": lambda t, m: self._configurations.extend(
                messages.configurations(m, t)
            ),
            "/ground_truth/state": self._add_pose,
            "/ground_truth/safety": lambda t, m: self._add_sample("safety", t, m),
            "/ground_truth/energy": lambda t, m: self._add_sample("energy", t, m),
            "/ground_truth/contacts": lambda t, m: self._add_sample("contacts", t, m),
            "/cmd_vel": lambda t, _: self._commands.append(t),
            "/ground_truth/obstacles": self._add_obstacles,
            "/map": self._take_map,
        }

    def build(self, first: float, last: float) -> MissionRecord:
        """Return the record; `first` and `last` are the stamps in s of the bag's first and last message."""
        return MissionRecord(
            events=tuple(self._events),
            poses=np.array(self._poses, dtype=np.float64).reshape(-1, 3),
            true_quality={name: tuple(self._samples[name]) for name in ("safety", "energy")},
            contacts=tuple(self._samples["contacts"]),
            components=tuple(report for report in self._diagnostics if isinstance(report, ComponentReport)),
            observed=tuple(report for report in self._diagnostics if isinstance(report, QualityReport)),
            costs=tuple(report for report in self._diagnostics if isinstance(report, CostReport)),
            configurations=tuple(self._configurations),
            decisions=tuple(self._decisions),
            goals=tuple(self._goals),
            results=tuple(self._results),
            commands=tuple(self._commands),
            obstacles=tuple((x, y) for _, x, y in self._obstacles),
            map=self._map,
            first_stamp=first,
            last_stamp=last,
        )

    def _add_pose(self, received: float, message: Any) -> None:
        position = message.pose.pose.position
        if math.isfinite(position.x) and math.isfinite(position.y):
            self._poses.append((messages.header_stamp(message.header, received), position.x, position.y))

    def _add_sample(self, name: str, received: float, message: Any) -> None:
        if math.isfinite(message.data):
            self._samples[name].append((received, float(message.data)))

    def _add_obstacles(self, _received: float, message: Any) -> None:
        for marker in message.markers:
            place = marker.pose.position
            if marker.action == 0 and marker.type == _CUBE and math.isfinite(place.x) and math.isfinite(place.y):
                self._obstacles[marker.ns, round(place.x, 1), round(place.y, 1)] = None

    def _take_map(self, _received: float, message: Any) -> None:
        info = message.info
        grid = np.asarray(message.data, dtype=np.int8)
        if grid.size and grid.size == info.width * info.height:
            cells = grid.reshape(info.height, info.width) >= _OCCUPIED
            origin = info.origin.position
            self._map = OccupancyMap(float(info.resolution), origin.x, origin.y, cells)
