"""The record of a mission of D1 from its bag, without ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from metacontrol_bags import messages
from metacontrol_bags.bag_file import BagError, BagFile
from metacontrol_bags.decision import Decision
from metacontrol_bags.decoding import decode
from metacontrol_bags.record import (
    ComponentReport,
    ConfigurationReport,
    Event,
    GoalReport,
    MissionRecord,
    QualityReport,
)

from metacontrol_experiments.pyramid.scenarios import ARMS

if TYPE_CHECKING:
    from pathlib import Path

    from metacontrol_bags.bag_file import Connection
    from numpy.typing import NDArray

ACTION = "build"
TOPICS = (
    "/build/cancel",
    "/build/feedback",
    "/build/goal",
    "/build/result",
    "/build/status",
    "/cell_pose",
    "/clock",
    "/cmd_vel",
    "/diagnostics",
    "/ground_truth/blocks",
    "/ground_truth/cell",
    "/ground_truth/state",
    "/joint_states",
    "/mission/event",
    "/move_position/goal",
    "/move_position/result",
    "/mros1_reasoner/decision",
    "/mros1_reasoner/journal",
    "/odom",
    "/rosgraph_manipulator/active_configuration",
    "/rosgraph_manipulator_action_server/goal",
    "/rosgraph_manipulator_action_server/result",
    "/rosout",
    "/simulator/left_arm/state",
    "/simulator/light",
    "/simulator/right_arm/state",
    "/tag_detection",
    "/tag_share",
    "/tf",
    "/tf_static",
)
"""What a mission of D1 records: no images."""

_BLOCKS = "/ground_truth/blocks"
_SAFETY = "_arm: safety"
_ERROR = 2
"""Level of a diagnostic_msgs/DiagnosticStatus."""


@dataclass(frozen=True)
class Stop:
    """A change of an arm's safety stop, as its driver tells; stamp in s."""

    stamp: float
    arm: str
    is_stopped: bool


@dataclass(frozen=True)
class PyramidRecord:
    """Everything that a bag holds of a mission of D1. Stamps are s of ROS time; poses are in the map frame.

    Attributes:
        mission: events, components, levels, configurations, decisions, and the results of the action.
        groundings: what runs for each function that anything runs for, at each change, in the order of the changes.
        stops: of the arms.
        base: (n, 5) array of stamp, x, y, yaw, speed: m, m, rad, and m/s with rad/s added.
        arms: of each arm an (n, 3) array of stamp, speed of the fastest joint in rad/s, contact force in N.
        block_stamps: (n,).
        blocks: (n, 6, 7) positions in m and quaternions x, y, z, w.
        joints: name -> (n, 2) array of stamp and position.
        tag_share: (n, 2) array of stamp and the share of images in which a tag was found.
        light: (n, 2) array of stamp and brightness.
        steps: stamps, and what the program that builds began then.
        obstacles: stamps, and name, centre and edges in m of every obstacle that stands from then on.
    """

    mission: MissionRecord
    groundings: tuple[tuple[ConfigurationReport, ...], ...] = ()
    stops: tuple[Stop, ...] = ()
    base: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 5)))
    arms: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    block_stamps: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    blocks: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 6, 7)))
    joints: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    tag_share: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    light: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    steps: tuple[tuple[float, str], ...] = ()
    obstacles: tuple[tuple[float, dict[str, tuple[Any, Any]]], ...] = ()


def is_of_pyramid(path: Path) -> bool:
    """Return whether a bag is one of a mission of D1.

    Raises:
        BagError: the file is no bag.
    """
    with BagFile(path) as bag:
        bag.scan()
        return any(connection.topic == _BLOCKS for connection in bag.connections.values())


def read_pyramid(path: Path) -> PyramidRecord:
    """Return the record of a mission of D1 from its bag.

    Raises:
        BagError: the file is no bag, damaged, or holds nothing of such a mission.
    """
    reader = _Reader()
    with BagFile(path) as bag:
        lost = decode(bag, lambda connection: connection.topic in reader.handlers, reader.take)
        problems = (*bag.problems, *lost)
        first, last = (bag.first or 0) * 1e-9, (bag.last or 0) * 1e-9
    if problems:
        raise BagError(f"{path}: not a readable bag of a mission ({problems[0]})")
    record = reader.record(first, last)
    if not len(record.block_stamps) or not record.mission.events:
        raise BagError(f"{path}: holds no mission of D1: /mission/event or /ground_truth/blocks is missing")
    return record


