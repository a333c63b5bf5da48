"""Whose a diagnostic is, where several robots share a master: live ones and those of a bag follow one rule.

`/diagnostics` is one topic for all robots, because drivers and aggregators expect it there. A meta-controller takes
care of the robot in its own namespace:

- A hardware_id `robot:NAMESPACE` says whose a status is, whoever publishes it. Meta-controllers say so of all that they
  publish.
- Without it, the robot's own are the statuses that a node in its namespace publishes, and those whose hardware_id is
  the namespace or a name in it. In `/`, these are all statuses.
- A topic of another name, by a remapping, is the robot's own.

Nodes are those of the innermost namespace around them that has a meta-controller.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

TOPIC = "/diagnostics"
_OWNER = "robot:"
_META_CONTROLLER = ("rosgraph_monitor", "rosgraph_manipulator")
"""Nodes that tell where a meta-controller is. The name of its third node, reasoner, is one that others have, too."""


def hardware_id_of(namespace: str) -> str:
    """Return the hardware_id that says that a status is of the robot in a namespace."""
    return _OWNER + _absolute(namespace)


def robot_of(hardware_id: str) -> str | None:
    """Return the namespace of the robot that a hardware_id names; None where it names none."""
    return _absolute(hardware_id.removeprefix(_OWNER)) if hardware_id.startswith(_OWNER) else None


def marked(hardware_id: str, namespace: str) -> str:
    """Return the hardware_id of a status of the robot in a namespace, given what its author has set.

    In `/`, the author's is left: nobody else's robot takes it for its own.
    """
    is_left = hardware_id and (_absolute(namespace) == "/" or robot_of(hardware_id) is not None)
    return hardware_id if is_left else hardware_id_of(namespace)


def robots_inside(namespace: str, nodes: Iterable[str]) -> frozenset[str]:
    """Return the namespaces of other robots inside a robot's namespace: those with a meta-controller of their own.

    Args:
        namespace: of the robot.
        nodes: resolved names of all nodes.
    """
    robot = _absolute(namespace)
    parts = (node.rpartition("/") for node in nodes)
    homes = {_absolute(home) for home, _, name in parts if name in _META_CONTROLLER}
    return frozenset(home for home in homes if home != robot and _is_in(home, robot))


def is_of_another(node: str, robots: Iterable[str]) -> bool:
    """Return whether a node, by its resolved name, is of one of the robots with these namespaces."""
    return any(_is_in(node, robot) for robot in robots)


def is_own(namespace: str, publisher: str = "", hardware_id: str = "", topic: str = TOPIC) -> bool:
    """Return whether a status is of the robot in a namespace.

    Args:
        namespace: of the robot and its meta-controller.
        publisher: resolved name of the node that publishes the status; empty where it is not known: nothing tells
            that the status is another robot's.
        hardware_id: of the status.
        topic: resolved name of the topic on which it comes.
    """
    robot = _absolute(namespace)
    owner = robot_of(hardware_id)
    if owner is not None:
        return owner == robot
    if topic != TOPIC or not publisher:
        return True
    return _is_in(publisher, robot) or _is_in(hardware_id, robot)


def own(statuses: Iterable[Any], namespace: str, publisher: str = "", topic: str = TOPIC) -> list[Any]:
    """Return the statuses that are of the robot in a namespace.

    Args:
        statuses: objects with the fields of diagnostic_msgs/DiagnosticStatus.
        namespace: of the robot and its meta-controller.
        publisher: resolved name of the node that publishes them, as `is_own` takes it.
        topic: resolved name of the topic on which they come.
    """
    return [status for status in statuses if is_own(namespace, publisher, status.hardware_id, topic)]


def _absolute(name: str) -> str:
    return "/" + name.strip("/")


def _is_in(name: str, namespace: str) -> bool:
    return f"{_absolute(name)}/".startswith(f"{namespace.rstrip('/')}/")
