"""Words of our messages that bags hold.

They are constants of metacontrol_msgs. This package works without ROS, so the words are repeated here. A test compares
each with the message of the same name.
"""

from __future__ import annotations


class DiagnosticWords:
    """What `message` and values of a diagnostic_msgs/DiagnosticStatus say."""

    QA_STATUS = "QA status"
    QA_STALE = "QA stale"
    COMPONENT_STATUS = "Component status"
    COMPONENT_TRUE = "TRUE"
    COMPONENT_FALSE = "FALSE"
    COMPONENT_RECOVERED = "RECOVERED"
    REASON = "reason"
    CPU_USAGE = "CPU Usage"
    MEMORY_USAGE = "Memory Usage"


class FunctionGrounding:
    """States of a function's configuration."""

    STABLE = "STABLE"
    RECONFIGURING = "RECONFIGURING"
    RECOVERING = "RECOVERING"
    FAILED = "FAILED"


class Decision:
    """States of a decision."""

    PROPOSED = "PROPOSED"
    ADVISED = "ADVISED"
    DECIDED = "DECIDED"
    EXECUTED = "EXECUTED"
    FAILED = "FAILED"


class MissionEvent:
    """Kinds of events of a mission."""

    MISSION_START = "MISSION_START"
    PERTURBATION = "PERTURBATION"
    MISSION_END = "MISSION_END"