class _Reader:
    """Collects what messages say, by kind."""

    def __init__(self) -> None:
        self.handlers = {
            "/build/feedback": self._feedback,
            "/build/result": self._result,
            "/diagnostics": self._diagnostics,
            _BLOCKS: self._blocks,
            "/ground_truth/cell": self._cell,
            "/ground_truth/state": self._state,
            "/joint_states": self._joints,
            "/mission/event": lambda now, m, _: self._events.append(messages.event(m, now)),
            "/mros1_reasoner/decision": lambda now, m, _: self._decisions.append(messages.decision(m, now)),
            "/rosgraph_manipulator/active_configuration": self._active,
            "/simulator/light": lambda now, m, _: self._light.append((now, float(m.data))),
            "/tag_share": lambda now, m, _: self._share.append((now, float(m.data))),
            **{f"/simulator/{arm}_arm/state": self._arm(arm) for arm in ARMS},
        }
        self._events: list[Event] = []
        self._decisions: list[Decision] = []
        self._groundings: list[tuple[ConfigurationReport, ...]] = []
        self._reports: list[Any] = []
        self._results: list[GoalReport] = []
        self._stops: list[Stop] = []
        self._stopped: dict[str, bool] = {}
        self._base: list[tuple[float, ...]] = []
        self._arms: dict[str, list[tuple[float, float, float]]] = {arm: [] for arm in ARMS}
        self._block_stamps: list[float] = []
        self._block_poses: list[list[tuple[float, ...]]] = []
        self._positions: dict[str, list[tuple[float, float]]] = {}
        self._light: list[tuple[float, float]] = []
        self._share: list[tuple[float, float]] = []
        self._steps: list[tuple[float, str]] = []
        self._obstacles: list[tuple[float, dict[str, tuple[Any, Any]]]] = []

    def take(self, connection: Connection, nanoseconds: int, message: Any) -> None:
        self.handlers[connection.topic](nanoseconds * 1e-9, message, connection.publisher)

    def record(self, first: float, last: float) -> PyramidRecord:
        reports = self._reports
        return PyramidRecord(
            MissionRecord(
                events=tuple(self._events),
                components=tuple(report for report in reports if isinstance(report, ComponentReport)),
                observed=tuple(report for report in reports if isinstance(report, QualityReport)),
                configurations=tuple(report for reports in self._groundings for report in reports),
                decisions=tuple(self._decisions),
                results=tuple(self._results),
                first_stamp=first,
                last_stamp=last,
            ),
            tuple(self._groundings),
            tuple(self._stops),
            _table(self._base, 5),
            {arm: _table(rows, 3) for arm, rows in self._arms.items()},
            np.array(self._block_stamps),
            np.array(self._block_poses).reshape(len(self._block_stamps), -1, 7),
            {name: _table(rows, 2) for name, rows in self._positions.items()},
            _table(self._share, 2),
            _table(self._light, 2),
            tuple(self._steps),
            tuple(self._obstacles),
        )

    def _feedback(self, now: float, message: Any, _publisher: str) -> None:
        self._steps.append((messages.header_stamp(message.header, now), str(message.feedback.step)))

    def _result(self, now: float, message: Any, _publisher: str) -> None:
        self._results.append(messages.result(message, now))

    def _diagnostics(self, now: float, message: Any, publisher: str) -> None:
        self._reports += messages.diagnostics(message, now, "/", publisher)
        for status in message.status:
            arm = status.name.lstrip("/").removesuffix(_SAFETY)
            if status.name.endswith(_SAFETY) and arm in ARMS:
                is_stopped = status.level == _ERROR
                if is_stopped != self._stopped.get(arm, False):
                    self._stops.append(Stop(messages.header_stamp(message.header, now), arm, is_stopped))
                self._stopped[arm] = is_stopped

    def _blocks(self, now: float, message: Any, _publisher: str) -> None:
        self._block_stamps.append(messages.header_stamp(message.header, now))
        poses = [(p.position, p.orientation) for p in message.poses]
        self._block_poses.append([(at.x, at.y, at.z, q.x, q.y, q.z, q.w) for at, q in poses])

    def _cell(self, now: float, message: Any, _publisher: str) -> None:
        standing = {
            marker.ns: (
                (marker.pose.position.x, marker.pose.position.y, marker.pose.position.z),
                (marker.scale.x, marker.scale.y, marker.scale.z),
            )
            for marker in message.markers
            if marker.action == 0 and marker.ns != "table" and not marker.ns.startswith("block_")
        }
        if standing != (self._obstacles[-1][1] if self._obstacles else {}):
            self._obstacles.append((now, standing))

    def _state(self, now: float, message: Any, _publisher: str) -> None:
        pose, speed = message.pose.pose, message.twist.twist
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        moves = math.hypot(speed.linear.x, speed.linear.y) + abs(speed.angular.z)
        self._base.append((messages.header_stamp(message.header, now), pose.position.x, pose.position.y, yaw, moves))

    def _joints(self, now: float, message: Any, _publisher: str) -> None:
        stamp = messages.header_stamp(message.header, now)
        for name, position in zip(message.name, message.position, strict=False):
            self._positions.setdefault(name, []).append((stamp, float(position)))

    def _active(self, now: float, message: Any, _publisher: str) -> None:
        self._groundings.append(messages.configurations(message, now))

    def _arm(self, arm: str) -> Any:
        def take(_now: float, message: Any, _publisher: str) -> None:
            fastest = float(np.abs(message.velocities).max())
            self._arms[arm].append((messages.seconds(message.stamp), fastest, float(message.contact_force)))

        return take


def _table(rows: list[Any], columns: int) -> NDArray[np.float64]:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)
