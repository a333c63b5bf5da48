"""The values of C++ expressions that are constants: literals, numbers that are calculated, variables that hold them."""

from __future__ import annotations

import contextlib
import math
import operator
import re
import sys
from collections.abc import Callable
from typing import Any

from tree_sitter import Node

from ros_model_extraction.cpp.declarations import Declared, Place
from ros_model_extraction.cpp.program import MAX_DEPTH, Program
from ros_model_extraction.cpp.syntax import arguments_of, child_of, literal_text, text

_LIMITS = {
    "std::numeric_limits<double>::max": "DBL_MAX",
    "std::numeric_limits<float>::max": "FLT_MAX",
    "std::numeric_limits<int>::max": "INT_MAX",
}
_NUMBER = re.compile(r"-?(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_MAX_NUMBER = 400
"""Characters of a number: the smallest double has 326 of them, and Python takes no integer of more than 4,300."""
_MATHEMATICS = {
    "M_PI": math.pi,
    "M_PI_2": math.pi / 2,
    "M_PI_4": math.pi / 4,
    "DBL_MAX": sys.float_info.max,
    "FLT_MAX": 3.4028234663852886e38,
    "INT_MAX": 2**31 - 1,
}
_VARIABLES = ("identifier", "field_identifier", "field_expression", "qualified_identifier", "subscript_expression")
_OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
_TEXTS = ("std::string", "string")
_CASTS = ("static_cast", "double", "float", "int", "bool")


class Constants:
    """Finds the values of constants; None for what is none."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._known: dict[tuple[str, int, int], Any] = {}

    def of(self, node: Node | None, place: Place, depth: int = 0) -> Any:
        """Return the value of an expression; None where it is not known."""
        if node is None or depth > MAX_DEPTH:
            return None
        key = place.file.shown, node.start_byte, node.end_byte
        if key not in self._known:
            self._known[key] = None  # for a value that leads to itself
            self._known[key] = self._value(node, place, depth)
        return self._known[key]

    def _value(self, node: Node, place: Place, depth: int) -> Any:
        found: Any = None
        inner = node.named_children
        match node.type:
            case "string_literal":
                found = literal_text(text(node))
            case "concatenated_string":
                found = "".join(literal_text(text(child)) for child in inner)
            case "true" | "false":
                found = node.type == "true"
            case "number_literal":
                found = _number(text(node))
            case "unary_expression":
                found = self._negated(node, place, depth)
            case "call_expression" | "cast_expression":
                found = self._converted(node, place, depth)
            case "parenthesized_expression" | "initializer_list" if len(inner) == 1:
                found = self.of(inner[0], place, depth + 1)
            case "binary_expression":
                with contextlib.suppress(OverflowError):
                    found = self._calculated(node, place, depth)
            case kind if kind in _VARIABLES:
                found = self._variable(node, place, depth)
        return found

    def _negated(self, node: Node, place: Place, depth: int) -> Any:
        value = self.of(node.child_by_field_name("argument"), place, depth + 1)
        match text(node.child_by_field_name("operator")):
            case "-" if isinstance(value, int | float):
                return -value
            case "!" if isinstance(value, bool):
                return not value
        return value if text(node).startswith("+") else None

    def _converted(self, node: Node, place: Place, depth: int) -> Any:
        """Return the value of `std::string("x")`, `static_cast<double>(1)`, `(double) 1`, `std::pow(2, 3)`."""
        if node.type == "cast_expression":
            return self.of(node.child_by_field_name("value"), place, depth + 1)
        called = text(node.child_by_field_name("function"))
        if called in _LIMITS:
            return _MATHEMATICS[_LIMITS[called]]
        called = called.partition("<")[0]
        given = arguments_of(node)
        if called in _TEXTS and not given:
            return ""
        if called in (*_TEXTS, *_CASTS) and len(given) == 1:
            return self.of(given[0], place, depth + 1)
        if called.removeprefix("std::") == "pow" and len(given) == len("xy"):
            base, power = (self.of(one, place, depth + 1) for one in given)
            if isinstance(base, int | float) and isinstance(power, int | float):
                with contextlib.suppress(ArithmeticError, ValueError):
                    return math.pow(base, power)
        return None

    def _variable(self, node: Node, place: Place, depth: int) -> Any:
        """Return what a variable holds, where all that it is given is the same."""
        name = text(node)
        if name in _MATHEMATICS:
            return _MATHEMATICS[name]
        if (macro := self._program.macro(name)) is not None:
            return _number(macro)
        given = [d for d in self._program.declared(name, place) if d.values and d.values[0] != node]
        before = [d for d in given if _is_before(d, node, place)]
        if before:
            last = max(before, key=lambda d: d.values[0].start_byte)
            return self.of(last.values[0], last.place, depth + 1) if len(last.values) == 1 else None
        values = [self.of(d.values[0], d.place, depth + 1) if len(d.values) == 1 else None for d in given]
        for filled, at in self._program.filled(name, place):
            if isinstance(filled, Node) and filled != node:
                values.append(self.of(filled, at, depth + 1))
        return values[0] if values and all(value == values[0] for value in values) else None

    def _calculated(self, node: Node, place: Place, depth: int) -> Any:
        """Return what a sum or product is, as C++ has it: integers divide without a rest."""
        one, other = (self.of(child_of(node, side), place, depth + 1) for side in ("left", "right"))
        sign = text(node.child_by_field_name("operator"))
        if isinstance(one, str) and isinstance(other, str):
            return one + other if sign == "+" else None
        if not (isinstance(one, int | float) and isinstance(other, int | float)):
            return None
        if sign == "/" and isinstance(one, int) and isinstance(other, int):
            return int(one / other) if other else None
        return _OPERATIONS[sign](one, other) if sign in _OPERATIONS and (other or sign != "/") else None


def _is_before(declared: Declared, use: Node, place: Place) -> bool:
    """Return whether the function of a use has given the variable its value before."""
    function = declared.place.function
    is_same = function is not None and place.function is not None and function.id == place.function.id
    return is_same and declared.values[0].end_byte <= use.start_byte


def _number(shown: str) -> int | float | None:
    plain = shown.strip().strip("()").replace("'", "")
    if not plain.lower().startswith("0x"):
        plain = plain.rstrip("fFlLuU")
    if len(plain) > _MAX_NUMBER or not _NUMBER.fullmatch(plain):
        return None
    if plain.lower().startswith(("0x", "-0x")):
        return int(plain, 16)
    return float(plain) if re.search(r"[.eE]", plain) else int(plain)
