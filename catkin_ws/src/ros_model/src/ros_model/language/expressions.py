"""Expressions of launch files and of angles, evaluated without Python's `eval`: they can only compute.

Values are numbers, texts, truth values, None, and lists, tuples, sets and dicts of these. simpleeval evaluates; what it
would allow beyond that, or let grow, is refused here.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import simpleeval

MAX_LENGTH = 4_000
"""Characters of the longest expression."""
MAX_SIZE = 100_000
"""Characters, values and bytes of integers that a result may have, those of all parts together."""
MAX_STEPS = 20_000
"""Steps of an evaluation: one for each part that is evaluated, and one more for each 100 of its size."""
_MAX_BITS = 10_000  # of integers; Python writes 14,285 at most
_MAX_FACTORIAL = 1_000

_TEXT_METHODS = frozenset(
    [
        *("capitalize", "casefold", "center", "count", "endswith", "find", "index", "isalnum", "isalpha", "isdecimal"),
        *("isdigit", "isidentifier", "islower", "isnumeric", "isspace", "istitle", "isupper", "join", "ljust", "lower"),
        *("lstrip", "partition", "removeprefix", "removesuffix", "replace", "rfind", "rindex", "rjust", "rpartition"),
        *("rsplit", "rstrip", "split", "splitlines", "startswith", "strip", "swapcase", "title", "upper", "zfill"),
    ]
)
_METHODS: Mapping[type, frozenset[str]] = {
    str: _TEXT_METHODS,
    list: frozenset(["count", "index"]),
    tuple: frozenset(["count", "index"]),
    dict: frozenset(["get", "items", "keys", "values"]),
}
"""The methods that change nothing, by the type of their object."""
_SCALARS = (bool, int, float, complex, str, type(None))
_COLLECTIONS: tuple[type[Iterable[Any]], ...] = (list, tuple, set, type({}.keys()), type({}.values()), type({}.items()))


class ExpressionError(Exception):
    """An expression asks for more than computing, or for too much of it; the text says for what, in one line."""


def evaluate(text: str, lookup: Callable[[str], Any]) -> Any:
    """Return the value of an expression.

    Args:
        text: it, as Python writes it.
        lookup: what a name stands for, a value or a function; raises KeyError of an unknown one.

    Raises:
        ExpressionError: it holds what is refused, or is too long.
        Exception: what Python's `eval` would raise of it, such as NameError, SyntaxError and ZeroDivisionError; or
            what one of the functions raises.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"it has {len(text)} characters (at most {MAX_LENGTH})")
    try:
        return _Evaluator(lookup).value(ast.parse(text.lstrip(" \t"), mode="eval").body)
    except (RecursionError, MemoryError) as error:
        raise ExpressionError("it is nested too deep") from error
    except simpleeval.InvalidExpression as error:
        raise ExpressionError(" ".join(str(error).split())) from error


def _limited(function: Callable[..., Any], *values: Any) -> Any:
    if any(isinstance(value, int) and value > _MAX_FACTORIAL for value in values):
        raise ExpressionError(f"{function.__name__} of more than {_MAX_FACTORIAL} is too large")
    return function(*values)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{function.__name__: function for function in (abs, bool, dict, float, int, len, list, max, min, str)},
    "map": lambda function, *values: list(map(function, *values)),
}
"""Functions of Python that an expression may call."""
MATHEMATICS: Mapping[str, Any] = {
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
    **{function.__name__: functools.partial(_limited, function) for function in (math.comb, math.factorial, math.perm)},
}
"""The functions and constants of the module math; those that could take for ever have limits."""


class _Names:
    """What names stand for; raises what Python does of an unknown one."""

    def __init__(self, lookup: Callable[[str], Any]) -> None:
        self._lookup = lookup

    def __getitem__(self, name: str) -> Any:
        try:
            return self._lookup(name)
        except KeyError:
            raise NameError(f"name '{name}' is not defined") from None


class _Evaluator(simpleeval.EvalWithCompoundTypes):
    """Evaluates one expression."""

    def __init__(self, lookup: Callable[[str], Any]) -> None:
        super().__init__(operators=_OPERATORS)
        self.names = self.functions = _Names(lookup)
        self._left = MAX_STEPS
        self._max_count = 0  # of simpleeval, for comprehensions
        self.nodes: dict[type, Callable[[Any], Any]] = {kind: self.nodes[kind] for kind in _EVALUATED}

    def value(self, tree: ast.expr) -> Any:
        """Return the value of a parsed expression."""
        return self._eval(tree)

    def _eval(self, node: ast.AST) -> Any:
        evaluated = self.nodes.get(type(node))
        if evaluated is None:
            raise ExpressionError(f"{_SHOWN.get(type(node), type(node).__name__)} is not taken")
        found = evaluated(node)
        self._left -= 1 + _size(found) // 100
        if self._left < 0:
            raise ExpressionError("it takes too long")
        return found

    def _eval_attribute(self, node: ast.Attribute) -> Any:
        owner = self._eval(node.value)
        found = getattr(owner, node.attr)  # the methods of plain values, or AttributeError as in Python
        if node.attr not in _METHODS.get(type(owner), ()):
            raise ExpressionError(f".{node.attr} is not taken")
        return functools.partial(_call, found, owner, node.attr)

    def _eval_formattedvalue(self, node: ast.FormattedValue) -> Any:
        if node.format_spec or node.conversion != -1:
            raise ExpressionError("a format in a text is not taken")
        return self._eval(node.value)


