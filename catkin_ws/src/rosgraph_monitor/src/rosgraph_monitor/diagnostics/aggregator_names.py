"""Names for the diagnostic aggregator, which knows a status by its name alone.

The published forms use one name for many things: the name of a node for its absence, its parameters and its CPU, and
none at all for a quality attribute. Here each thing gets a name of its own, which begins with its group.
"""

from __future__ import annotations

from typing import Any

from rosgraph_monitor.diagnostics import status as s

COMPONENT, QUALITY, GRAPH, USAGE = "Component ", "Quality ", "Graph ", "Usage "
"""Prefixes of the groups, as config/diagnostic_aggregator.yaml has them."""

_OF_NODES = (s.MISSING_NODE, s.ADDITIONAL_NODE, s.WRONG_PARAMETER, s.MISSING_CONNECTION)
_OF_PORTS = (s.MISSING_PORT, s.ADDITIONAL_PORT, s.WRONG_TYPE)
_OF_TOPICS = (s.SILENT_TOPIC, s.SLOW_TOPIC, s.STUCK_TOPIC)
_OF_USAGE = (s.CPU_USAGE, s.MEMORY_USAGE)


def unique_name(status: Any) -> str:
    """Return a name that no other thing has; statuses of other origin keep theirs.

    Args:
        status: with the fields of diagnostic_msgs/DiagnosticStatus.
    """
    message, name = status.message, status.name
    key, value = (status.values[0].key, status.values[0].value) if status.values else ("", "")
    names = {
        **dict.fromkeys((s.QA_STATUS, s.QA_STALE), f"{QUALITY}{key}" + (f" of {name}" if name else "")),
        **dict.fromkeys(_OF_NODES, f"{GRAPH}{name}: {message}"),
        **dict.fromkeys(_OF_PORTS, f"{GRAPH}{name}: {message} {value}"),
        **dict.fromkeys(_OF_TOPICS, f"{GRAPH}{name}: {message}"),
        **dict.fromkeys(_OF_USAGE, f"{USAGE}{name}: {message}"),
        s.COMPONENT_STATUS: f"{COMPONENT}{key}",
    }
    if message in names and (key or message in _OF_TOPICS):
        return names[message]
    return f"{GRAPH}{name}" if name == s.graph_ok().name else str(name)
