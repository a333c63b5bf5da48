"""Finds the code that an executable may reach: through imports, calls, plug-ins."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ros_model_extraction.node_facts import Remark
from ros_model_extraction.python.callers import last_name, root_frame
from ros_model_extraction.python.evaluator import Evaluator
from ros_model_extraction.python.modules import Binding, Module, Scope
from ros_model_extraction.python.values import (
    Class,
    Const,
    Frame,
    Function,
    source_of,
)

if TYPE_CHECKING:
    from ros_model_extraction.io.python_modules import Library


_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


class Reached:
    """Finds the scopes whose code may run: what is imported and referred to, from a script on."""

    def __init__(self, library: Library, evaluator: Evaluator) -> None:
        self._library = library
        self._evaluator = evaluator
        self._seen: set[Scope] = set()
        self.remarks: list[Remark] = []

    def visit(self, first: Scope) -> None:
        """Reach a scope, and what its code refers to."""
        todo = [first]
        while todo:
            scope = todo.pop()
            if scope in self._seen:
                continue
            self._seen.add(scope)
            self._evaluator.program.scopes.append(scope)
            _leave_out_dead_code(scope)
            todo += reversed(list(self._referred(scope)))

    def visit_plugin(self, target: str) -> None:
        """Reach a class that is loaded by its name `module:Class`."""
        name, _, attribute = target.partition(":")
        module = self._library.module(name)
        definition = module.scope.bindings.get(attribute) if module else None
        if module and definition and definition[-1].node in module.scopes:
            scope = module.scopes[definition[-1].node]
            self.visit(module.scope)
            self.visit(scope)
            self._evaluator.program.plugins[scope] = f"only with the plug-in {target}"

    def _referred(self, scope: Scope) -> Iterator[Scope]:
        is_function_or_class = not isinstance(scope.node, ast.Module)
        for inner in scope.inner:
            # A decorator may hand a function to whoever calls it, as commands and callbacks do.
            if is_function_or_class or not isinstance(inner.node, _DEFINITIONS) or inner.decorators:
                yield inner
        frame = root_frame(scope)
        for node in scope.nodes:
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                yield from self._imported(node, scope.module)
            elif isinstance(node, ast.Call) and last_name(node.func) in ("import_module", "__import__") and node.args:
                yield from self._imported_by_name(node, frame)
            elif isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Load):
                root = root_name(node)
                if root is None or not is_static(root.id, scope):
                    continue
                for value, _ in self._evaluator.ask(node, frame):
                    if isinstance(value, (Class, Function)):
                        yield value.scope

    def _imported(self, node: ast.Import | ast.ImportFrom, module: Module) -> Iterator[Scope]:
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            source = module.absolute(node.module or "", node.level)
            names = [source, *(f"{source}.{alias.name}" for alias in node.names)]
        for name in names:
            parts = name.split(".")
            for end in range(1, len(parts) + 1):
                if found := self._library.module(".".join(parts[:end])):
                    yield found.scope

    def _imported_by_name(self, call: ast.Call, frame: Frame) -> Iterator[Scope]:
        """Reach all of what a module holds that is imported by a name: who knows what of it is used."""
        for value, _ in self._evaluator.ask(call.args[0], frame):
            if not isinstance(value, Const):
                text = f"imports a module whose name is not known: {source_of(call.args[0])}"
                self.remarks.append(Remark(frame.scope.module.position(call), text))
            elif module := self._library.module(str(value.value)):
                yield module.scope
                yield from module.scope.inner


def _leave_out_dead_code(scope: Scope) -> None:
    """Drop what runs only for a type checker, or only where a module is the program."""
    dead: set[ast.AST] = set()
    for node in scope.nodes:
        if isinstance(node, ast.If) and (_is_type_checking(node.test) or _is_main(node.test, scope.module)):
            for statement in node.body:
                dead.update(ast.walk(statement))
    if dead:
        scope.nodes = [node for node in scope.nodes if node not in dead]
        scope.calls = [call for call in scope.calls if call not in dead]


def _is_type_checking(test: ast.expr) -> bool:
    return getattr(test, "attr", getattr(test, "id", "")) == "TYPE_CHECKING"


def _is_main(test: ast.expr, module: Module) -> bool:
    match test:
        case ast.Compare(left=ast.Name(id="__name__"), comparators=[ast.Constant(value="__main__")]):
            return not module.is_script
    return False


def root_name(node: ast.expr) -> ast.Name | None:
    """Return the name that a dotted expression begins with; None where it begins with something else."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node if isinstance(node, ast.Name) else None


def is_static(name: str, scope: Scope) -> bool:
    """Return whether a name is bound by imports, definitions, and as another name for such things only."""
    at: Scope | None = scope
    while at is not None:
        if bindings := at.bindings.get(name):
            return all(b.how in ("import", "definition") or _is_alias(b) for b in bindings)
        if at.star_imports:
            return True
        at = at.parent
    return False


def _is_alias(binding: Binding) -> bool:
    match binding.value:
        case ast.Name() | ast.Attribute() | ast.Call(func=ast.Name(id="partial") | ast.Attribute(attr="partial")):
            return binding.how == "value" and not binding.path
    return False
