"""Names in the graph: namespaces, anonymous nodes, patterns of what may run beside the model."""

from __future__ import annotations

import fnmatch
import re
from typing import TYPE_CHECKING

from ros_model.language.graph_names import ABSOLUTE_TOPICS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from ros_model.language.metamodel import SystemParameter

IGNORED_NODES = (
    *("rosout", "rosgraph_*", "reasoner", "mission", "mission_*", "rviz*", "rosbag*", "record", "rostopic*"),
    *("action_relay", "rosservice*", "rqt*", "diagnostic_aggregator", "diagnostic_names", "roslaunch*", "rostest*"),
    "metacontrol_dashboard",
)
"""Nodes that never count as additional: the meta-controller's own, missions and tools."""
COMMON_TOPICS = ABSOLUTE_TOPICS
"""Topics that any node may have, and that say nothing of what it is for."""
IGNORED_PORTS = (
    *COMMON_TOPICS,
    *("*/bond", "*/parameter_descriptions", "*/parameter_updates", "~*"),
)
"""Interfaces that never count as additional: those that most nodes have, and what lies under a node's own name."""

_RECONFIGURED = ("/set_parameters", "/parameter_descriptions", "/parameter_updates")

# rospy: NAME_PID_MILLISECONDS; roscpp: NAME_NANOSECONDS (and tools with epoch seconds, such as /rviz_1700000000). These
# are times of 2014 to 2033. roslaunch: NAME_HOST_PID_RANDOM, a number of 63 bits. The serial number of a device, as in
# /camera_819612070807, is none of these.
_PID = r"_[1-9]\d{0,6}"
_TIME = r"_1[4-9]\d{8}(\d{3}|\d{9})?"
_ANONYMOUS = re.compile(rf"(?P<stem>.+?)(({_PID})?{_TIME}|{_PID}_\d{{16,19}})")


def resolved(name: str, namespace: str = "/") -> str:
    """Return the name in the graph, from one relative to the namespace."""
    return name if name.startswith("/") else f"/{namespace.strip('/')}/{name}".replace("//", "/")


def relative(name: str, namespace: str = "/") -> str | None:
    """Return the name relative to the namespace, without a leading slash; None where it is outside."""
    prefix = f"/{namespace.strip('/')}/".replace("//", "/")
    return name.removeprefix(prefix) if name.startswith(prefix) else None


def system_parameter_name(parameter: SystemParameter) -> str:
    """Return the name of a parameter of the system, relative to the namespace."""
    return "/".join(part.strip("/") for part in (parameter.namespace, parameter.name) if part)


def is_ignored_node(name: str, patterns: Iterable[str]) -> bool:
    """Return whether a node may run that the model lacks: its name is anonymous or fits a shell pattern."""
    return _ANONYMOUS.fullmatch(name) is not None or any(fnmatch.fnmatchcase(name, p.lstrip("/")) for p in patterns)


def is_ignored_port(name: str, node: str, patterns: Iterable[str]) -> bool:
    """Return whether a node may have an interface that the model lacks.

    Args:
        name: resolved name of the topic, service or action.
        node: resolved name of the node.
        patterns: shell patterns of resolved names, and with `~` in place of the node's own name.
    """
    own = f"~{name.removeprefix(node + '/')}" if name.startswith(node + "/") else ""
    return any(fnmatch.fnmatchcase(own if p.startswith("~") else name, p) for p in patterns)


def is_reconfigured_part(name: str, node: str) -> bool:
    """Return whether a resolved name is one that dynamic_reconfigure makes below a node: its parts may come and go."""
    return name.startswith(f"{node}/") and name.endswith(_RECONFIGURED)


def instance(name: str, nodes: Collection[str]) -> str | None:
    """Return the running node for a resolved name of the model: the same name, else its first anonymous instance."""
    return instances([name], nodes).get(name)


def instances(names: Iterable[str], nodes: Collection[str]) -> dict[str, str]:
    """Return the running node for each resolved name of a model; names for which none runs are left out.

    A node stands for one name only: for its own where that is among them, else for the first that has none yet.
    """
    names = tuple(names)
    found = {name: name for name in names if name in nodes}
    if len(found) == len(names):
        return found
    free: dict[str, list[str]] = {}
    for node in sorted(set(nodes).difference(found)):
        if (stem := _stem(node)) != node:
            free.setdefault(stem, []).append(node)
    for name in names:
        if name not in found and free.get(_stem(name)):
            found[name] = free[_stem(name)].pop(0)
    return found


def _stem(name: str) -> str:
    match = _ANONYMOUS.fullmatch(name) if name[-1:].isdigit() else None
    return match["stem"] if match else name