_EVALUATED = frozenset(
    [
        *(ast.Attribute, ast.BinOp, ast.BoolOp, ast.Call, ast.Compare, ast.Constant, ast.Dict, ast.FormattedValue),
        *(ast.GeneratorExp, ast.IfExp, ast.JoinedStr, ast.List, ast.ListComp, ast.Name, ast.Set, ast.Slice),
        *(ast.Subscript, ast.Tuple, ast.UnaryOp, ast.keyword),
    ]
)
_SHOWN = {ast.Lambda: "lambda", ast.NamedExpr: ":=", ast.Starred: "*", ast.DictComp: "a comprehension of a dict"}


def _call(method: Callable[..., Any], owner: Any, name: str, *values: Any, **options: Any) -> Any:
    """Call a method of a value, if its result is not too large."""
    given = [*values, *options.values()]
    size = 0
    if isinstance(owner, str) and name == "replace" and all(isinstance(value, str) for value in given[:2]):
        size = len(owner) + (owner.count(given[0]) * len(given[1]) if len(given) > 1 else 0)
    elif isinstance(owner, str) and name == "join":
        size = sum(len(owner) + len(text) for text in given[0] if isinstance(text, str)) if given else 0
    elif isinstance(owner, str):  # a width
        size = max((value for value in given if isinstance(value, int)), default=0)
    _check(size)
    return method(*values, **options)


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, int) and isinstance(exponent, int) and base.bit_length() * exponent > _MAX_BITS:
        raise ExpressionError(f"a power with more than {_MAX_BITS} bits is too large")
    return base**exponent


def _sum(left: Any, right: Any) -> Any:
    if isinstance(left, (str, list, tuple)) and isinstance(right, type(left)):
        _check(len(left) + len(right))
    return left + right


def _product(left: Any, right: Any) -> Any:
    for values, count in ((left, right), (right, left)):
        if isinstance(values, (str, list, tuple)) and isinstance(count, int):
            _check(_size(values) * count)
    return left * right


def _shifted(left: Any, right: Any) -> Any:
    if isinstance(right, int) and right > _MAX_BITS:
        raise ExpressionError(f"a number with more than {_MAX_BITS} bits is too large")
    return left << right


def _remainder(left: Any, right: Any) -> Any:
    if isinstance(left, str):  # a format
        if "*" in left:
            raise ExpressionError("a format with `*` is not taken")
        shown = _size(right)
        _check(len(left) + left.count("%") * shown + sum(int(width[:9]) for width in re.findall(r"\d+", left)))
    return left % right


_OPERATORS = {
    **{kind: function for kind, function in simpleeval.DEFAULT_OPERATORS.items() if kind is not ast.RShift},
    ast.Add: _sum,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.Invert: operator.invert,
    ast.LShift: _shifted,
    ast.MatMult: operator.matmul,
    ast.Mod: _remainder,
    ast.Mult: _product,
    ast.Pow: _power,
    ast.RShift: operator.rshift,
}


def _check(size: int) -> None:
    if size > MAX_SIZE:
        raise ExpressionError(f"it makes something of the size {size} (at most {MAX_SIZE})")


def _size(value: Any) -> int:
    """Return how large a value is.

    Raises:
        ExpressionError: it, or a part of it, is too large, or is of a type that is refused.
    """
    size, rest = 0, [value]
    while rest:
        item = rest.pop()
        size += 1
        if isinstance(item, str):
            size += len(item)
        elif isinstance(item, int):
            if item.bit_length() > _MAX_BITS:
                raise ExpressionError(f"a number with more than {_MAX_BITS} bits is too large")
            size += item.bit_length() // 8
        elif isinstance(item, dict):
            rest += [*item, *item.values()]
        elif isinstance(item, slice):
            rest += (item.start, item.stop, item.step)
        elif isinstance(item, _COLLECTIONS):
            rest.extend(item)
        elif not (isinstance(item, _SCALARS) or callable(item)):
            raise ExpressionError(f"a value of the type {type(item).__name__} is not taken")
        _check(size)
    return size
