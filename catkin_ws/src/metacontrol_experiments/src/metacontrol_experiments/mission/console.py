"""Why a system has ended, from what roslaunch and its nodes have written to their console."""

from __future__ import annotations

import re

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_STAMP = re.compile(r"^\[ *[A-Z]+\] \[[\d., ]+\]: *")
"""What roscpp writes before what a node says."""
_POINTER = ("The traceback for the exception", "log file:")
_CAUSE = re.compile(r"ROS master \S+ is gone|REQUIRED process \[\S+\] has died!")
_ENDING = "killing on exit"
"""What roslaunch writes of each process that it ends; the master is the last one."""
_COMPLAINT = re.compile(r"error|exception|fatal|has died|unused args|invalid|no such", re.IGNORECASE)


def cause_in(text: str, seen: str = "") -> str:
    """Return why a system has ended: one line.

    It is the first line by which roslaunch or a node tells that all ends: what is written after it only follows from
    it. Without one, it is what was seen, else the last line that tells of an error, else the last line.

    Args:
        text: what the console has; on a full disk, lines are missing.
        seen: what was seen of the cause, from outside; empty: nothing.
    """
    text = _COLOUR.sub("", text)
    if (cause := _CAUSE.search(text)) is not None:
        return cause[0]
    if seen:
        return seen
    lines = _lines(text)
    return (_complaints(lines) or lines or ["it said nothing"])[-1]


def is_ending(text: str) -> bool:
    """Return whether roslaunch ends its processes, from what the console has."""
    return _ENDING in text


def last_complaint_in(text: str) -> str:
    """Return what the last line of a console that tells of an error says; empty where there is none."""
    return _STAMP.sub("", (_complaints(_lines(_COLOUR.sub("", text))) or [""])[-1])


def _lines(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if line.strip() and not line.startswith(_POINTER)]


def _complaints(lines: list[str]) -> list[str]:
    return [line for line in lines if _COMPLAINT.search(line)]
