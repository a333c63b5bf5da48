"""Evaluates the kinds of expressions, given what names, members and calls are."""

from __future__ import annotations

import ast
from typing import ClassVar

from ros_model_extraction.python import known_functions as python_known
from ros_model_extraction.python.calls import MAX_VALUES, Given
from ros_model_extraction.python.members import MemberEvaluator
from ros_model_extraction.python.operations import is_number, operated
from ros_model_extraction.python.values import (
    Const,
    Frame,
    Hole,
    Items,
    Results,
    Table,
    Text,
    Unknown,
    Value,
    World,
    joined,
    text_of,
)


class ExpressionEvaluator(MemberEvaluator):
    """Evaluates an expression by its kind."""

    def _dispatch(self, node: ast.expr, frame: Frame, world: World) -> Results:
        method = self._METHODS.get(type(node))
        found: Results = getattr(self, method)(node, frame, world) if method else [(Unknown(node), world)]
        return found

    _METHODS: ClassVar[dict[type[ast.expr], str]] = {
        ast.Attribute: "_attribute_of",
        ast.BinOp: "_operation",
        ast.BoolOp: "_alternatives",
        ast.Call: "_call",
        ast.Constant: "_constant",
        ast.Dict: "_dict",
        ast.GeneratorExp: "_comprehension",
        ast.IfExp: "_conditional",
        ast.JoinedStr: "_f_string",
        ast.List: "_literal",
        ast.ListComp: "_comprehension",
        ast.Name: "_name",
        ast.NamedExpr: "_named",
        ast.Set: "_literal",
        ast.SetComp: "_comprehension",
        ast.Subscript: "_subscript",
        ast.Tuple: "_literal",
        ast.UnaryOp: "_negation",
    }

    def _constant(self, node: ast.Constant, _frame: Frame, world: World) -> Results:
        return [(Const(node.value), world)]

    def _named(self, node: ast.NamedExpr, frame: Frame, world: World) -> Results:
        return self.evaluate(node.value, frame, world)

    def _negation(self, node: ast.UnaryOp, frame: Frame, world: World) -> Results:
        results: Results = []
        for value, w in self.evaluate(node.operand, frame, world):
            is_known = isinstance(node.op, ast.USub) and isinstance(value, Const) and is_number(value.value)
            results.append((Const(-value.value) if is_known and isinstance(value, Const) else Unknown(node), w))
        return results

    def _attribute_of(self, node: ast.Attribute, frame: Frame, world: World) -> Results:
        return [
            result
            for value, w in self.evaluate(node.value, frame, world)
            for result in self._member(value, node.attr, w)
        ]

    def _f_string(self, node: ast.JoinedStr, frame: Frame, world: World) -> Results:
        found: list[tuple[list[Text], World]] = [([], world)]
        for part in node.values:
            following = []
            for texts, w in found:
                if not isinstance(part, ast.FormattedValue):
                    results: Results = self.evaluate(part, frame, w)
                elif part.format_spec is not None or part.conversion not in (-1, ord("s")):
                    results = [(Unknown(part.value), w)]
                else:
                    results = self.evaluate(part.value, frame, w)
                for value, after in results:
                    whole = getattr(part, "value", part)
                    text = None if isinstance(value, Unknown) else text_of(value)
                    following.append(([*texts, text or Text((Hole(whole),))], after))
            found = following[: MAX_VALUES + 1]
        return [(joined(texts), w) for texts, w in found]

    def _operation(self, node: ast.BinOp, frame: Frame, world: World) -> Results:
        results: Results = []
        for values, w in self.evaluate_all([Given(node.left), Given(node.right)], frame, world):
            results.append((operated(node, *values), w))
        return results

    def _literal(self, node: ast.Tuple | ast.List | ast.Set, frame: Frame, world: World) -> Results:
        found: list[tuple[list[Value], World]] = [([], world)]
        for element in node.elts:
            inner = element.value if isinstance(element, ast.Starred) else element
            following = []
            for values, before in found:
                for value, after in self.evaluate(inner, frame, before):
                    if not isinstance(element, ast.Starred):
                        following.append(([*values, value], after))
                    elif (items := python_known.elements(value)) is not None:
                        following.append(([*values, *items], after))
                    else:
                        return [(Unknown(element), world)]
            found = following[: MAX_VALUES + 1]
        return [(Items(tuple(values)), w) for values, w in found]

    def _dict(self, node: ast.Dict, frame: Frame, world: World) -> Results:
        if any(key is None for key in node.keys):
            return [(Unknown(node), world)]
        nodes = [Given(part) for pair in zip(node.keys, node.values, strict=True) for part in pair if part]
        return [
            (Table(tuple(zip(values[::2], values[1::2], strict=True))), w)
            for values, w in self.evaluate_all(nodes, frame, world)
        ]

    def _subscript(self, node: ast.Subscript, frame: Frame, world: World) -> Results:
        results: Results = []
        for (value, index), w in self.evaluate_all([Given(node.value), Given(node.slice)], frame, world):
            found: Value | None = None
            if isinstance(index, Const):
                match value:
                    case Items(values) if isinstance(index.value, int) and -len(values) <= index.value < len(values):
                        found = values[index.value]
                    case Table(items):
                        found = next((item for key, item in items if key == index), None)
            elif among := _among(value):  # which one is not known: any
                for number, chosen in self.choose(("item", node, frame), len(among), w):
                    results.append((among[number], chosen))
                continue
            results.append((found or Unknown(node), w))
        return results

    def _conditional(self, node: ast.IfExp, frame: Frame, world: World) -> Results:
        results: Results = []
        for test, w in self.evaluate(node.test, frame, world):
            if isinstance(test, Const):
                results += self.evaluate(node.body if test.value else node.orelse, frame, w)
                continue
            branches = (node.body, node.orelse)
            for index, chosen in self.choose(("if", node, frame), 2, w):
                results += self.evaluate(branches[index], frame, chosen)
        return results

    def _alternatives(self, node: ast.BoolOp, frame: Frame, world: World) -> Results:
        """Return, for `a or b`, a where it is known to count, else either."""
        if not isinstance(node.op, ast.Or):
            return [(Unknown(node), world)]
        results: Results = []
        for index, chosen in self.choose(("or", node, frame), len(node.values), world):
            is_last = index == len(node.values) - 1
            for value, w in self.evaluate(node.values[index], frame, chosen):
                if is_last or not (isinstance(value, Const) and not value.value):
                    results.append((value, w))
            if index == 0 and results and all(isinstance(v, Const) and v.value for v, _ in results):
                break
        return results

    def _comprehension(
        self, node: ast.ListComp | ast.SetComp | ast.GeneratorExp, frame: Frame, world: World
    ) -> Results:
        inner = Frame(frame.scope.module.scopes[node], frame)
        values = []
        for value, _ in self.evaluate(node.elt, inner, world):
            values.append(value)
        if any(generator.ifs for generator in node.generators) or any(isinstance(value, Unknown) for value in values):
            return [(Unknown(node), world)]
        return [(Items(tuple(values)), world)]


def _among(value: Value) -> tuple[Value, ...]:
    match value:
        case Items(values):
            return values
        case Table(items):
            return tuple(item for _, item in items)
    return ()
