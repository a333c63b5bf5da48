"""YAML as plain data: it never runs code, and what is nested or expanded too far is refused in one line."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:  # Python 3.8 can't evaluate them
    Keys = tuple[str | int, ...]
    """Keys of mappings and numbers in lists that lead to a value."""
    Place = tuple[int, int]
    """Line and column, counted from 1."""

MAX_SIZE = 4_000_000
"""Characters of the largest text that is read."""
MAX_VALUES = 200_000
"""Values of the largest text that is read, aliases counted as often as they stand."""
MAX_DEPTH = 200
"""Brackets and braces inside each other. PyYAML looks at all open ones for every token: 1,000 take it seconds."""
MAX_DIGITS = 1100
"""Characters of the longest number: the largest one that is used has 1024 digits in base 2. The time that PyYAML takes
grows with the square of the length for base 60 (`1:59:59`), as Python 3.8's does for base 10."""

_MERGE = "tag:yaml.org,2002:merge"
_BAD_SCALARS = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What PyYAML's constructors raise beside YAMLError, for dates that do not exist, `!!bool x` and the like."""


class YamlError(ValueError):
    """A text is no YAML that can be used; `problem` says why, with the remedy, and `place` says where."""

    def __init__(self, problem: str, place: Place = (1, 1)) -> None:
        super().__init__(f"{place[0]}:{place[1]}: {problem}")
        self.problem = problem
        self.place = place


def parse_yaml(text: str) -> Any:
    """Return what a text says. A key that stands twice has its last value, as roslaunch reads it.

    Raises:
        YamlError: it is no YAML, or is nested or expanded too far.
    """
    return _parse(text, {}, is_unique=False)


def parse_marked_yaml(text: str) -> tuple[Any, dict[Keys, Place]]:
    """Return what a text says, and where each value stands: for an entry of a mapping, where its key stands.

    Raises:
        YamlError: as `parse_yaml`, or a key stands twice.
    """
    places: dict[Keys, Place] = {}
    return _parse(text, places, is_unique=True), places


def explained(error: yaml.YAMLError) -> YamlError:
    """Return what PyYAML says of a text that is no YAML, with the remedy and the place."""
    mark = getattr(error, "problem_mark", None)
    place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "is no YAML"
    return YamlError(f"{what}: correct the YAML", place)


def _parse(text: str, places: dict[Keys, Place], is_unique: bool) -> Any:
    if len(text) > MAX_SIZE:
        raise YamlError(f"{len(text)} characters are too many (at most {MAX_SIZE})")
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _check_size(node)
        if is_unique:
            _walk(node, (), places)
        return loader.construct_document(node)
    except YamlError:
        raise
    except yaml.YAMLError as error:
        raise explained(error) from error
    except RecursionError:
        raise YamlError("is nested too deep: correct the YAML") from None
    except _BAD_SCALARS as error:
        raise YamlError(f"a value is not of its type ({error}): correct the YAML") from error


class _Loader(yaml.SafeLoader):
    """A loader that gives up where brackets are nested too deep, or a number is larger than any that is used.

    It knows the types of PyYAML only: rosparam teaches the process's SafeLoader angles, and evaluates them as Python.
    """

    yaml_constructors = dict(yaml.constructor.SafeConstructor.yaml_constructors)
    yaml_implicit_resolvers = {key: list(all_) for key, all_ in yaml.resolver.Resolver.yaml_implicit_resolvers.items()}

    def fetch_flow_collection_start(self, token: Any) -> None:
        """Take an opening bracket or brace."""
        if self.flow_level >= MAX_DEPTH:
            raise RecursionError
        super().fetch_flow_collection_start(token)


def _construct_int(loader: _Loader, node: yaml.ScalarNode) -> int:
    _check_length(loader, node)
    value: int = loader.construct_yaml_int(node)
    if abs(value) > sys.float_info.max:
        raise YamlError("a number is too large: correct it", _place(node))
    return value


def _construct_float(loader: _Loader, node: yaml.ScalarNode) -> float:
    _check_length(loader, node)
    value: float = loader.construct_yaml_float(node)
    return value


def _check_length(loader: _Loader, node: yaml.ScalarNode) -> None:
    length = len(loader.construct_scalar(node))
    if length > MAX_DIGITS:
        raise YamlError(f"a number has {length} characters (at most {MAX_DIGITS}): correct it", _place(node))


_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)


def _check_size(root: yaml.Node) -> None:
    """Check that a document has no more values than may be, however often its aliases repeat them.

    Raises:
        YamlError: it has more.
        RecursionError: it has circles.
    """
    counts: dict[int, int] = {}  # values of a node and of all in it, by the node's id; 0 while they are counted

    def count(node: yaml.Node) -> int:
        known = counts.get(id(node))
        if known == 0:
            raise RecursionError  # an alias stands within what it repeats
        if known:
            return known
        counts[id(node)] = 0
        total = 1
        for item in node.value if isinstance(node, yaml.CollectionNode) else ():
            total += count(item) if isinstance(item, yaml.Node) else count(item[0]) - 1 + count(item[1])
            if total > MAX_VALUES:
                raise YamlError(f"holds more than {MAX_VALUES} values: correct its aliases", _place(node))
        counts[id(node)] = total
        return total

    count(root)


def _walk(node: yaml.Node, keys: Keys, places: dict[Keys, Place]) -> None:
    """Note where each value stands.

    Raises:
        YamlError: a key stands twice.
    """
    places.setdefault(keys, _place(node))
    if isinstance(node, yaml.SequenceNode):
        for number, item in enumerate(node.value):
            _walk(item, (*keys, number), places)
    elif isinstance(node, yaml.MappingNode):
        for key, item in node.value:
            inner = (*keys, str(key.value))
            if inner in places and key.tag != _MERGE:
                raise YamlError(f"the key {key.value!r} stands twice: take one out", _place(key))
            places[inner] = _place(key)
            _walk(item, inner, places)


def _place(node: yaml.Node) -> Place:
    return node.start_mark.line + 1, node.start_mark.column + 1
