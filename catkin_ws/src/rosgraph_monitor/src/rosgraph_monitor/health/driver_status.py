"""Components whose drivers tell on /diagnostics how they are. Pure.

A driver by diagnostic_updater publishes statuses named `NODE: TASK`, with the resolved name of the node without its
first slash. A component follows one of them, or all of a node.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rosgraph_monitor.diagnostics.status import Level
from rosgraph_monitor.graph.names import relative
from rosgraph_monitor.health.components import NodeCondition

_CONDITIONS: dict[int, NodeCondition] = {
    Level.OK: NodeCondition.ALIVE,
    Level.WARN: NodeCondition.ALIVE,
    Level.ERROR: NodeCondition.FAILED,
}


class DriverStatuses:
    """What drivers say of components: a component has failed while one of its statuses is an error."""

    def __init__(self, names: Mapping[str, str], namespace: str = "/") -> None:
        """Start with nothing heard.

        Args:
            names: component -> name of a status, or what stands before its colon. It may leave out the namespace.
            namespace: of the robot.
        """
        self._names = {component: _without(name, namespace) for component, name in names.items()}
        self._namespace = namespace
        self._heard: dict[str, dict[str, NodeCondition]] = {component: {} for component in names}
        self._errors: dict[str, str] = {}  # what each status that is an error said when it became one

    @property
    def conditions(self) -> dict[str, NodeCondition]:
        """The condition of each component; UNKNOWN until something was heard."""
        return {component: _worst(heard.values()) for component, heard in self._heard.items()}

    @property
    def reasons(self) -> dict[str, str]:
        """What the drivers say of each component that has failed."""
        return {
            component: "; ".join(self._errors[name] for name in sorted(heard) if heard[name] is NodeCondition.FAILED)
            for component, heard in self._heard.items()
            if _worst(heard.values()) is NodeCondition.FAILED
        }

    def take(self, name: str, level: int, message: str = "") -> bool:
        """Take a status; return whether the condition of a component has changed.

        A stale status changes nothing: whoever says so knows no more either.

        Args:
            name: of the status.
            level: of the status.
            message: its text. Of an error, the first one is kept, because numbers in it may change all the time.
        """
        name = _without(name, self._namespace)
        condition = _CONDITIONS.get(level)
        if condition is None:
            return False
        changed = False
        for component, wanted in self._names.items():
            if name == wanted or name.partition(":")[0].rstrip() == wanted:
                before = _worst(self._heard[component].values())
                if condition is NodeCondition.FAILED and self._heard[component].get(name) is not condition:
                    self._errors[name] = f"its driver says {name}: {message}" if message else f"error of {name}"
                self._heard[component][name] = condition
                changed |= _worst(self._heard[component].values()) is not before
        return changed


def _without(name: str, namespace: str) -> str:
    """Return the name of a status without the namespace of the robot, which drivers put before it."""
    name = name.lstrip("/")
    return relative(f"/{name}", namespace) or name


def _worst(conditions: Iterable[NodeCondition]) -> NodeCondition:
    known = set(conditions)
    if not known:
        return NodeCondition.UNKNOWN
    return NodeCondition.FAILED if NodeCondition.FAILED in known else NodeCondition.ALIVE
