"""YAML files as plain data, with the position of every value; nothing in them is executed or expanded without end."""

from __future__ import annotations

import math
from typing import Any

import yaml

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position
from ros_model.project.schema_check import Keys

MAX_SIZE = 4_000_000
"""Characters of the largest file that is read."""
MAX_VALUES = 200_000
"""Values of the largest file that is read, aliases counted as often as they stand."""


def parse_yaml(text: str, file: str) -> tuple[Any, dict[Keys, Position]]:
    """Return what a text says, and where each value stands: of an entry of a mapping, its key.

    Args:
        text: YAML.
        file: its name in positions and errors.

    Raises:
        ModelError: it is no YAML, has a key twice, or is nested or expanded too far.
    """
    if len(text) > MAX_SIZE:
        raise ModelError(f"{len(text)} characters are too many (at most {MAX_SIZE})", Position(file, 1, 1))
    places: dict[Keys, Position] = {}
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None, {}
        _walk(node, (), file, places)
        return loader.construct_document(node), places
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = Position(file, mark.line + 1, mark.column + 1) if mark else Position(file, 1, 1)
        what = getattr(error, "problem", None) or getattr(error, "reason", None) or "is no YAML"
        raise ModelError(f"{what}: correct the YAML", where) from error
    except RecursionError:
        raise ModelError("is nested too deep: correct the YAML", Position(file, 1, 1)) from None
    except ValueError as error:  # a date or a number that can't be
        raise ModelError(f"{error}: correct the YAML", Position(file, 1, 1)) from error


def _walk(node: yaml.Node, keys: Keys, file: str, places: dict[Keys, Position]) -> None:
    places.setdefault(keys, _position(node, file))
    if len(places) > MAX_VALUES:
        raise ModelError(f"holds more than {MAX_VALUES} values: correct its aliases", _position(node, file))
    if isinstance(node, yaml.SequenceNode):
        for number, item in enumerate(node.value):
            _walk(item, (*keys, number), file, places)
    elif isinstance(node, yaml.MappingNode):
        for key, item in node.value:
            inner = (*keys, str(key.value))
            if inner in places and key.tag != "tag:yaml.org,2002:merge":
                raise ModelError(f"the key {key.value!r} stands twice: take one out", _position(key, file))
            places[inner] = _position(key, file)
            _walk(item, inner, file, places)


def _position(node: yaml.Node, file: str) -> Position:
    return Position(file, node.start_mark.line + 1, node.start_mark.column + 1)


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
