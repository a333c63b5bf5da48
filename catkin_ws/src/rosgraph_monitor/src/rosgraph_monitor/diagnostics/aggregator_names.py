"""Names for the diagnostic aggregator, which identifies a status by its name alone.

The published forms use one name for many things: the name of a node stands for its absence, its parameters and its CPU.
A quality attribute has no name at all. Here each thing gets a name of its own, which begins with its group.
"""

from __future__ import annotations

from typing import Any

from metacontrol_bags import ownership
from metacontrol_msgs.msg import DiagnosticWords as Words

COMPONENT, QUALITY, GRAPH, USAGE = "Component ", "Quality ", "Graph ", "Usage "
"""Prefixes of the groups, as config/diagnostic_aggregator.yaml has them."""

_OF_NODES = (Words.MISSING_NODE, Words.ADDITIONAL_NODE, Words.WRONG_PARAMETER, Words.MISSING_CONNECTION)
_OF_PORTS = (Words.MISSING_PORT, Words.ADDITIONAL_PORT, Words.WRONG_TYPE)
_OF_TOPICS = (Words.SILENT_TOPIC, Words.SLOW_TOPIC, Words.STUCK_TOPIC)
_OF_USAGE = (Words.CPU_USAGE, Words.MEMORY_USAGE)


def unique_name(status: Any) -> str:
    """Return a name that nothing else has; statuses of other nodes keep their names.

    The name of what is of a robot in a namespace ends with the namespace.

    Args:
        status: with the fields of diagnostic_msgs/DiagnosticStatus.
    """
    robot = ownership.robot_of(status.hardware_id) or "/"
    return _name(status) + (f" in {robot}" if robot != "/" else "")


def _name(status: Any) -> str:
    message, name = status.message, status.name
    key, value = (status.values[0].key, status.values[0].value) if status.values else ("", "")
    names = {
        **dict.fromkeys((Words.QA_STATUS, Words.QA_STALE), f"{QUALITY}{key}" + (f" of {name}" if name else "")),
        **dict.fromkeys(_OF_NODES, f"{GRAPH}{name}: {message}"),
        **dict.fromkeys(_OF_PORTS, f"{GRAPH}{name}: {message} {value}"),
        **dict.fromkeys(_OF_TOPICS, f"{GRAPH}{name}: {message}"),
        **dict.fromkeys(_OF_USAGE, f"{USAGE}{name}: {message}"),
        Words.COMPONENT_STATUS: f"{COMPONENT}{key}",
    }
    if message in names and (key or message in _OF_TOPICS):
        return names[message]
    return f"{GRAPH}{name}" if name == Words.GRAPH else str(name)
