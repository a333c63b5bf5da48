"""What a configuration consists of, and how two of them differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

QUALITY_PREFIX = "qa_"  # of the global parameters that hold a system's expected quality levels; no node reads them


@dataclass(frozen=True)
class NodeDescription:
    """One node as a launch file has it.

    Attributes:
        name: resolved name in the graph.
        namespace: the one that it is started in.
        package: of the executable.
        executable: its file name.
        args: command line arguments in one text.
        remaps: pairs (from, to).
        environment: pairs (variable, value) beside the launcher's own.
        cwd: `node`, a word that roslaunch knows, or None.
        output: `log` or `screen`.
        respawn: whether the launch file wants it started again even after a clean end.
        launch_prefix: words before the command, or None.
        parameters: private ones, by their name relative to the node's.
    """

    name: str
    namespace: str
    package: str
    executable: str
    args: str = ""
    remaps: tuple[tuple[str, str], ...] = ()
    environment: tuple[tuple[str, str], ...] = ()
    cwd: str | None = None
    output: str = "log"
    respawn: bool = False
    launch_prefix: str | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SystemDescription:
    """The nodes that a configuration starts, by resolved name, and the parameters that belong to none of them."""

    nodes: Mapping[str, NodeDescription] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def all_parameters(self) -> dict[str, Any]:
        """Return all parameters by their full names."""
        private = {
            f"{name}/{key}": value for name, node in self.nodes.items() for key, value in node.parameters.items()
        }
        return {**self.parameters, **private}


@dataclass(frozen=True)
class Difference:
    """What has to change on the way from one configuration to another; names are in the wanted one's order.

    Attributes:
        running: where the way begins.
        wanted: where it ends.
        starts: nodes that only the wanted configuration has.
        stops: nodes that only the running one has.
        replaced: nodes of both that differ in more than values of parameters.
        parameters: by node of both that is not replaced, the private parameters that get another value.
        shared: parameters of no node that get another value, by full name.
    """

    running: SystemDescription
    wanted: SystemDescription
    starts: tuple[str, ...]
    stops: tuple[str, ...]
    replaced: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, Any]]
    shared: Mapping[str, Any]

    @property
    def touches_nodes(self) -> bool:
        """Whether any node has to do something else than it does."""
        return bool(self.starts or self.stops or self.replaced or self.parameters)


def compare(running: SystemDescription, wanted: SystemDescription) -> Difference:
    """Return what has to change.

    A shared parameter that changes replaces every node, since any may have read it at its start; expected quality
    levels are read by none. A parameter that the wanted configuration leaves out replaces its node: the node must see
    what it finds at a start.
    """
    both = [name for name in wanted.nodes if name in running.nodes]
    shared = _changed(running.parameters, wanted.parameters)
    gone = set(running.parameters) - set(wanted.parameters)
    all_affected = any(not _is_quality(name) for name in (*shared, *gone))
    replaced = tuple(
        name for name in both if all_affected or _needs_new_process(running.nodes[name], wanted.nodes[name])
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
    )


def _needs_new_process(running: NodeDescription, wanted: NodeDescription) -> bool:
    lost = set(running.parameters) - set(wanted.parameters)
    return bool(lost) or replace(running, parameters={}) != replace(wanted, parameters={})


def _changed(running: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in wanted.items() if key not in running or not same_value(running[key], value)}


def same_value(one: Any, other: Any) -> bool:
    """Whether two values of a parameter are the same: 1 and 1.0 are, 1 and true are not."""
    if isinstance(one, bool) != isinstance(other, bool):
        return False
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same_value(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(same_value, one, other))
    return bool(one == other)


def _is_quality(name: str) -> bool:
    return name.rpartition("/")[2].startswith(QUALITY_PREFIX)
