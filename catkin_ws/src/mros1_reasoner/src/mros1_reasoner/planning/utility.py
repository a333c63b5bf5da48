"""The utility of a design, by a plug-in: a function (parameters, qualities) -> (design -> number; greater is better).

A package adds one with `<export><mros1_reasoner utility="NAME" function="module:function"/></export>` in package.xml.
"""

from __future__ import annotations

import ast
import logging
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from node_kit.one_line import OneLineError
from node_kit.plugins import PluginError, find

from mros1_reasoner.knowledge.model import Design, Direction, Quality
from mros1_reasoner.planning.planner import Utility

_log = logging.getLogger(__name__)

_PACKAGE = "mros1_reasoner"
_LONGEST = 1000  # characters of an expression
_DEEPEST = 200  # levels of an expression
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "exp": math.exp,
    "log": math.log,
    "max": max,
    "min": min,
    "sqrt": math.sqrt,
}
_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_Levels = Mapping[str, float]


class UtilityError(OneLineError):
    """A utility function can't be made as requested; one line that says why."""


def make_utility(wanted: str | Mapping[str, Any], qualities: Mapping[str, Quality]) -> Utility:
    """Return a utility function.

    Args:
        wanted: name of the quality whose expected level is the utility; or {name of a plug-in: its parameters}, such as
            `{weights: {performance: 1, energy: -0.5}}` or `{expression: performance - energy ** 2}`.
        qualities: how the levels of each quality compare.

    Raises:
        UtilityError: no plug-in is called so, it is broken, or it does not take the parameters.
    """
    if isinstance(wanted, str):
        return quality(wanted, qualities)
    if not isinstance(wanted, Mapping) or len(wanted) != 1:
        raise UtilityError(f"utility {wanted!r}: expected the name of a quality, or one plug-in with its parameters")
    ((name, parameters),) = wanted.items()
    plugins = find(_PACKAGE, "utility")
    if name not in plugins:
        known = ", ".join(sorted(plugins))
        raise UtilityError(f"utility {name!r}: no package exports one of that name: known: {known}")
    try:
        make = plugins[name].load()
        with plugins[name].guard(UtilityError):
            made: Utility = make(parameters, qualities)
        if not callable(made):
            raise plugins[name].error(f"returned {made!r}", "return a function: design -> number")
    except PluginError as error:
        raise UtilityError(str(error)) from error
    return made


def known_utility(
    wanted: str | Mapping[str, Any], qualities: Mapping[str, Quality], designs: Iterable[Design]
) -> Utility:
    """Return a utility function that has computed the utility of each design already; it takes no other ones.

    Args:
        wanted: as in make_utility.
        qualities: as in make_utility.
        designs: all of them.

    Raises:
        UtilityError: as in make_utility, or a design has no utility: a finite number, or minus infinity.
    """
    utility, known = make_utility(wanted, qualities), {}
    for design in designs:
        try:
            known[design.name] = found = float(utility(design))
        except Exception as error:  # whatever a plug-in raises
            problem = f"{type(error).__name__}: {error}"
            raise UtilityError(f"utility {wanted!r} of {design.name}: {problem}: correct it") from error
        if math.isnan(found) or found == math.inf:
            raise UtilityError(f"utility {wanted!r} of {design.name} is {found}: have it be a finite number")
    return lambda design: known[design.name]


def quality(name: Any, qualities: Mapping[str, Quality]) -> Utility:
    """Return the utility that is the expected level of one quality, or 0 for a design without that level."""
    if name not in qualities:
        _log.warning("utility: no quality is called %r: every design is as useful as another", name)
    sign = -qualities.get(name, Quality(Direction.HIGHER_IS_BETTER)).direction.sign
    return lambda design: sign * design.expected.get(name, 0.0)


def weights(parameters: Any, qualities: Mapping[str, Quality]) -> Utility:
    """Return the utility that is a weighted sum of expected levels; parameters: {quality: weight}.

    Raises:
        UtilityError: a quality is unknown, or a weight is no finite number.
    """
    if not isinstance(parameters, Mapping) or not parameters:
        raise UtilityError(f"utility weights: {parameters!r}: expected a mapping quality -> weight")
    for name, weight in parameters.items():
        _check_name(str(name), qualities)
        if isinstance(weight, bool) or not isinstance(weight, (int, float)) or not math.isfinite(weight):
            raise UtilityError(f"utility weights: {name} has the weight {weight!r}: expected a finite number")
    return lambda design: math.fsum(weight * design.expected.get(name, 0.0) for name, weight in parameters.items())


def expression(parameters: Any, qualities: Mapping[str, Quality]) -> Utility:
    """Return the utility that an expression computes from expected levels.

    It takes numbers, names of qualities, + - * / **, comparisons, `a if condition else b`, and min, max, abs, sqrt,
    exp, log. A design is the least useful if it lacks an expected level, or if the expression has no value for it.

    Raises:
        UtilityError: the expression holds something else, or a quality that is unknown.
    """
    text = str(parameters).strip()
    if len(text) > _LONGEST:
        raise UtilityError(f"utility expression: it has {len(text)} characters, {_LONGEST} are allowed")
    try:
        tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise UtilityError(f"utility expression {text!r}: {getattr(error, 'msg', error)}") from error
    if _is_deeper(tree, _DEEPEST):
        raise UtilityError(f"utility expression: it is nested too deeply: at most {_DEEPEST} levels are allowed")
    compute = _compiled(tree, text, qualities)

    def utility(design: Design) -> float:
        try:
            value = compute(design.expected)
        except (ArithmeticError, KeyError, ValueError, TypeError):
            return -math.inf
        return float(value) if isinstance(value, (int, float)) and not math.isnan(value) else -math.inf

    return utility


def _is_deeper(tree: ast.AST, levels: int) -> bool:
    """Return whether an expression has more levels; without recursion, which has its own limit."""
    level = [tree]
    while level and levels > 0:
        level, levels = [child for node in level for child in ast.iter_child_nodes(node)], levels - 1
    return bool(level)


def _compiled(node: ast.AST, text: str, qualities: Mapping[str, Quality]) -> Callable[[_Levels], Any]:
    """Return a function that computes a node of an expression from expected levels."""

    def part(child: ast.AST) -> Callable[[_Levels], Any]:
        return _compiled(child, text, qualities)

    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            constant = float(number)
            return lambda _: constant
        case ast.Name(id=name):
            _check_name(name, qualities)
            return lambda levels: levels[name]
        case ast.UnaryOp(op, operand) if type(op) in _OPERATORS:
            return _applied(_OPERATORS[type(op)], [part(operand)])
        case ast.BinOp(left, op, right) | ast.Compare(left, [op], [right]) if type(op) in _OPERATORS:
            return _applied(_OPERATORS[type(op)], [part(left), part(right)])
        case ast.IfExp(test, body, orelse):
            condition, yes, no = part(test), part(body), part(orelse)
            return lambda levels: yes(levels) if condition(levels) else no(levels)
        case ast.Call(ast.Name(id=name), args, []) if name in _FUNCTIONS and args:
            return _applied(_FUNCTIONS[name], [part(argument) for argument in args])
    raise UtilityError(f"utility expression {text!r}: {ast.unparse(node)!r} is not allowed in it")


def _applied(function: Callable[..., Any], parts: list[Callable[[_Levels], Any]]) -> Callable[[_Levels], Any]:
    return lambda levels: function(*(part(levels) for part in parts))


def _check_name(name: str, qualities: Mapping[str, Quality]) -> None:
    if name not in qualities:
        raise UtilityError(f"utility: no quality is called {name!r}: known: {', '.join(sorted(qualities))}")
