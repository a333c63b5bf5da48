"""Other executables that could stand in for a component: those whose interfaces are at least its own."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ros_model.language.metamodel import Component, Port, PortKind, Reference, RosSystem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from ros_model.language.library import Library
    from ros_model.language.packages import Node, PortDeclaration

_Interface = tuple[PortKind, str]
_GENERAL = ("tf", "tf_static", "rosout", "diagnostics", "clock")
"""Topics that tell nothing of what a node is for."""


@dataclass(frozen=True)
class Alternative:
    """An executable that offers and uses what a component does.

    Attributes:
        reference: its node.
        component: the component as this executable would be: ports keep their names in the graph.
    """

    reference: Reference
    component: Component

    @property
    def name(self) -> str:
        """How the command line names it: `package/executable`."""
        return f"{self.reference.package}/{self.reference.artifact}"


def alternatives(component: Component, library: Library) -> list[Alternative]:
    """Return the executables of the models that have the interfaces of a component, by their kinds and types.

    An executable that has several interfaces of a kind and type, none of which has the component's name, is left out:
    nothing tells which is which.
    """
    executable = component.executable
    own = library.interfaces(executable) if executable else None
    if executable is None or not own:
        return []
    wanted = [(port, kind) for port in component.ports if (kind := _typed(component, port, own))]
    found = []
    for reference, node in library.executables():
        if (reference.package, reference.artifact) == (executable.package, executable.artifact):
            continue
        ports = _matched(component, wanted, node, reference)
        if wanted and ports is not None:
            known = {declared.name.strip("~/") for declared in node.parameters}
            parameters = tuple(
                replace(parameter, reference=replace(reference, name=parameter.key))
                for parameter in component.parameters
                if parameter.key in known
            )
            found.append(Alternative(reference, replace(component, node=reference, ports=ports, parameters=parameters)))
    return found


def variant_of(alternative: Alternative, base: RosSystem) -> RosSystem:
    """Return the variant that runs an alternative in place of the component, connected as the component is."""
    name = alternative.component.name
    connections = tuple(
        connection
        for connection in base.connections
        if any(end.component == name for end in (*connection.sources, *connection.targets))
    )
    stem = re.sub(r"[^A-Za-z0-9_]+", "_", alternative.reference.artifact.partition(".")[0]).strip("_").lower()
    return RosSystem(f"{_stem(base.name)}_{stem}", (alternative.component,), connections)


def _stem(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_").lower() or "base"


def _typed(component: Component, port: Port, declared: Sequence[PortDeclaration]) -> _Interface | None:
    """Return kind and type of a port; None where it says nothing, or the models do not tell its type."""
    name = port.reference.name if port.reference else port.name
    if component.resolved(name).strip("/") in _GENERAL:
        return None
    types = (
        other.type
        for other in declared
        if other.kind is port.kind and component.resolved(other.name) == component.resolved(name)
    )
    kind = next(filter(None, types), "")
    return (port.kind, kind) if kind else None


def _matched(
    component: Component, wanted: Sequence[tuple[Port, _Interface]], node: Node, reference: Reference
) -> tuple[Port, ...] | None:
    """Return the ports of a component, each with the interface of another node; None if it lacks one."""
    left = [port for port in node.ports if port.type]
    ports: list[Port] = []
    counts = Counter(interface for _, interface in wanted)
    for port, interface in _named_first(component, wanted, left):
        fitting = [other for other in left if (other.kind, other.type) == interface]
        same = next((other for other in fitting if _alike(component, port, other)), None)
        if same is None and (len(fitting) != 1 or counts[interface] > 1):
            return None
        chosen = same or fitting[0]
        left.remove(chosen)
        ports.append(replace(port, reference=replace(reference, name=chosen.name)))
    order = [port.name for port, _ in wanted]
    return tuple(sorted(ports, key=lambda port: order.index(port.name)))


def _named_first(
    component: Component, wanted: Iterable[tuple[Port, _Interface]], left: Sequence[PortDeclaration]
) -> Iterator[tuple[Port, _Interface]]:
    """Yield the ports whose names the other node has, then the others."""
    pairs = list(wanted)
    yield from sorted(pairs, key=lambda pair: not any(_alike(component, pair[0], other) for other in left))


def _alike(component: Component, port: Port, other: PortDeclaration) -> bool:
    names = {port.name, port.reference.name if port.reference else port.name}
    resolved = {component.resolved(name) for name in names}
    return other.kind is port.kind and component.resolved(other.name) in resolved
