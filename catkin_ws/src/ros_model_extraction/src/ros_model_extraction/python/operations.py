"""Results of operators: sums, joined texts, patterns filled in."""

from __future__ import annotations

import ast

from ros_model_extraction.python.known_functions import is_costly, plain
from ros_model_extraction.python.values import Const, Hole, Items, Text, Unknown, Value, joined, text_of


def operated(node: ast.BinOp, left: Value, right: Value) -> Value:
    """Return what an operation makes of two values; a text may have holes."""
    match node.op, left, right:
        case ast.Add(), Items(one), Items(two):
            return Items((*one, *two))
        case ast.Add(), _, _ if _is_textual(left) or _is_textual(right):
            texts = [
                text_of(value) if not isinstance(value, Unknown) else Text((Hole(side),))
                for value, side in ((left, node.left), (right, node.right))
            ]
            known = [text for text in texts if text]
            return joined(known) if len(known) == 2 else Unknown(node)
        case ast.Mod(), Const(str(pattern)), Const() | Items() if not is_costly(pattern, [right]):
            try:
                raw = plain(right)
                return Const(pattern % (tuple(raw) if isinstance(raw, list) else raw))
            except (ArithmeticError, ValueError, TypeError):
                return Unknown(node)
        case _, Const(one), Const(two) if is_number(one) and is_number(two):
            return _number(node, one, two)
    return Unknown(node)


def _number(node: ast.BinOp, one: float, two: float) -> Value:
    try:
        match node.op:
            case ast.Add():
                return Const(one + two)
            case ast.Sub():
                return Const(one - two)
            case ast.Mult():
                return Const(one * two)
            case ast.Div():
                return Const(one / two)
    except (ArithmeticError, ValueError):
        pass
    return Unknown(node)


def is_number(value: object) -> bool:
    """Return whether a plain value is a number, which True and False are not."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_textual(value: Value) -> bool:
    return isinstance(value, Text) or (isinstance(value, Const) and isinstance(value.value, str))
