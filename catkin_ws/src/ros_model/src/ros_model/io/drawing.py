"""Draws graphs with graphviz, and a system as one: its components, the topics, services and actions between them."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from node_kit.io.output_files import write_file

from ros_model.errors import ModelError
from ros_model.language.metamodel import CONNECTION_OF, ENDS, ConnectionKind

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from ros_model.language.metamodel import Component, Port, RosSystem

FORMATS = ("svg", "png", "pdf", "dot")
"""Extensions of the files that can be drawn; `dot` is the text that graphviz draws from."""

_TIMEOUT = 300.0  # s; graphviz lays out the largest published system in a few seconds
_HEAD = """    rankdir=LR; fontname="Helvetica"; nodesep=0.2; ranksep=0.6; labelloc=t;
    node [fontname="Helvetica", fontsize=11]; edge [fontname="Helvetica", fontsize=9, arrowsize=0.7, color="#445566"];
"""
_COMPONENT = 'shape=ellipse, style=filled, fillcolor="#dbe9f6", color="#2b5d8c"'
_STYLES = {
    ConnectionKind.TOPIC: 'shape=box, style=filled, fillcolor="#fdf6e3", color="#b08a2e"',
    ConnectionKind.SERVICE: 'shape=box, style="filled,dashed", fillcolor="#eaf5ea", color="#3f7f3f"',
    ConnectionKind.ACTION: 'shape=box, style="filled,bold", fillcolor="#f7e6ef", color="#9c3f6f"',
}
_EDGES = {
    ConnectionKind.TOPIC: "",
    ConnectionKind.SERVICE: "dir=both, style=dashed",
    ConnectionKind.ACTION: "dir=both, style=bold",
}


@dataclass
class _Channel:
    """A topic, service or action, and the components at its ends."""

    kind: ConnectionKind
    name: str
    sources: dict[str, None] = field(default_factory=dict)
    targets: dict[str, None] = field(default_factory=dict)


def draw(text: str, path: Path) -> None:
    """Draw a graph, as graphviz reads it, into a file, in the format that its extension names.

    Raises:
        ModelError: the extension is none of FORMATS, graphviz is missing or fails, or the file can't be written.
    """
    form = path.suffix.removeprefix(".").lower()
    if form not in FORMATS:
        raise ModelError(f"{path}: graphs are drawn as {', '.join(f'.{known}' for known in FORMATS)}: give such a name")
    try:
        write_file(path, text if form == "dot" else _rendered(text, form))
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}: check the path") from error


def dot(system: RosSystem) -> str:
    """Return the graph of a system as graphviz reads it.

    Ports that no connection names meet, as ROS has it, where they have one name.
    """
    lines = [f"digraph {quoted(system.name)} {{", f"{_HEAD}    label={quoted(system.name)};"]
    stacked = {name for stack in system.stacks for name in stack.components}
    lines += [_node(component) for component in system.components if component.name not in stacked]
    for number, stack in enumerate(system.stacks):
        inside = (_node(component) for component in system.components if component.name in stack.components)
        lines += [f"    subgraph cluster_{number} {{ label={quoted(stack.name)}; style=dashed;", *inside, "    }"]
    for number, channel in enumerate(_channels(system)):
        lines.append(f"    t{number} [label={quoted(channel.name)}, {_STYLES[channel.kind]}];")
        style = f" [{_EDGES[channel.kind]}]" if _EDGES[channel.kind] else ""
        lines += [f"    {_component(source)} -> t{number}{style};" for source in channel.sources]
        lines += [f"    t{number} -> {_component(target)}{style};" for target in channel.targets]
    return "\n".join([*lines, "}"]) + "\n"


def _rendered(text: str, form: str) -> bytes:
    try:
        done = subprocess.run(
            ["dot", f"-T{form}"], input=text.encode(), capture_output=True, timeout=_TIMEOUT, check=False
        )
    except FileNotFoundError as error:
        raise ModelError(
            "graphviz is not installed: install Debian's package 'graphviz', or draw a .dot file"
        ) from error
    except subprocess.TimeoutExpired as error:
        raise ModelError(f"graphviz did not lay out the graph in {_TIMEOUT:.0f} s: draw a .dot file") from error
    if done.returncode or not done.stdout:
        raise ModelError(f"graphviz can't draw the graph: {done.stderr.decode(errors='replace').strip()[:200]}")
    return done.stdout


def _channels(system: RosSystem) -> list[_Channel]:
    """Return what is between components: the connections, then the free ports by their names."""
    found: list[_Channel] = []
    connected: set[tuple[str, str]] = set()
    for connection in system.connections:
        channel = _Channel(connection.kind, connection.name)
        for ends, side in ((connection.sources, channel.sources), (connection.targets, channel.targets)):
            for end in ends:
                connected.add((end.component, end.port))
                if system.component(end.component):
                    side[end.component] = None
        found.append(channel)
    free: dict[tuple[ConnectionKind, str], _Channel] = {}
    for component, port in _free_ports(system.components, connected):
        kind = CONNECTION_OF[port.kind]
        name = port.name.strip("/")
        channel = free.setdefault((kind, name), _Channel(kind, name))
        (channel.sources if port.kind is ENDS[kind][0] else channel.targets)[component.name] = None
    return [*found, *free.values()]


def _free_ports(components: Iterable[Component], connected: set[tuple[str, str]]) -> Iterable[tuple[Component, Port]]:
    for component in components:
        for port in component.ports:
            if (component.name, port.name) not in connected:
                yield component, port


def _node(component: Component) -> str:
    tooltip = f", tooltip={quoted(str(component.executable))}" if component.executable else ""
    return f"    {_component(component.name)} [label={quoted(component.graph_name)}, {_COMPONENT}{tooltip}];"


def _component(name: str) -> str:
    return quoted(f"component {name}")


def quoted(text: str) -> str:
    """Return a text as graphviz reads it, its line breaks included."""
    rows = ("".join(mark if mark.isprintable() else " " for mark in row) for row in text.split("\n"))
    return '"' + "\\n".join(row.replace("\\", "\\\\").replace('"', '\\"') for row in rows) + '"'
