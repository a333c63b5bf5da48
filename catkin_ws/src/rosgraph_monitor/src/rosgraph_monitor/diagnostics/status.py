"""Diagnostic statuses as plain data, in the published forms (names and messages that other tools read)."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Level(enum.IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


MISSING_NODE = "Missing node"
ADDITIONAL_NODE = "Additional node"
WRONG_PARAMETER = "Wrong param configuration"
MISSING_PORT = "Missing port"
ADDITIONAL_PORT = "Additional port"
WRONG_TYPE = "Wrong type"
MISSING_CONNECTION = "Missing connection"
SILENT_TOPIC = "Silent topic"
SLOW_TOPIC = "Slow topic"
STUCK_TOPIC = "Stuck topic"
COMPONENT_STATUS = "Component status"
QA_STATUS = "QA status"
QA_STALE = "QA stale"
CPU_USAGE = "CPU Usage"
MEMORY_USAGE = "Memory Usage"


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
    return Status(Level.OK, "ROS Graph", "running OK")


def graph_problem(reason: str) -> Status:
    """Return the status that says that the graph can't be compared."""
    return Status(Level.ERROR, "ROS Graph", reason)
