"""What ROS itself gives every node, and which models leave out: logging, the clock, roslaunch's own parameters."""

from __future__ import annotations

from typing import Protocol

from ros_model.language.metamodel import PortKind

NODES = frozenset({"/rosout"})
"""Nodes that come with the master."""

REMARK = (
    "Left out, because every node has it: publishing /rosout, listening to /clock, the services ~get_loggers and "
    "~set_logger_level; the node /rosout; the parameters of roslaunch."
)

_TOPICS = {
    (PortKind.PUBLISHER, "/rosout"),
    (PortKind.SUBSCRIBER, "/rosout"),
    (PortKind.PUBLISHER, "/rosout_agg"),
    (PortKind.SUBSCRIBER, "/clock"),
}
_SERVICES = ("get_loggers", "set_logger_level")
_ROSLAUNCH = ("roslaunch/", "run_id", "rosversion", "rosdistro")


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


def is_roslaunch_parameter(name: str) -> bool:
    """Return whether roslaunch sets a global parameter (its name without the leading slash) for its own purposes."""
    return name.startswith(_ROSLAUNCH[0]) or name in _ROSLAUNCH[1:]
