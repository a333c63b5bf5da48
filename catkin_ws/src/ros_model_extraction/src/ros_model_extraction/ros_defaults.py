"""What models leave out: logging and the clock of each node, roslaunch's parameters, the meta-controller."""

from __future__ import annotations

from typing import Protocol

from ros_model.language.metamodel import PortKind

NODES = frozenset({"/rosout"})
"""Nodes that come with the master."""

_METACONTROL_PACKAGES = frozenset({"mros1_reasoner", "rosgraph_launcher", "rosgraph_manipulator", "rosgraph_monitor"})
_METACONTROL_NODES = frozenset({"reasoner", "rosgraph_manipulator", "rosgraph_monitor"})
_LAUNCHER = "rosgraph_launcher"
"""How the names of launchers begin, of which each host has one."""
_METACONTROL_PARAMETERS = frozenset(
    {"configs", "goal_msg_type", "kill_nodes", "reconfiguration_action_name", "save_action"}
)
"""Global parameters that the manipulator sets from its configuration file, beside the group `configurations`."""

REMARK = (
    "Left out, because every node has it: publishing /rosout, listening to /clock, the services ~get_loggers and "
    "~set_logger_level; the node /rosout; the parameters of roslaunch, and those with what nodes began with."
)

_TOPICS = {
    (PortKind.PUBLISHER, "/rosout"),
    (PortKind.SUBSCRIBER, "/rosout"),
    (PortKind.PUBLISHER, "/rosout_agg"),
    (PortKind.SUBSCRIBER, "/clock"),
}
_SERVICES = ("get_loggers", "set_logger_level")
_GROUPS = ("roslaunch/", "node_kit/")
_ROSLAUNCH = ("run_id", "rosversion", "rosdistro")


class Interface(Protocol):
    """An end of a node, by resolved names."""

    @property
    def node(self) -> str:
        """The node."""

    @property
    def kind(self) -> PortKind:
        """What it is."""

    @property
    def name(self) -> str:
        """Its resolved name."""


def is_plumbing(end: Interface) -> bool:
    """Return whether a client library made an interface by itself."""
    if end.kind is PortKind.SERVICE_SERVER:
        return end.name in {f"{end.node}/{service}" for service in _SERVICES}
    return (end.kind, end.name) in _TOPICS


def is_metacontrol(node: str, package: str | None) -> bool:
    """Return whether a node is one of the meta-controller's, by its package, or by its name if that is not known."""
    if package is not None:
        return package in _METACONTROL_PACKAGES
    name = node.rpartition("/")[2]
    return name in _METACONTROL_NODES or name.startswith(_LAUNCHER)


def is_metacontrol_parameter(name: str) -> bool:
    """Return whether the manipulator sets a global parameter (its name without the leading slash) for itself."""
    return name in _METACONTROL_PARAMETERS


def is_bookkeeping_parameter(name: str) -> bool:
    """Return whether roslaunch or node_kit sets a global parameter (its name without the leading slash) for itself."""
    return name.startswith(_GROUPS) or name in _ROSLAUNCH
