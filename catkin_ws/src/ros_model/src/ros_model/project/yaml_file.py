"""YAML files as plain data, with the position of every value; nothing in them is executed or expanded without end."""

from __future__ import annotations

import math
from typing import Any

import yaml
from node_kit.yaml_text import YamlError, parse_marked_yaml

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position
from ros_model.project.schema_check import Keys


def parse_yaml(text: str, file: str) -> tuple[Any, dict[Keys, Position]]:
    """Return what a text says, and where each value stands: of an entry of a mapping, its key.

    Args:
        text: YAML.
        file: its name in positions and errors.

    Raises:
        ModelError: it is no YAML, has a key twice, or is nested or expanded too far.
    """
    try:
        value, places = parse_marked_yaml(text)
    except YamlError as error:
        raise ModelError(error.problem, Position(file, *error.place)) from error
    return value, {keys: Position(file, *place) for keys, place in places.items()}


def flow(value: Any) -> str:
    """Return a value on one line of YAML."""
    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=math.inf, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")


def with_entry(text: str, key: str, name: str | None, value: Any) -> str:
    """Return the text of a mapping with one more entry in the list or mapping of a key; the rest stays as it is.

    Args:
        text: YAML with a mapping at its top.
        key: whose list or mapping gets the entry; made if it is not there.
        name: of the entry in a mapping; None for a list.
        value: of the entry, written on one line.
    """
    entry = flow(value) if name is None else f"{flow(name)}: {flow(value)}"
    document = yaml.compose(text, yaml.SafeLoader)
    pairs = document.value if isinstance(document, yaml.MappingNode) else []
    node = next((item for found, item in pairs if found.value == key), None)
    if not isinstance(node, yaml.CollectionNode):
        opening = "" if text.endswith("\n") or not text else "\n"
        return f"{text}{opening}{key}:\n  {'- ' if name is None else ''}{entry}\n"
    if node.flow_style:
        at = node.end_mark.index - 1
        return text[:at].rstrip() + (", " if node.value else "") + entry + text[at:]
    at, indent = node.start_mark.index, " " * node.start_mark.column
    return f"{text[:at]}{'- ' if name is None else ''}{entry}\n{indent}{text[at:]}"
