"""Diagnostic statuses as plain data, in the published forms (names and messages that other tools read)."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticStatus
from metacontrol_msgs.msg import DiagnosticWords as Words


class Level(enum.IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = DiagnosticStatus.OK
    WARN = DiagnosticStatus.WARN
    ERROR = DiagnosticStatus.ERROR
    STALE = DiagnosticStatus.STALE


@dataclass(frozen=True)
class Status:
    """One diagnostic status: what a DiagnosticStatus message holds."""

    level: Level
    name: str
    message: str
    values: tuple[tuple[str, str], ...] = ()
    hardware_id: str = ""


def graph_ok() -> Status:
    """Return the status that says that the graph is as desired."""
    return Status(Level.OK, Words.GRAPH, Words.RUNNING_OK)


def graph_problem(reason: str) -> Status:
    """Return the status that says that the graph can't be compared."""
    return Status(Level.ERROR, Words.GRAPH, reason)
