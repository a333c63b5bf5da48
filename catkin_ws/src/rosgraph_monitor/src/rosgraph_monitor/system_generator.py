"""The generator of system models under its published name, for observers that import it: thin over `ros_model`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ros_model.language.metamodel import Component, Port, PortKind, Reference, RosParameter, RosSystem, SystemParameter
from ros_model.language.system_writer import write_system

if TYPE_CHECKING:
    from collections.abc import Mapping

_GLOBAL = "global_parameters"
_KINDS = {
    "publishers": PortKind.PUBLISHER,
    "subscribers": PortKind.SUBSCRIBER,
    "service_servers": PortKind.SERVICE_SERVER,
    "service_clients": PortKind.SERVICE_CLIENT,
    "action_servers": PortKind.ACTION_SERVER,
    "action_clients": PortKind.ACTION_CLIENT,
}
_PLACE = Reference("none", "none", "none")
"""Stands in references: the observer's snapshot of the graph tells no packages."""


class RosSystemModelGenerator:
    """Writes models of a snapshot of the graph, as the published observers take one."""

    def __init__(self, name: str = "") -> None:
        """Name the system."""
        self._name = name

    def create_ros_system_model_list(self, components: Mapping[str, Mapping[str, Any]]) -> tuple[bool, str]:
        """Return True and the text of the system's model.

        Args:
            components: node -> kind of interface -> name -> type; under `parameters`, name -> (value, type). The key
                `global_parameters` has the parameters of no node.

        Raises:
            ModelError: a value has no notation.
        """
        system = RosSystem(
            self._name,
            tuple(_component(name, content) for name, content in components.items() if name != _GLOBAL),
            parameters=tuple(
                SystemParameter(name, value=value) for name, (value, *_) in components.get(_GLOBAL, {}).items()
            ),
        )
        return True, write_system(system)


def _component(name: str, content: Mapping[str, Any]) -> Component:
    ports = tuple(
        Port(port, kind, Reference(_PLACE.package, _PLACE.artifact, _PLACE.node, port))
        for section, kind in _KINDS.items()
        for port in content.get(section, {})
    )
    parameters = tuple(
        RosParameter(parameter, Reference(_PLACE.package, _PLACE.artifact, _PLACE.node, parameter), value)
        for parameter, (value, *_) in content.get("parameters", {}).items()
    )
    return Component(name, ports=ports, parameters=parameters)
