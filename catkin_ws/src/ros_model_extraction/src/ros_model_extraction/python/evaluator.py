"""Evaluates expressions of a program without running it: every value that the text allows, and "unknown" else.

Where several things are possible (two assignments, two callers, a loop), each is followed, and the World keeps what was
chosen, so that the arguments of one call belong together. Cost is bounded: what takes too many steps is unknown.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ros_model_extraction.python import known_functions as python_known
from ros_model_extraction.python.callers import root_frame, skipped
from ros_model_extraction.python.calls import MAX_VALUES
from ros_model_extraction.python.expressions import ExpressionEvaluator
from ros_model_extraction.python.modules import Binding, Module, Scope, at_end, reaching
from ros_model_extraction.python.values import (
    Class,
    Const,
    External,
    Frame,
    Function,
    Instance,
    Items,
    ModuleValue,
    Partial,
    Results,
    Super,
    Table,
    Unknown,
    Value,
    World,
    source_of,
    text_of,
    weight,
)
from ros_model_extraction.ros_api import PYTHON_CALLS

if TYPE_CHECKING:
    from ros_model_extraction.io.python_modules import Library


MAX_STEPS = 3_000
"""Expressions looked at for one question; a hard one of the project's own packages takes some hundreds."""
MAX_TOTAL = 1_000_000
"""Expressions looked at for one node: some 20 s."""
MAX_DEPTH = 60
"""Expressions within each other, through calls; some ten of Python's own frames each."""

MAX_WEIGHT = 20_000
"""Characters and elements of a value that is followed; names are shorter, and code may double a text in each line."""

_GET_PARAMETER = ("rospy.get_param", "rospy.client.get_param", "rospy.get_param_cached")
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


