"""Python modules as syntax trees, with indexes for an evaluator: scopes, names and their bindings, parents."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ros_model.language.metamodel import Position

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
Comprehension = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
ScopeNode = ast.Module | ast.ClassDef | FunctionNode | Comprehension

_LOOPS = (ast.For, ast.AsyncFor, ast.While)


@dataclass(frozen=True, eq=False)
class Binding:
    """One way in which a name gets its value.

    Attributes:
        name: the name.
        node: the statement or clause that binds it.
        how: value, element (of an iterable), import, definition (of a function or class), parameter, opaque.
        value: the expression on the right, or the iterable.
        path: which element of the value, for `a, (b, c) = value`.
        annotation: declared type.
        target: of an import: module and name in it ("" for the module itself, "*" for all names).
    """

    name: str
    node: ast.AST
    how: str
    value: ast.expr | None = None
    path: tuple[int, ...] = ()
    annotation: ast.expr | None = None
    target: tuple[str, str] = ("", "")


@dataclass(eq=False)
class Scope:
    """Where names live: a module, class, function, lambda or comprehension."""

    node: ScopeNode
    module: Module
    parent: Scope | None
    bindings: dict[str, list[Binding]] = field(default_factory=dict)
    star_imports: list[str] = field(default_factory=list)
    global_names: set[str] = field(default_factory=set)
    nodes: list[ast.AST] = field(default_factory=list)  # whatever stands in it, and in no scope inside it
    calls: list[ast.Call] = field(default_factory=list)
    inner: list[Scope] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the class or function; "" for others."""
        return getattr(self.node, "name", "")

    @property
    def owner(self) -> Scope | None:
        """The class of which this is a method, or None."""
        is_method = isinstance(self.node, (ast.FunctionDef, ast.AsyncFunctionDef))
        return self.parent if is_method and self.parent and isinstance(self.parent.node, ast.ClassDef) else None

    @property
    def decorators(self) -> frozenset[str]:
        """Last parts of the decorators' names."""
        found = getattr(self.node, "decorator_list", [])
        plain = (d.func if isinstance(d, ast.Call) else d for d in found)
        return frozenset(getattr(d, "attr", getattr(d, "id", "")) for d in plain)


@dataclass(eq=False)
class Module:
    """A parsed module and its index."""

    name: str
    path: Path
    shown: str  # path for people, relative to the package
    tree: ast.Module
    is_package: bool = False
    is_script: bool = False
    scopes: dict[ast.AST, Scope] = field(default_factory=dict)  # of the nodes that open one
    containing: dict[ast.AST, Scope] = field(default_factory=dict)  # of every node
    parents: dict[ast.AST, ast.AST] = field(default_factory=dict)
    blocks: dict[ast.AST, tuple[int, int]] = field(default_factory=dict)  # statement -> its list's id, place in it
    annotations: set[ast.AST] = field(default_factory=set)  # the roots of annotations

    @property
    def scope(self) -> Scope:
        """The module's own scope."""
        return self.scopes[self.tree]

    def position(self, node: ast.AST) -> Position:
        """Return where a node stands."""
        return Position(self.shown, getattr(node, "lineno", 1), getattr(node, "col_offset", 0) + 1)

    def absolute(self, target: str, level: int) -> str:
        """Return the full name of a module that an import names relatively."""
        if not level:
            return target
        parts = self.name.split(".")
        base = parts[: len(parts) - level + (1 if self.is_package else 0)]
        return ".".join([*base, target] if target else base)

    def ancestors(self, node: ast.AST) -> Iterator[ast.AST]:
        """Yield a node's parents, from the closest."""
        while node in self.parents:
            node = self.parents[node]
            yield node


def reaching(bindings: Sequence[Binding], use: ast.AST, module: Module) -> list[Binding]:
    """Return those bindings of a name that may hold where it is used in the same scope."""
    places, loops = _places(use, module)
    candidates = []
    last: Binding | None = None
    for binding in bindings:
        statement = _statement(binding.node, module)
        block, index = module.blocks.get(statement, (0, 0))
        in_common_loop = [loop for loop in loops if loop is statement or loop in set(module.ancestors(statement))]
        if block in places and (index < places[block] or (index == places[block] and binding.how == "element")):
            if last is None or _line(binding.node) >= _line(last.node):
                last = binding
            candidates.append(binding)
        elif _line(binding.node) < _line(use) or in_common_loop:
            candidates.append(binding)
    if last is None:
        return candidates
    return [b for b in candidates if b is last or _line(b.node) > _line(last.node)]


def at_end(bindings: Sequence[Binding], scope: Scope) -> list[Binding]:
    """Return those bindings of a name that may hold when its scope's body has run: for uses in other scopes."""
    body = getattr(scope.node, "body", None)
    if not isinstance(body, list):
        return list(bindings)
    last: Binding | None = None
    for binding in bindings:
        if scope.module.blocks.get(_statement(binding.node, scope.module), (0, 0))[0] == id(body):
            last = binding
    if last is None:
        return list(bindings)
    return [b for b in bindings if b is last or _line(b.node) > _line(last.node)]


def _line(node: ast.AST) -> int:
    return getattr(node, "lineno", 0)


def _statement(node: ast.AST, module: Module) -> ast.AST:
    while node not in module.blocks and node in module.parents:
        node = module.parents[node]
    return node


def _places(use: ast.AST, module: Module) -> tuple[dict[int, int], list[ast.AST]]:
    """Return where in each block around it a use stands, and the loops around it, within its scope."""
    places: dict[int, int] = {}
    loops: list[ast.AST] = []
    for node in (use, *module.ancestors(use)):
        if node in module.blocks:
            block, index = module.blocks[node]
            places[block] = index
        if isinstance(node, _LOOPS):
            loops.append(node)
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            break
    return places, loops
