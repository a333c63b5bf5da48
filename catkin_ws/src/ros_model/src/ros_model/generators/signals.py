"""The topics of a system that an observer could listen to, with their message types."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.generators.launch import topic_of
from ros_model.language.metamodel import PortKind
from ros_model.language.packages import Node

if TYPE_CHECKING:
    from ros_model.language.library import Library
    from ros_model.language.metamodel import Component, Port, RosSystem


@dataclass(frozen=True)
class Signal:
    """A topic and who publishes it; its type is "" where no model says it."""

    topic: str
    type: str
    component: str


def signals(system: RosSystem, library: Library) -> list[Signal]:
    """Return the topics that the components of a system publish, each once, in their order."""
    found: dict[str, Signal] = {}
    for component in system.components:
        for port in component.ports:
            if port.kind is PortKind.PUBLISHER:
                topic = topic_of(component, port, system)
                found.setdefault(topic, Signal(topic, _type(port, component, library), component.graph_name))
    return list(found.values())


def _type(port: Port, component: Component, library: Library) -> str:
    node = library.node(port.reference) if port.reference else None
    if port.reference is None or not isinstance(node, Node):
        return ""
    name = component.resolved(port.reference.name)
    declared = (p.type for p in node.ports if p.kind is port.kind and component.resolved(p.name) == name)
    return next(filter(None, declared), "")
