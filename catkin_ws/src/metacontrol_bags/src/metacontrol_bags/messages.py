"""From ROS messages to the reports of `record`: the same for a bag's messages (rosbags) and for live ones (rospy).

The two differ only in how they write a time, so messages are taken by their fields and no message class is imported.
"""

from __future__ import annotations

import math
from typing import Any

from metacontrol_bags.record import (
    ComponentReport,
    ConfigurationReport,
    CostReport,
    DecisionReport,
    Event,
    GoalReport,
    QualityReport,
)
from metacontrol_bags.words import DiagnosticWords

DiagnosticReport = ComponentReport | QualityReport | CostReport

_COST_FIGURES = {DiagnosticWords.CPU_USAGE: "cpu", DiagnosticWords.MEMORY_USAGE: "memory"}


def seconds(time: Any) -> float:
    """A ROS time in s."""
    if hasattr(time, "to_sec"):
        return float(time.to_sec())
    return float(time.sec) + float(time.nanosec) * 1e-9


def header_stamp(header: Any, received: float) -> float:
    """The stamp in a header in s; the time of reception where it was left at zero."""
    stamp = seconds(header.stamp)
    return stamp if stamp > 0 else received


def event(message: Any, received: float) -> Event:
    """A metacontrol_msgs/MissionEvent."""
    values = {pair.key: pair.value for pair in message.values}
    return Event(header_stamp(message.header, received), message.kind, message.name, values)


def diagnostics(message: Any, received: float) -> tuple[DiagnosticReport, ...]:
    """What a diagnostic_msgs/DiagnosticArray says of components, qualities and cost; what is no number is left out."""
    stamp = header_stamp(message.header, received)
    reports: list[DiagnosticReport] = []
    for status in message.status:
        if status.message == DiagnosticWords.COMPONENT_STATUS:
            reports += (ComponentReport(stamp, pair.key, pair.value) for pair in status.values)
        elif status.message == DiagnosticWords.QA_STALE:
            reports += (QualityReport(stamp, pair.key, None) for pair in status.values)
        elif status.message == DiagnosticWords.QA_STATUS:
            reports += (QualityReport(stamp, name, level) for name, level in _numbers(status.values))
        elif status.message in _COST_FIGURES:
            figure = _COST_FIGURES[status.message]
            reports += (CostReport(stamp, figure, "/" + n.lstrip("/"), v) for n, v in _numbers(status.values))
    return tuple(reports)


def configurations(message: Any, received: float) -> tuple[ConfigurationReport, ...]:
    """The functions of a metacontrol_msgs/ActiveConfiguration."""
    stamp = header_stamp(message.header, received)
    return tuple(ConfigurationReport(stamp, f.function, f.configuration, f.state) for f in message.functions)


def decision(message: Any, received: float) -> DecisionReport:
    """A metacontrol_msgs/Decision."""
    return DecisionReport(
        stamp=header_stamp(message.header, received),
        id=message.id,
        state=message.state,
        objective=message.objective,
        trigger=message.trigger,
        from_configuration=message.from_configuration,
        to_configuration=message.to_configuration,
        degraded=bool(message.degraded),
        explanation=message.explanation,
        stamp_monitored=seconds(message.stamp_monitored),
        stamp_planned=seconds(message.stamp_planned),
        stamp_executed=seconds(message.stamp_executed),
    )


def goal(message: Any, received: float) -> GoalReport:
    """A goal of move_base; by its own stamp, since the clock of who received it may lag."""
    return GoalReport(header_stamp(message.header, received), message.goal_id.id)


def result(message: Any, received: float) -> GoalReport:
    """A result of move_base."""
    status = message.status
    return GoalReport(header_stamp(message.header, received), status.goal_id.id, int(status.status), status.text)


def _numbers(pairs: Any) -> list[tuple[str, float]]:
    """Key and value of those pairs whose value is a finite number."""
    found = []
    for pair in pairs:
        try:
            value = float(pair.value)
        except ValueError:
            continue
        if math.isfinite(value):
            found.append((pair.key, value))
    return found
