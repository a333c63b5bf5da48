"""Converts decisions to messages. The caller gives the message classes: those of rospy or of rosbags."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from metacontrol_bags.decision import Candidate, Cause, Decision

_LATEST = 2.0**32 - 1.0  # s, the last whole second that a message's time can hold
_NOT_IN_MESSAGE = ("stamp", "repair")


def fill_decision(message: Any, decision: Decision, time_of: Callable[[float], Any], types: Any) -> Any:
    """Fill a metacontrol_msgs/Decision, but for its header, and return it.

    Args:
        message: the Decision.
        decision: what it shall say.
        time_of: makes a message's time of s.
        types: has the message classes Candidate, Cause and ExpectedQA.
    """
    for item in fields(decision):
        value = getattr(decision, item.name)
        if item.name in _NOT_IN_MESSAGE:
            continue
        if item.name.startswith("stamp_"):
            value = _time(value, time_of)
        elif item.name == "candidates":
            value = [_candidate(candidate, types) for candidate in value]
        elif item.name == "reasons":
            value = [_cause(cause, time_of, types) for cause in value]
        elif isinstance(value, tuple):
            value = list(value)
        setattr(message, item.name, value)
    return message


def _candidate(candidate: Candidate, types: Any) -> Any:
    return types.Candidate(
        name=candidate.name,
        expected_qas=_levels(candidate.expected, types),
        levels=_levels(candidate.levels, types),
        utility=candidate.utility,
        chosen=candidate.chosen,
        refused_because=candidate.refused_because,
        lost_because=candidate.lost_because,
    )


def _levels(levels: Mapping[str, float], types: Any) -> list[Any]:
    return [types.ExpectedQA(name=name, value=level) for name, level in sorted(levels.items())]


def _cause(cause: Cause, time_of: Callable[[float], Any], types: Any) -> Any:
    return types.Cause(
        **{item.name: getattr(cause, item.name) for item in fields(Cause)} | {"stamp": _time(cause.stamp, time_of)}
    )


def _time(stamp: float, time_of: Callable[[float], Any]) -> Any:
    """Return the message's time of a stamp, in s; one before 0 is of before the clock was set back."""
    return time_of(min(max(0.0, stamp), _LATEST))
