"""How two configurations differ: which nodes start, stop, restart, and which only get other parameters."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from rosgraph_launcher.description import QUALITY_PREFIX, NodeDescription, SystemDescription


@dataclass(frozen=True)
class Difference:
    """What differs between two configurations. Names are in the order of the wanted one.

    Attributes:
        running: the configuration that runs.
        wanted: the configuration to deploy.
        starts: nodes of the wanted configuration that do not run.
        stops: nodes that only the running configuration has.
        replaced: nodes of both that differ in more than the values of parameters.
        parameters: the private parameters with a new value, for each node of both that is not replaced.
        shared: parameters outside the nodes' namespaces that get a new value, by full name.
        shared_nodes: nodes of both that another function needs, too; they run on.
        drifted: parameters of the running configuration that somebody has changed on the parameter server since, by
            full name; only if it is the wanted one, too. Nodes that take parameters while they run have theirs also in
            `parameters`; the others read them at their next start.
    """

    running: SystemDescription
    wanted: SystemDescription
    starts: tuple[str, ...]
    stops: tuple[str, ...]
    replaced: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, Any]]
    shared: Mapping[str, Any]
    shared_nodes: tuple[str, ...] = ()
    drifted: tuple[str, ...] = ()

    @property
    def touches_nodes(self) -> bool:
        """Whether any node must be started, stopped or replaced, or gets new parameters."""
        return bool(self.starts or self.stops or self.replaced or self.parameters)


def compare(
    running: SystemDescription,
    wanted: SystemDescription,
    shared_nodes: Collection[str] = (),
    drifted: Collection[str] = (),
) -> Difference:
    """Return what differs.

    A shared parameter that changes replaces all nodes, because any node may have read it at its start. Expected quality
    levels are an exception: no node reads them. A node is also replaced where the wanted configuration lacks one of
    its parameters, because a running node does not notice that a parameter was deleted.

    Args:
        running: the configuration that runs.
        wanted: the configuration to deploy.
        shared_nodes: nodes that another function needs. They run on, because they are the same in both.
        drifted: parameters of the configuration, which runs already, that somebody has changed since.
    """
    both = [name for name in wanted.nodes if name in running.nodes]
    shared = _changed(running.parameters, wanted.parameters)
    gone = set(running.parameters) - set(wanted.parameters)
    all_affected = any(not is_quality(name) for name in (*shared, *gone))
    replaced = tuple(
        name
        for name in both
        if name not in shared_nodes and (all_affected or _needs_new_process(running.nodes[name], wanted.nodes[name]))
    )
    parameters = {
        name: changed
        for name in both
        if name not in replaced and (changed := _changed(running.nodes[name].parameters, wanted.nodes[name].parameters))
    }
    return Difference(
        running,
        wanted,
        starts=tuple(name for name in wanted.nodes if name not in running.nodes),
        stops=tuple(name for name in running.nodes if name not in wanted.nodes),
        replaced=replaced,
        parameters=parameters,
        shared=shared,
        shared_nodes=tuple(name for name in both if name in shared_nodes),
        drifted=tuple(drifted),
    )


def _needs_new_process(running: NodeDescription, wanted: NodeDescription) -> bool:
    lost = set(running.parameters) - set(wanted.parameters)
    return bool(lost or running.differs_in(wanted))


def _changed(running: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in wanted.items() if key not in running or not same_value(running[key], value)}


def same_value(one: Any, other: Any) -> bool:
    """Tell whether two values of a parameter are the same: 1 and 1.0 are, and .nan and .nan; 1 and true are not."""
    if isinstance(one, bool) != isinstance(other, bool):
        return False
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same_value(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(same_value, one, other))
    return bool(one == other) or (_is_nan(one) and _is_nan(other))


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def read_by_nodes(system: SystemDescription) -> dict[str, Any]:
    """Return the parameters of a system that a node may read, by full name: all but the expected quality levels.

    Only a parameter outside the nodes' namespaces can be such a level.
    """
    shared = {name: value for name, value in system.parameters.items() if not is_quality(name)}
    return SystemDescription(system.nodes, shared).all_parameters()


def is_quality(name: str) -> bool:
    """Tell whether a parameter outside the nodes' namespaces holds an expected quality level, which no node reads."""
    return name.rpartition("/")[2].startswith(QUALITY_PREFIX)
