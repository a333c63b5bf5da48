"""The parameters that dynamic_reconfigure makes of a package's `.cfg` files, read without running them."""

from __future__ import annotations

import ast
import contextlib
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ros_model.language.metamodel import Position

from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.node_facts import Configurations, FoundParameter, Remark, SourceError

_KINDS: dict[str, tuple[str, Any]] = {
    "double_t": ("Double", 0.0),
    "int_t": ("Integer", 0),
    "bool_t": ("Boolean", False),
    "str_t": ("String", ""),
}
"""By type: the kind of the parameter, and the default that it has where the file gives none."""
_PLACES = ("name", "paramtype", "level", "description", "default")
_CONSTANTS = {"pi": math.pi, "inf": math.inf}
_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_MAX_DEPTH = 16


def read_configurations(folder: Path) -> tuple[Configurations, tuple[Remark, ...]]:
    """Return the parameters of each file in a package's folder `cfg`, and what in them is not understood."""
    found: dict[str, tuple[FoundParameter, ...]] = {}
    remarks: list[Remark] = []
    for path in sorted((folder / "cfg").glob("*.cfg")):
        shown = f"cfg/{path.name}"
        try:
            code = read_source(path, shown).decode("utf-8", "replace")
            name, parameters, said = configuration(code, shown, path.stem)
        except SourceError as error:
            remarks.append(error.remark)
            continue
        found[name] = parameters
        remarks += said
    return found, tuple(remarks)


def configuration(code: str, shown: str, stem: str) -> tuple[str, tuple[FoundParameter, ...], tuple[Remark, ...]]:
    """Return what one file makes: the name of the class, its parameters, and what is not understood.

    Args:
        code: the content of the file.
        shown: its path for people.
        stem: its name without `.cfg`, which names the class where the file does not.

    Raises:
        SourceError: the file is no Python.
    """
    try:
        tree = ast.parse(code)
    except (SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None) or 1
        raise SourceError(Remark(Position(shown, line, 1), "not read: it is no Python 3")) from error
    constants = {
        target.id: node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    name, parameters, remarks = stem, [], []
    for call in _calls(tree):
        position = Position(shown, call.lineno, call.col_offset + 1)
        match call.func:
            case ast.Attribute(attr="generate") if len(call.args) > 2:
                name = str(_value(call.args[2], constants) or stem)
            case ast.Attribute(attr="add"):
                if parameter := _parameter(call, constants, position):
                    parameters.append(parameter)
                else:
                    remarks.append(Remark(position, "a parameter of dynamic_reconfigure whose name is not known"))
            case ast.Name(id=function) if any(_is_generator(one, constants) for one in call.args):
                remarks.append(Remark(position, f"{function} may add parameters of dynamic_reconfigure: look there"))
    return f"{name}Config", tuple(parameters), tuple(remarks)


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    found = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return iter(sorted(found, key=lambda node: (node.lineno, node.col_offset)))


def _is_generator(node: ast.expr, constants: Mapping[str, ast.expr]) -> bool:
    made = constants.get(node.id) if isinstance(node, ast.Name) else None
    return isinstance(made, ast.Call) and "ParameterGenerator" in ast.unparse(made.func)


def _parameter(call: ast.Call, constants: Mapping[str, ast.expr], position: Position) -> FoundParameter | None:
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
    return FoundParameter(name, default, position, kind)


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
