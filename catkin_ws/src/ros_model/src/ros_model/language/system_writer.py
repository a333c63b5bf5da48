"""Writes `.rossystem` files in one canonical form; what is written reads back as an equal model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.language.metamodel import Component, Connection, ConnectionKind, PortKind, PortPath
from ros_model.language.notation import (
    block,
    comments,
    indented,
    name_text,
    port_sections,
    quoted,
    section,
    typed_fields,
    value_text,
)

if TYPE_CHECKING:
    from ros_model.language.metamodel import ComponentStack, Port, Reference, RosParameter, RosSystem, SystemParameter

_PORT_WORDS = {
    PortKind.PUBLISHER: ("RosPublishers", "RosPublisher", "RefPublisher"),
    PortKind.SUBSCRIBER: ("RosSubscribers", "RosSubscriber", "RefSubscriber"),
    PortKind.SERVICE_SERVER: ("RosSrvServers", "RosServiceServer", "RefServer"),
    PortKind.SERVICE_CLIENT: ("RosSrvClients", "RosServiceClient", "RefClient"),
    PortKind.ACTION_SERVER: ("RosActionServers", "RosActionServer", "RefServer"),
    PortKind.ACTION_CLIENT: ("RosActionClients", "RosActionClient", "RefClient"),
}
_CONNECTION_WORDS = {
    ConnectionKind.TOPIC: ("TopicConnections", "TopicConnection"),
    ConnectionKind.SERVICE: ("ServiceConnections", "ServiceConnection"),
    ConnectionKind.ACTION: ("ActionConnections", "ActionConnection"),
}


def write_system(system: RosSystem) -> str:
    """Return the text of a `.rossystem` file.

    Ports and connections are written by kind, in the order of PortKind and ConnectionKind.

    Raises:
        ModelError: a value has no notation in the language (infinite, not a number).
    """
    stacked = {name for stack in system.stacks for name in stack.components}
    free = [component for component in system.components if component.name not in stacked]
    lines = [f"Name {quoted(system.name)}"]
    lines += section("RosComponents", "()", map(_component, free))
    lines += section("RosComponentStacks", "()", (_stack(stack, system) for stack in system.stacks))
    for kind, (word, element) in _CONNECTION_WORDS.items():
        found = ([_connection(element, connection)] for connection in system.connections if connection.kind is kind)
        lines += section(word, "{}", found)
    lines += section("Parameters", "{}", ([f"Parameter {_parameter(parameter)}"] for parameter in system.parameters))
    return "\n".join([*comments(system.header), "RosSystem {", *indented(lines), "}"]) + "\n"


def _stack(stack: ComponentStack, system: RosSystem) -> list[str]:
    components = [component for component in system.components if component.name in stack.components]
    lines = [f"name {name_text(stack.name)}"]
    qualities = ([f"QualityAttribute {_parameter(quality)}"] for quality in stack.quality_attributes)
    lines += section("QualityAttributes", "{}", qualities)
    lines += section("RosComponents", "()", map(_component, components))
    return ["ComponentStack {", *indented(lines), "}"]


def _component(component: Component) -> list[str]:
    lines = [f"name {name_text(component.name)}"]
    if component.namespace is not None:
        lines.append(f"NameSpace {name_text(component.namespace)}")
    if component.node:
        lines.append(f"FromRosNode {quoted(str(component.node))}")
    lines += port_sections(_PORT_WORDS, component.ports, _port)
    lines += section("RosParameters", "{}", ([_ros_parameter(parameter)] for parameter in component.parameters))
    return ["ComponentInterface {", *indented(lines), "}"]


def _port(word: str, reference_word: str, port: Port) -> str:
    fields = _fields(port.namespace, reference_word, port.reference)
    return f"{word} {quoted(port.name)} {block(fields)}"


def _ros_parameter(parameter: RosParameter) -> str:
    fields = _fields(parameter.namespace, "RefParameter", parameter.reference)
    if parameter.value is not None:
        fields.append(f"value {value_text(parameter.value, parameter.position)}")
    return f"RosParameter {quoted(parameter.name)} {block(fields)}"


def _fields(namespace: str | None, word: str, reference: Reference | None) -> list[str]:
    fields = [] if namespace is None else [f"ns {name_text(namespace)}"]
    if reference:
        fields.append(f"{word} {quoted(str(reference))}")
    return fields


def _connection(word: str, connection: Connection) -> str:
    """Return a connection as the grammar has it: ends in parentheses, but a lone client and an action's lone server."""
    sources = _ends(connection.sources, bare=connection.kind is ConnectionKind.ACTION)
    targets = _ends(connection.targets, bare=connection.kind is not ConnectionKind.TOPIC)
    return f"{word} {quoted(connection.name)} {{ From {sources} To {targets} }}"


def _ends(ends: tuple[PortPath, ...], *, bare: bool) -> str:
    texts = [quoted(str(end)) for end in ends]
    return texts[0] if bare and len(texts) == 1 else f"( {', '.join(texts)} )"


def _parameter(parameter: SystemParameter) -> str:
    fields = [f"name {name_text(parameter.name)}"]
    if parameter.namespace is not None:
        fields.append(f"NameSpace {name_text(parameter.namespace)}")
    return block([*fields, *typed_fields(parameter)])
