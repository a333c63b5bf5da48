"""Ranges of parameters that packages declare for dynamic_reconfigure, read from cfg/*.cfg without running it."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

import rospkg

from ros_model.errors import ModelError
from ros_model.io.files import read_text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_ADD = ("name", "paramtype", "level", "description", "default", "min", "max", "edit_method")
"""Arguments of `ParameterGenerator.add`, in their order."""


def ranges_of(package: str) -> dict[str, str]:
    """Return the range or the choices of each parameter, in words; of a package that is not here, nothing."""
    from pathlib import Path  # here alone at run time

    try:
        folder = Path(rospkg.RosPack().get_path(package)) / "cfg"
    except rospkg.ResourceNotFound:
        return {}
    found: dict[str, str] = {}
    for path in sorted(folder.glob("*.cfg")):
        found |= {name: f"{told} ({package}/cfg/{path.name})" for name, told in _ranges(path)}
    return found


def _ranges(path: Path) -> Iterator[tuple[str, str]]:
    try:
        module = ast.parse(read_text(path))
    except (ModelError, SyntaxError, ValueError, RecursionError, MemoryError):
        return
    choices = dict(_choices(module))
    for node in ast.walk(module):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "add"):
            continue
        given = dict(zip(_ADD, node.args, strict=False)) | {word.arg: word.value for word in node.keywords if word.arg}
        name, low, high = (_constant(given.get(key)) for key in ("name", "min", "max"))
        method = given.get("edit_method")
        if isinstance(name, str) and isinstance(method, ast.Name) and method.id in choices:
            yield name, f"one of {', '.join(choices[method.id])}"
        elif isinstance(name, str) and low is not None and high is not None:
            yield name, f"{low} to {high}"


def _choices(module: ast.Module) -> Iterator[tuple[str, list[str]]]:
    """Yield the variables that hold an enumeration, with the values of its constants."""
    for node in ast.walk(module):
        match node:
            case ast.Assign([ast.Name(variable)], ast.Call(ast.Attribute(_, "enum"), [ast.List(constants), *_])):
                values = [_constant(c.args[2]) for c in constants if isinstance(c, ast.Call) and len(c.args) > 2]
                if values and None not in values:
                    yield variable, [str(value) for value in values]


def _constant(node: ast.expr | None) -> object:
    """Return a literal; None for an expression."""
    try:
        return None if node is None else ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError):
        return None
