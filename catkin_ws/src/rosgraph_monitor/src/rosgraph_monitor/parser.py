"""The parser of systems under its published name, for observers that import it: thin over `ros_model`.

The result has the attributes that observers read: names and values are lists of one element, as pyparsing gave them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ros_model.io.models import read_system
from ros_model.language.metamodel import ConnectionKind, PortKind
from ros_model.language.system_reader import parse_system

if TYPE_CHECKING:
    from ros_model.language.metamodel import Component, RosSystem

_LISTS = {
    PortKind.PUBLISHER: ("publishers", "pub"),
    PortKind.SUBSCRIBER: ("subscribers", "sub"),
    PortKind.SERVICE_SERVER: ("services", "srv"),
    PortKind.SERVICE_CLIENT: ("srv_clients", "srv"),
    PortKind.ACTION_SERVER: ("action_servers", "action"),
    PortKind.ACTION_CLIENT: ("action_clients", "action"),
}
"""Attribute of an interface, and beginning of the attributes of its elements, for each kind of port."""


class Parsed:
    """A part of a parsed system. An attribute that is not there is empty."""

    def __init__(self, **attributes: Any) -> None:
        self.__dict__.update(attributes)

    def __getattr__(self, name: str) -> str:
        """Return the empty text, as pyparsing does for what a text lacks."""
        if name.startswith("__"):
            raise AttributeError(name)
        return ""


@dataclass
class ModelParser:
    """Parses a `.rossystem` model.

    Attributes:
        model: a path, or the text of a model.
        isFile: whether it is a path.
    """

    model: str
    isFile: bool = True  # noqa: N815 - the published name
    _result: Parsed = field(default_factory=Parsed, init=False, repr=False)

    def parse(self) -> Parsed:
        """Return the system: `system_name`, `interfaces`, `topic_connections`, `global_parameters`.

        Raises:
            ModelError: it can't be read.
        """
        system = read_system(Path(self.model)) if self.isFile else parse_system(self.model)
        self._result = _parsed(system)
        return self._result


RosSystemModelParser = ModelParser
"""The name of the class in `ros_model_parser.rossystem_parser`."""


def _parsed(system: RosSystem) -> Parsed:
    return Parsed(
        system_name=[system.name],
        interfaces=[_interface(component) for component in system.components],
        topic_connections=[
            Parsed(
                topic_name=[connection.name],
                **{"from": [str(end) for end in connection.sources], "to": [str(end) for end in connection.targets]},
            )
            for connection in system.connections
            if connection.kind is ConnectionKind.TOPIC
        ],
        global_parameters=[
            Parsed(
                param_name=[parameter.name],
                value_type=[parameter.type.kind if parameter.type else ""],
                param_value=[parameter.value],
            )
            for parameter in system.parameters
        ],
    )


def _interface(component: Component) -> Parsed:
    lists: dict[str, list[Parsed]] = {name: [] for name, _ in _LISTS.values()}
    for port in component.ports:
        name, begin = _LISTS[port.kind]
        path = [str(port.reference or port.name)]
        lists[name].append(Parsed(**{f"{begin}_name": [port.name], f"{begin}_path": path}))
    parameters = [
        Parsed(param_name=[parameter.name], param_path=[str(parameter.reference or "")], param_value=[parameter.value])
        for parameter in component.parameters
    ]
    return Parsed(interface_name=[component.name], parameters=parameters, **lists)
