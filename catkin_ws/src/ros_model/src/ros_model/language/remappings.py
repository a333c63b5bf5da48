"""Remappings that belong to no port of a model: the languages have no words for them, so the header has a line."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from ros_model.language.metamodel import RosSystem

Remappings = tuple[tuple[str, str], ...]
"""Pairs of the name in a node's code and the name in the graph, as the node sees both."""

_KEPT = (
    "Names that are remapped, too, belong to no interface that is known; the node may use them later. Launch files "
    "that are made from this model remap them."
)
_LINE = re.compile(r"\s*Also remapped: ([^\s:]+): (.*)")
_PAIR = re.compile(r"([~/A-Za-z][A-Za-z0-9_/]*):=([~/A-Za-z][A-Za-z0-9_/]*)")


def remark(node: str, pairs: Iterable[tuple[str, str]]) -> str:
    """Return the line of a header that keeps remappings of a node, by its full name."""
    return f"Also remapped: {node}: {' '.join(f'{inside}:={outside}' for inside, outside in pairs)}"


def remark_lines(remappings: Mapping[str, Sequence[tuple[str, str]]]) -> Iterator[str]:
    """Yield the lines that keep remappings, by the nodes' full names, and what they mean; nothing if there is none."""
    lines = [remark(node, pairs) for node, pairs in sorted(remappings.items()) if pairs]
    yield from [*lines, _KEPT] if lines else ()


def remappings_of(header: str) -> dict[str, Remappings]:
    """Return the remappings that the lines of a header keep, by the node's name without its leading slash."""
    found: dict[str, list[tuple[str, str]]] = {}
    for line in header.splitlines():
        if match := _LINE.match(line):
            pairs = (_PAIR.fullmatch(word) for word in match[2].split())
            found.setdefault(match[1].strip("/"), []).extend((pair[1], pair[2]) for pair in pairs if pair)
    return {node: tuple(pairs) for node, pairs in found.items()}


def with_header(part: RosSystem, header: str, base: RosSystem) -> RosSystem:
    """Return a part of a system with a header, and in it the base's lines that keep remappings of the part's nodes."""
    nodes = {component.graph_name for component in part.components}
    lines = (remark(f"/{node}", pairs) for node, pairs in remappings_of(base.header).items() if node in nodes)
    return replace(part, header="\n".join([*([header] if header else []), *lines]))