class Evaluator(ExpressionEvaluator):
    """Evaluates expressions of the modules of a library."""

    def __init__(self, library: Library, parameters: Callable[[str], Any] | None = None) -> None:
        """Start without any scope.

        Args:
            library: where modules come from.
            parameters: returns the value of a parameter by its name as the code has it, or raises KeyError.
        """
        super().__init__()
        self._library = library
        self._parameters = parameters
        self._active: set[Hashable] = set()
        self._steps = 0
        self._total = 0
        self._depth = 0
        self._kept: dict[tuple[ast.expr, Frame], tuple[Value, tuple[str, ...]]] = {}  # whatever was chosen before

    def forget_callers(self) -> None:
        """Look for callers anew: `program.scopes` has changed."""
        self._kept.clear()
        self.program.forget()

    @contextlib.contextmanager
    def own_budget(self) -> Iterator[None]:
        """Count the steps inside apart from the present question: what is found there is kept for all questions."""
        spent, self._steps = self._steps, 0
        try:
            yield
        finally:
            self._total += self._steps
            self._steps = spent

    def ask(self, node: ast.expr, frame: Frame, world: World | None = None) -> Results:
        """Evaluate an expression as a question of its own, with a fresh budget."""
        self._total += self._steps
        self._steps = 0
        try:
            return self.evaluate(node, frame, world or World())
        except RecursionError:
            return [(Unknown(node), world or World())]

    def evaluate(self, node: ast.expr, frame: Frame, world: World) -> Results:
        """Return the values that an expression may have, each with the world in which it has it."""
        key = (node, frame)
        if kept := self._kept.get(key):
            value, notes = kept
            for note in notes:
                world = world.noting(note)
            return [(value, world)]
        self._steps += 1
        if key in self._active or self._is_spent():
            self._unsettled += 1
            return [(Unknown(node), world)]
        self._active.add(key)
        self._depth += 1
        unsettled = self._unsettled
        try:
            results = self._dispatch(node, frame, world)
        finally:
            self._depth -= 1
            self._active.discard(key)
        if not results or len(results) > MAX_VALUES or any(weight(value) > MAX_WEIGHT for value, _ in results):
            return [(Unknown(node), world)]
        if len(results) == 1 and unsettled == self._unsettled:
            value, after = results[0]
            self._kept[key] = value, after.notes[len(world.notes) :]
        return results

    def _is_spent(self) -> bool:
        return self._steps > MAX_STEPS or self._total > MAX_TOTAL or self._depth > MAX_DEPTH

    def _name(self, node: ast.Name, frame: Frame, world: World) -> Results:
        at: Frame | None = frame
        is_same_scope = True
        while at is not None:
            scope = at.scope
            if is_same_scope or not isinstance(scope.node, ast.ClassDef):
                if bindings := scope.bindings.get(node.id):
                    fitting = reaching(bindings, node, scope.module) if is_same_scope else at_end(bindings, scope)
                    return self._bound(fitting or bindings, at, world)
                if found := self._starred(node.id, scope):
                    return [(found, world)]
            is_same_scope = is_same_scope and isinstance(scope.node, _COMPREHENSIONS)
            at = at.lexical
        if hasattr(builtins, node.id):
            return [(External(f"builtins.{node.id}"), world)]
        return [(Unknown(node.id), world)]

    def _starred(self, name: str, scope: Scope) -> Value | None:
        """Return what `from module import *` brings under a name."""
        for source in scope.star_imports:
            module = self._library.module(source)
            if module is None and (self._library.has_message(source, name) or f"{source}.{name}" in PYTHON_CALLS):
                return External(f"{source}.{name}")
            if module and (found := self._module_member(module, name, World())):
                return found[0][0]
        return None

    def _bound(self, bindings: Sequence[Binding], frame: Frame, world: World) -> Results:
        key = ("name", tuple(bindings), frame)
        return [
            result
            for index, chosen in self.choose(key, len(bindings), world)
            for result in self._binding(bindings[index], frame, chosen)
        ]

    def _binding(self, binding: Binding, frame: Frame, world: World) -> Results:
        match binding.how:
            case "value" if binding.value is not None:
                results = [(_at(v, binding), w) for v, w in self.evaluate(binding.value, frame, world)]
            case "element" if binding.value is not None:
                results = self._elements(binding, frame, world)
            case "import":
                return [(self._imported(*binding.target), world)]
            case "definition":
                scope = frame.scope.module.scopes[binding.node]
                is_class = isinstance(binding.node, ast.ClassDef)
                return [(Class(scope) if is_class else Function(scope, frame), world)]
            case "parameter":
                return self.parameter(binding, frame, world)
            case _:
                results = [(Unknown(binding.name), world)]
        return self.annotated(results, binding.annotation, frame)

    def _elements(self, binding: Binding, frame: Frame, world: World) -> Results:
        results: Results = []
        assert binding.value is not None  # noqa: S101 (for the type checker)
        for value, w in self.evaluate(binding.value, frame, world):
            items = python_known.elements(value)
            if items is None:
                results.append((Unknown(binding.name), w))
                continue
            for index, chosen in self.choose(("element", binding.node, frame), len(items), w):
                if index < len(items):
                    results.append((_at(items[index], binding), chosen))
        return results

    def _imported(self, source: str, name: str) -> Value:
        key = ("import", source, name)
        if key in self._active:  # modules that import a name from each other
            self.unsettle()
            return Unknown(name)
        self._active.add(key)
        try:
            return self._import(source, name)
        finally:
            self._active.discard(key)

    def _import(self, source: str, name: str) -> Value:
        module = self._library.module(source)
        if not name:
            return ModuleValue(module) if module else External(source)
        if module:
            found = self._module_member(module, name, World())
            return found[0][0] if found else Unknown(name)
        if inner := self._library.module(f"{source}.{name}"):
            return ModuleValue(inner)
        return External(f"{source}.{name}")

    def _module_member(self, module: Module, name: str, world: World) -> Results:
        if bindings := module.scope.bindings.get(name):
            return self._bound(at_end(bindings, module.scope), root_frame(module.scope), world)
        if inner := self._library.module(f"{module.name}.{name}"):
            return [(ModuleValue(inner), world)]
        found = self._starred(name, module.scope)
        if found is None and name in ("msg", "srv") and module.is_package:  # these are generated into the module
            found = External(f"{module.name}.{name}")
        return [(found, world)] if found else []

    def annotated(self, results: Results, annotation: ast.expr | None, frame: Frame) -> Results:
        """Return the results, with unknown values replaced by instances of the annotated class."""
        if annotation is None or not any(isinstance(value, Unknown) for value, _ in results):
            return results
        owner = self._annotated_class(annotation, frame)
        if owner is None:
            return results
        instances = self.program.instances(owner)
        found: Results = []
        for value, world in results:
            if not isinstance(value, Unknown):
                found.append((value, world))
                continue
            for index, chosen in self.choose(("annotated", annotation, frame), len(instances), world):
                plugin = self.program.plugins.get(instances[index].scope)
                found.append((instances[index], chosen.noting(plugin) if plugin else chosen))
        return found

    def _annotated_class(self, annotation: ast.expr, frame: Frame) -> Scope | None:
        match annotation:
            case ast.BinOp(left=left, op=ast.BitOr(), right=right):
                return self._annotated_class(left, frame) or self._annotated_class(right, frame)
            case ast.Constant(value=str(text)):
                try:
                    inner = ast.parse(text, mode="eval").body
                except (SyntaxError, ValueError, RecursionError, MemoryError):
                    return None
                return self._annotated_class(inner, frame) if not isinstance(inner, ast.Constant) else None
            case ast.Name(id=name):  # by hand, for the node may stand in no module's tree
                at: Frame | None = frame
                while at is not None:
                    if bindings := at.scope.bindings.get(name):
                        values = self._binding(bindings[-1], at, World())
                        return values[0][0].scope if isinstance(values[0][0], Class) else None
                    at = at.lexical
            case ast.Attribute():
                values = self.evaluate(annotation, frame, World())
                return values[0][0].scope if isinstance(values[0][0], Class) else None
        return None

    def _call(self, node: ast.Call, frame: Frame, world: World) -> Results:
        results: Results = []
        if isinstance(node.func, ast.Attribute):
            for base, w in self.evaluate(node.func.value, frame, world):
                if isinstance(base, (Const, Table)):
                    for values, after in self._values(node, frame, w):
                        found = python_known.call_method(base, node.func.attr, values)
                        results.append((found or Unknown(node), after))
                else:
                    for callee, after in self._member(base, node.func.attr, w):
                        results += self._applied(callee, node, frame, after)
            return results
        for callee, w in self.evaluate(node.func, frame, world):
            results += self._applied(callee, node, frame, w)
        return results

    def _values(self, node: ast.Call, frame: Frame, world: World) -> list[tuple[list[Value], World]]:
        return [
            found
            for arguments, w in self.arguments(node, frame, world)
            if not arguments.is_open
            for found in self.evaluate_all(arguments.positional, frame, w)
        ]

    def _applied(self, callee: Value, node: ast.Call, frame: Frame, world: World) -> Results:
        """Return what calling a value gives."""
        found: Results = []
        match callee:
            case Class(scope):
                found = [(Instance(scope, node, frame), world)]
            case Function(scope, lexical, instance):
                skip = skipped(scope, instance)
                bound = None if "staticmethod" in scope.decorators else instance
                found = self._returned(scope, Frame(scope, lexical, node, frame, bound, skip), world)
            case External("builtins.super"):
                found = self._super(frame, world)
            case External("functools.partial") if node.args:
                found = [(Partial(value, node, frame), w) for value, w in self.evaluate(node.args[0], frame, world)]
            case External(name) if name in _GET_PARAMETER:
                found = self._ros_parameter(node, frame, world)
            case External(name) if python_known.knows(name):
                for values, w in self._values(node, frame, world):
                    found.append((python_known.call_function(name, values) or Unknown(node), w))
        return found or [(Unknown(node), world)]

    def _returned(self, scope: Scope, frame: Frame, world: World) -> Results:
        returns = [node.value for node in scope.nodes if isinstance(node, ast.Return) and node.value is not None]
        if isinstance(scope.node, ast.Lambda):
            returns = [scope.node.body]
        results: Results = []
        for index, chosen in self.choose(("return", frame), len(returns), world):
            if index < len(returns):
                results += self.evaluate(returns[index], frame, chosen)
        if not results:
            results = [(Unknown(scope.name), world)]
        return self.annotated(results, getattr(scope.node, "returns", None), root_frame(scope))

    def _super(self, frame: Frame, world: World) -> Results:
        at: Frame | None = frame
        while at is not None:
            owner = at.scope.owner
            if owner:
                return [(Super(instance, owner), w) for instance, w in self.objects(at, world)]
            at = at.lexical
        return [(Unknown("super()"), world)]

    def _ros_parameter(self, node: ast.Call, frame: Frame, world: World) -> Results:
        """Return a parameter's value where values are given; else its default, and have that said."""
        results: Results = []
        for arguments, w in self.arguments(node, frame, world):
            name, default = arguments.get(0, "param_name"), arguments.get(1, "default")
            if name is None:
                results.append((Unknown(node), w))
                continue
            for key, after in self.given(name, frame, w):
                if self._parameters and isinstance(key, Const):
                    try:
                        results.append((python_known.value_of(self._parameters(str(key.value))), after))
                        continue
                    except KeyError:
                        pass
                if default is None:
                    results.append((Unknown(node), after))
                    continue
                said = f"the default of the parameter {text_of(key) or source_of(node)}"
                for value, last in self.given(default, frame, after):
                    empty = isinstance(value, (Items, Table)) or value in (Const(None), Const(""))
                    results.append((Unknown(node), last) if empty else (value, last.noting(said)))
        return results


def _at(value: Value, binding: Binding) -> Value:
    """Return the element of a value at the path that a binding unpacks."""
    for index in binding.path:
        items = python_known.elements(value)
        if items is None or index >= len(items):
            return Unknown(binding.name)
        value = items[index]
    return value
