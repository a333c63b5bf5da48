"""The parameters that a `.cfg` file of dynamic_reconfigure makes, read without running it."""

from __future__ import annotations

import ast
import contextlib
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

_KINDS: dict[str, tuple[str, Any]] = {
    "double_t": ("Double", 0.0),
    "int_t": ("Integer", 0),
    "bool_t": ("Boolean", False),
    "str_t": ("String", ""),
}
"""By type: the kind of the parameter, and the default that it has where the file gives none."""
_PLACES = ("name", "paramtype", "level", "description", "default", "min", "max", "edit_method")
"""Arguments of `ParameterGenerator.add`, in their order."""
_CONSTANTS = {"pi": math.pi, "inf": math.inf}
_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_MAX_DEPTH = 16

Place = tuple[int, int]
"""Line and column, both from 1."""


class ReconfigureError(ValueError):
    """The text is no Python 3; `line` is where."""

    def __init__(self, line: int) -> None:
        super().__init__("it is no Python 3")
        self.line = line


@dataclass(frozen=True)
class ReconfigureParameter:
    """A parameter of dynamic_reconfigure.

    Attributes:
        name: its name.
        kind: Double, Integer, Boolean or String.
        default: None where it is not known.
        range: the least and the greatest value; None where the file does not give both.
        choices: the values of its enumeration.
        place: where it is added.
    """

    name: str
    kind: str
    default: Any
    range: tuple[Any, Any] | None
    choices: tuple[Any, ...]
    place: Place


@dataclass(frozen=True)
class ReconfigureFile:
    """What a file makes.

    Attributes:
        name: that of the class, without `Config`; "" where the file does not name it.
        parameters: those whose names are known.
        unknown: what is not understood, and where.
    """

    name: str
    parameters: tuple[ReconfigureParameter, ...]
    unknown: tuple[tuple[Place, str], ...]


def parse_reconfigure(code: str) -> ReconfigureFile:
    """Return what the text of a `.cfg` file makes.

    Raises:
        ReconfigureError: it is no Python 3.
    """
    try:
        tree = ast.parse(code)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ReconfigureError(getattr(error, "lineno", None) or 1) from error
    constants = {
        target.id: node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    name, parameters, unknown = "", [], []
    for call in _calls(tree):
        place = call.lineno, call.col_offset + 1
        match call.func:
            case ast.Attribute(attr="generate") if len(call.args) > 2:
                name = str(_value(call.args[2], constants) or "")
            case ast.Attribute(attr="add"):
                if parameter := _parameter(call, constants, place):
                    parameters.append(parameter)
                else:
                    unknown.append((place, "a parameter of dynamic_reconfigure whose name is not known"))
            case ast.Name(id=function) if any(_is_generator(one, constants) for one in call.args):
                unknown.append((place, f"{function} may add parameters of dynamic_reconfigure: look there"))
    return ReconfigureFile(name, tuple(parameters), tuple(unknown))


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    found = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return iter(sorted(found, key=lambda node: (node.lineno, node.col_offset)))


def _is_generator(node: ast.expr, constants: Mapping[str, ast.expr]) -> bool:
    made = constants.get(node.id) if isinstance(node, ast.Name) else None
    return isinstance(made, ast.Call) and "ParameterGenerator" in ast.unparse(made.func)


def _parameter(call: ast.Call, constants: Mapping[str, ast.expr], place: Place) -> ReconfigureParameter | None:
    given = dict(zip(_PLACES, call.args, strict=False)) | {k.arg: k.value for k in call.keywords if k.arg}
    name = _value(given.get("name"), constants)
    declared = ast.unparse(given["paramtype"]).rpartition(".")[2] if "paramtype" in given else ""
    if not isinstance(name, str) or declared not in _KINDS:
        return None
    kind, default = _KINDS[declared]
    if "default" in given:
        default = _value(given["default"], constants)
        if kind == "Boolean" and default is not None:
            default = bool(default)
    low, high = (_value(given.get(key), constants) for key in ("min", "max"))
    limits = None if low is None or high is None else (low, high)
    return ReconfigureParameter(name, kind, default, limits, _choices(given.get("edit_method"), constants), place)


def _choices(node: ast.expr | None, constants: Mapping[str, ast.expr]) -> tuple[Any, ...]:
    """Return the values of an enumeration; nothing where one is not known."""
    match constants.get(node.id) if isinstance(node, ast.Name) else node:
        case ast.Call(func=ast.Attribute(attr="enum"), args=[ast.List(elts=members), *_]):
            values = tuple(_value(member, constants) for member in members)
            return () if None in values else values
    return ()


def _value(node: ast.expr | None, constants: Mapping[str, ast.expr], depth: int = 0) -> Any:
    """Return the value of a constant or of numbers that are calculated; None for what is none."""
    found: Any = None
    match node if depth <= _MAX_DEPTH else None:
        case ast.Constant(value=value):
            found = value
        case ast.Name(id=name) if name in constants:
            found = _value(constants[name], constants, depth + 1)
        case ast.Name(id=name) | ast.Attribute(value=ast.Name(id="math"), attr=name):
            found = _CONSTANTS.get(name)
        case ast.Call(func=ast.Attribute(attr="const"), args=[_, _, value, *_]):  # one of an enumeration
            found = _value(value, constants, depth + 1)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            value = _value(inner, constants, depth + 1)
            found = -value if isinstance(value, int | float) else None
        case ast.BinOp(left=left, op=operation, right=right):
            one, other = (_value(side, constants, depth + 1) for side in (left, right))
            known = _OPERATIONS.get(type(operation))
            if isinstance(one, str) and isinstance(other, str):
                found = one + other if known is operator.add else None
            elif known and isinstance(one, int | float) and isinstance(other, int | float):
                with contextlib.suppress(ArithmeticError):
                    found = known(one, other)
    return found
