"""Where functions of a program are called, and where objects of its classes are made."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Protocol

from ros_model_extraction.python.modules import Scope
from ros_model_extraction.python.values import Class, External, Frame, Function, Instance, Results, Unknown, World

Site = tuple[ast.Call, Scope, int]
"""A call, the scope that it stands in, and how many of its arguments are not passed on."""


class Evaluation(Protocol):
    """What this needs of an evaluator."""

    def evaluate(self, node: ast.expr, frame: Frame, world: World) -> Results:
        """Return what an expression may be."""

    def own_budget(self) -> AbstractContextManager[None]:
        """Count the steps inside apart from the present question: what is found there is kept for all questions."""

    def unsettle(self) -> None:
        """Keep nothing of what is being found out now: it may be incomplete."""


class Callers:
    """Finds callers and objects among the calls of some scopes."""

    def __init__(self, evaluator: Evaluation) -> None:
        """Start without any scope."""
        self.scopes: list[Scope] = []
        self.plugins: dict[Scope, str] = {}  # class -> what to say about it
        self._evaluator = evaluator
        self._by_name: dict[str, list[tuple[ast.Call, Scope]]] | None = None
        self._references: dict[str, list[tuple[ast.expr, Scope]]] = {}
        self._sites: dict[Scope, list[Site | None]] = {}
        self._instances: dict[Scope, list[Instance]] = {}
        self._finding_bases: set[Scope] = set()

    def forget(self) -> None:
        """Look anew: `scopes` has changed."""
        self._by_name = None
        self._sites.clear()
        self._instances.clear()

    def callers(self, function: Scope) -> list[Site | None]:
        """Return the calls of a function, with their scopes and what to skip; None stands for callers unknown."""
        if function not in self._sites:
            self._sites[function] = []  # while this is being found out: a caller that needs it has none
            with self._evaluator.own_budget():
                self._sites[function] = [*self._find_callers(function)] or [None]
        if not self._sites[function]:
            self._evaluator.unsettle()
        return self._sites[function] or [None]

    def instances(self, owner: Scope) -> list[Instance]:
        """Return the objects of a class and its subclasses, by where they are made."""
        if owner not in self._instances:
            self._instances[owner] = []
            with self._evaluator.own_budget():
                self._instances[owner] = [*self._find_instances(owner)] or [Instance(owner)]
        if not self._instances[owner]:
            self._evaluator.unsettle()
        return self._instances[owner] or [Instance(owner)]

    def bases(self, scope: Scope) -> list[Scope | External]:
        """Return a class and its bases, in the order in which attributes are looked up."""
        found: list[Scope | External] = [scope]
        if not isinstance(scope.node, ast.ClassDef) or not scope.parent:
            return found
        if scope in self._finding_bases:
            return found
        self._finding_bases.add(scope)
        try:
            for base in scope.node.bases:
                expression = base.value if isinstance(base, ast.Subscript) else base
                for value, _ in self._evaluator.evaluate(expression, root_frame(scope.parent), World())[:1]:
                    if isinstance(value, Class):
                        found += [b for b in self.bases(value.scope) if b not in found]
                    elif isinstance(value, External):
                        found.append(value)
                    else:
                        found.append(External("?"))
        finally:
            self._finding_bases.discard(scope)
        return found

    def constructor(self, scope: Scope) -> Scope | External | None:
        """Return the `__init__` that a class has: of the sources, or an outside class; None if it has none."""
        for base in self.bases(scope):
            if isinstance(base, External):
                return base
            if init := self.method(base, "__init__"):
                return init
        return None

    @staticmethod
    def method(owner: Scope, name: str) -> Scope | None:
        """Return a function that stands in a class."""
        definitions = [b for b in owner.bindings.get(name, ()) if b.how == "definition"]
        return owner.module.scopes.get(definitions[-1].node) if definitions else None

    def _calls_by_name(self) -> dict[str, list[tuple[ast.Call, Scope]]]:
        """Index all calls, and all uses of names that are none, by the last part of what is called."""
        if self._by_name is None:
            self._by_name = defaultdict(list)
            self._references = defaultdict(list)
            aliases = {
                binding.name: binding.target[1]
                for scope in self.scopes
                for bindings in scope.bindings.values()
                for binding in bindings
                if binding.how == "import" and binding.target[1] not in ("", binding.name)
            }
            for scope in self.scopes:
                callees = {call.func for call in scope.calls}
                for call in scope.calls:
                    if name := last_name(call.func):
                        self._by_name[aliases.get(name, name)].append((call, scope))
                for node in scope.nodes:
                    if isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Load):
                        name = last_name(node)
                        if node not in callees and node not in scope.module.annotations:
                            self._references[aliases.get(name, name)].append((node, scope))
        return self._by_name

    def _find_instances(self, owner: Scope) -> Iterator[Instance]:
        for scope in self.scopes:
            if isinstance(scope.node, ast.ClassDef) and owner in self.bases(scope):
                for call, at in self._constructions(scope):
                    yield Instance(scope, call, root_frame(at))
                if scope in self.plugins:
                    yield Instance(scope)

    def _constructions(self, owner: Scope) -> list[tuple[ast.Call, Scope]]:
        candidates = self._calls_by_name().get(owner.name, ())
        wanted = Class(owner)
        return [
            (call, scope)
            for call, scope in candidates
            if any(value == wanted for value, _ in self._evaluator.evaluate(call.func, root_frame(scope), World()))
        ]

    def _find_callers(self, function: Scope) -> Iterator[Site | None]:
        if not isinstance(function.node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            return
        for call, scope in self._calls_by_name().get(function.name, ()):
            for value, _ in self._evaluator.evaluate(call.func, root_frame(scope), World()):
                if isinstance(value, Function) and value.scope is function:
                    yield call, scope, skipped(function, value.instance)
                    break
                if isinstance(value, Unknown) and function.owner and isinstance(call.func, ast.Attribute):
                    if _fits(call, function):
                        yield call, scope, 0
                    break
        for node, scope in self._references.get(function.name, ()):
            values = self._evaluator.evaluate(node, root_frame(scope), World())
            if any(isinstance(value, Function) and value.scope is function for value, _ in values):
                yield None
                return


def root_frame(scope: Scope) -> Frame:
    """Return the frame of some activation of a scope."""
    return Frame(scope, root_frame(scope.parent) if scope.parent else None)


def skipped(function: Scope, instance: Instance | None) -> int:
    """Return how many arguments of a call are not for parameters: the object, where it is passed by hand."""
    explicit = function.owner is not None and instance is None
    return int(explicit and not function.decorators & {"staticmethod", "classmethod"})


def last_name(node: ast.AST) -> str:
    """Return the last part of a dotted name, "" for other expressions."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(attr=name):
            return name
    return ""


def _fits(call: ast.Call, function: Scope) -> bool:
    """Return whether a call has as many arguments as a method takes."""
    spec = getattr(function.node, "args", None)
    if not isinstance(spec, ast.arguments) or spec.vararg:
        return False
    most = len(spec.posonlyargs) + len(spec.args) - 1
    least = most - len(spec.defaults)
    names = {argument.arg for argument in (*spec.args, *spec.kwonlyargs)}
    keywords = {keyword.arg for keyword in call.keywords}
    return least <= len(call.args) + len(keywords) and len(call.args) <= most and keywords <= names
