"""A decision as its message holds it, pure: from the loop, from a live message or from a bag's, and to a message."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from typing import Any

from mros1_reasoner.planning.decision import Cause, Decision

_NANO = 1_000_000_000


@dataclass(frozen=True)
class CandidateRecord:
    """A metacontrol_msgs/Candidate; `expected` and `levels` hold pairs (quality, level)."""

    name: str
    expected: tuple[tuple[str, float], ...]
    levels: tuple[tuple[str, float], ...]
    utility: float
    chosen: bool
    refused_because: str
    lost_because: str


@dataclass(frozen=True)
class DecisionRecord:
    """A metacontrol_msgs/Decision; stamps are s of ROS time."""

    id: str
    state: str
    objective: str
    trigger: str
    causes: tuple[str, ...]
    reasons: tuple[Cause, ...]
    from_configuration: str
    to_configuration: str
    degraded: bool
    candidates: tuple[CandidateRecord, ...]
    corrections: tuple[str, ...]
    releases: tuple[str, ...]
    explanation: str
    stamp_monitored: float
    stamp_analysed: float
    stamp_planned: float
    stamp_executed: float
    analyse_wall_s: float
    plan_wall_s: float
    execute_wall_s: float


def record_of(decision: Decision) -> DecisionRecord:
    """Return what the message about a decision of the loop says."""
    candidates = tuple(
        CandidateRecord(
            name=candidate.design.name,
            expected=tuple(sorted(candidate.design.expected.items())),
            levels=tuple(sorted(candidate.levels.items())),
            utility=candidate.utility,
            chosen=candidate.chosen,
            refused_because=candidate.refused_because,
            lost_because=candidate.lost_because,
        )
        for candidate in decision.candidates
    )
    others = {f.name: getattr(decision, f.name) for f in fields(DecisionRecord) if f.name != "candidates"}
    return DecisionRecord(candidates=candidates, **others)


def read_message(message: Any) -> DecisionRecord:
    """Return what a Decision says, whether rospy or rosbags made it; what an older one lacks is empty."""
    values: dict[str, Any] = {}
    for item in fields(DecisionRecord):
        value = getattr(message, item.name, ())
        if item.name.startswith("stamp_"):
            value = seconds(value)
        elif item.name == "candidates":
            value = tuple(_candidate(candidate) for candidate in value)
        elif item.name == "reasons":
            value = tuple(_cause(cause) for cause in value)
        elif not isinstance(value, (str, bool, int, float)):
            value = tuple(str(text) for text in value)
        values[item.name] = value
    return DecisionRecord(**values)


def fill_message(message: Any, record: DecisionRecord, time_of: Callable[[float], Any], types: Any) -> Any:
    """Fill a Decision and return it.

    Args:
        message: the Decision.
        record: what it shall say.
        time_of: makes a message's time of s.
        types: has the message classes Candidate, Cause and ExpectedQA.
    """
    for item in fields(record):
        value = getattr(record, item.name)
        if item.name.startswith("stamp_"):
            value = time_of(max(0.0, value))
        elif item.name == "candidates":
            value = [
                types.Candidate(
                    name=candidate.name,
                    expected_qas=[types.ExpectedQA(name=name, value=level) for name, level in candidate.expected],
                    levels=[types.ExpectedQA(name=name, value=level) for name, level in candidate.levels],
                    utility=candidate.utility,
                    chosen=candidate.chosen,
                    refused_because=candidate.refused_because,
                    lost_because=candidate.lost_because,
                )
                for candidate in value
            ]
        elif item.name == "reasons":
            value = [
                types.Cause(**{f.name: getattr(cause, f.name) for f in fields(Cause)} | {"stamp": time_of(cause.stamp)})
                for cause in value
            ]
        elif isinstance(value, tuple):
            value = list(value)
        setattr(message, item.name, value)
    return message


def seconds(time: Any) -> float:
    """Return a message's time in s, whether rospy (secs, nsecs) or rosbags (sec, nanosec) made it."""
    if hasattr(time, "nanosec"):
        return int(time.sec) + int(time.nanosec) / _NANO
    return time.secs + time.nsecs / _NANO


def _candidate(message: Any) -> CandidateRecord:
    return CandidateRecord(
        name=str(message.name),
        expected=_levels(message.expected_qas),
        levels=_levels(getattr(message, "levels", ())),
        utility=float(message.utility),
        chosen=bool(message.chosen),
        refused_because=str(message.refused_because),
        lost_because=str(getattr(message, "lost_because", message.refused_because)),
    )


def _levels(messages: Iterable[Any]) -> tuple[tuple[str, float], ...]:
    return tuple((str(quality.name), float(quality.value)) for quality in messages)


def _cause(message: Any) -> Cause:
    values = {f.name: getattr(message, f.name) for f in fields(Cause)}
    return Cause(**values | {"stamp": seconds(message.stamp)})
