"""Converts ROS messages to reports and decisions: messages of a bag (rosbags) and live ones (rospy).

The two differ only in how they write a time. Messages are read by their fields; no message class is imported.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from metacontrol_bags import ownership
from metacontrol_bags.decision import Candidate, Cause, Decision
from metacontrol_bags.record import (
    ComponentReport,
    ConfigurationReport,
    CostReport,
    Event,
    GoalReport,
    QualityReport,
)
from metacontrol_bags.words import DiagnosticWords

if TYPE_CHECKING:
    from collections.abc import Iterable

DiagnosticReport = ComponentReport | QualityReport | CostReport

_NANO = 1_000_000_000
_COST_FIGURES = {DiagnosticWords.CPU_USAGE: "cpu", DiagnosticWords.MEMORY_USAGE: "memory"}


def seconds(time: Any) -> float:
    """Return a ROS time in s."""
    if hasattr(time, "nanosec"):
        return float(int(time.sec) + int(time.nanosec) / _NANO)
    return float(time.secs + time.nsecs / _NANO)


def header_stamp(header: Any, received: float) -> float:
    """Return the stamp of a header in s; the time of reception where the stamp is zero."""
    stamp = seconds(header.stamp)
    return stamp if stamp > 0 else received


def event(message: Any, received: float) -> Event:
    """Return what a metacontrol_msgs/MissionEvent says."""
    values = {pair.key: pair.value for pair in message.values}
    return Event(header_stamp(message.header, received), message.kind, message.name, values)


def diagnostics(
    message: Any, received: float, namespace: str = "/", publisher: str = ""
) -> tuple[DiagnosticReport, ...]:
    """Return what a diagnostic_msgs/DiagnosticArray says of components, qualities and cost of one robot.

    A level or cost that is no finite number is left out.

    Args:
        message: the array.
        received: when, s.
        namespace: of the robot; `ownership` says which statuses are its own.
        publisher: name of the node that has published the array; empty where it is not known.
    """
    stamp = header_stamp(message.header, received)
    reports: list[DiagnosticReport] = []
    for status in ownership.own(message.status, namespace, publisher):
        if status.message == DiagnosticWords.COMPONENT_STATUS:
            told = (pair for n, pair in enumerate(status.values) if n == 0 or pair.key != DiagnosticWords.REASON)
            reports += (ComponentReport(stamp, pair.key, pair.value) for pair in told)
        elif status.message == DiagnosticWords.QA_STALE:
            reports += (QualityReport(stamp, pair.key, None) for pair in status.values)
        elif status.message == DiagnosticWords.QA_STATUS:
            reports += (QualityReport(stamp, name, level) for name, level in _numbers(status.values))
        elif status.message in _COST_FIGURES:
            figure = _COST_FIGURES[status.message]
            reports += (CostReport(stamp, figure, "/" + n.lstrip("/"), v) for n, v in _numbers(status.values))
    return tuple(reports)


def configurations(message: Any, received: float) -> tuple[ConfigurationReport, ...]:
    """Return the functions of a metacontrol_msgs/ActiveConfiguration."""
    stamp = header_stamp(message.header, received)
    return tuple(ConfigurationReport(stamp, f.function, f.configuration, f.state) for f in message.functions)


def decision(message: Any, received: float) -> Decision:
    """Return what a metacontrol_msgs/Decision says; fields that an older definition lacks are empty."""
    return Decision(
        id=str(message.id),
        state=str(message.state),
        objective=str(message.objective),
        trigger=str(message.trigger),
        from_configuration=str(message.from_configuration),
        to_configuration=str(message.to_configuration),
        stamp=header_stamp(message.header, received),
        degraded=bool(message.degraded),
        causes=_texts(message, "causes"),
        reasons=tuple(_cause(cause) for cause in getattr(message, "reasons", ())),
        candidates=tuple(_candidate(candidate) for candidate in message.candidates),
        corrections=_texts(message, "corrections"),
        releases=_texts(message, "releases"),
        explanation=str(message.explanation),
        stamp_monitored=seconds(message.stamp_monitored),
        stamp_analysed=seconds(message.stamp_analysed),
        stamp_planned=seconds(message.stamp_planned),
        stamp_executed=seconds(message.stamp_executed),
        analyse_wall_s=float(message.analyse_wall_s),
        plan_wall_s=float(message.plan_wall_s),
        execute_wall_s=float(message.execute_wall_s),
    )


def goal(message: Any, received: float) -> GoalReport:
    """Return a goal of move_base with its own stamp: the clock of the recorder may lag."""
    return GoalReport(header_stamp(message.header, received), message.goal_id.id)


def result(message: Any, received: float) -> GoalReport:
    """Return a result of move_base."""
    status = message.status
    return GoalReport(header_stamp(message.header, received), status.goal_id.id, int(status.status), status.text)


def _numbers(pairs: Any) -> list[tuple[str, float]]:
    """Return key and value of the pairs whose value is a finite number."""
    found = []
    for pair in pairs:
        try:
            value = float(pair.value)
        except ValueError:
            continue
        if math.isfinite(value):
            found.append((pair.key, value))
    return found


def _texts(message: Any, name: str) -> tuple[str, ...]:
    return tuple(str(text) for text in getattr(message, name, ()))


def _cause(message: Any) -> Cause:
    values = {item.name: getattr(message, item.name) for item in fields(Cause)}
    return Cause(**values | {"stamp": seconds(message.stamp)})


def _candidate(message: Any) -> Candidate:
    return Candidate(
        name=str(message.name),
        expected=_levels(message.expected_qas),
        levels=_levels(getattr(message, "levels", ())),
        utility=float(message.utility),
        chosen=bool(message.chosen),
        refused_because=str(message.refused_because),
        lost_because=str(getattr(message, "lost_because", message.refused_because)),
    )


def _levels(messages: Iterable[Any]) -> dict[str, float]:
    return {str(quality.name): float(quality.value) for quality in messages}
