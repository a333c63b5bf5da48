"""The nodes and parameters of a configuration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

QUALITY_PREFIX = "qa_"  # of the global parameters that hold a system's expected quality levels; no node reads them


@dataclass(frozen=True)
class NodeDescription:
    """A node in a launch file.

    Attributes:
        name: full name in the ROS graph.
        namespace: namespace in which it is started.
        package: package of its executable.
        executable: file name of its executable.
        args: its command line arguments, in one text.
        remaps: pairs (from, to).
        environment: pairs (variable, value) that are added to the launcher's environment.
        cwd: `node`, `ROS_HOME`, `cwd` or None, as in roslaunch.
        output: `log` or `screen`.
        respawn: whether it is started again even after it ended with status 0.
        respawn_delay: the least time from its end to its next start, s, wall.
        required: whether its end, with whatever status, fails the configuration at once.
        launch_prefix: words before its command, or None.
        machine: address of the host that runs it; empty: the launcher's own host.
        parameters: its private parameters, by their names relative to the node's.
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
    respawn_delay: float = 0.0
    required: bool = False
    launch_prefix: str | None = None
    machine: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def differs_in(self, other: NodeDescription) -> tuple[str, ...]:
        """Return the names of the attributes, without parameters, in which another node differs."""
        names = (attribute.name for attribute in fields(self) if attribute.name != "parameters")
        return tuple(name for name in names if getattr(self, name) != getattr(other, name))


def owner_of(name: str, nodes: Iterable[str]) -> str:
    """Return the node in whose namespace a name is, the innermost one of several; empty: there is none."""
    return max((node for node in nodes if name.startswith(f"{node}/")), key=len, default="")


@dataclass(frozen=True)
class SystemDescription:
    """What a configuration starts.

    Attributes:
        nodes: its nodes, by full name.
        parameters: the parameters outside the namespaces of its nodes, by full name.
    """

    nodes: Mapping[str, NodeDescription] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def all_parameters(self) -> dict[str, Any]:
        """Return all parameters by their full names."""
        private = {
            f"{name}/{key}": value for name, node in self.nodes.items() for key, value in node.parameters.items()
        }
        return {**self.parameters, **private}
