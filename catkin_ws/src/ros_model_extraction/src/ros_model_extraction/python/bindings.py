"""Indexes a module: its scopes, what binds the names in them, the parents of its nodes."""

from __future__ import annotations

import ast
from collections import deque
from typing import TYPE_CHECKING

from ros_model_extraction.python.modules import FUNCTIONS, Binding, Scope

if TYPE_CHECKING:
    from ros_model_extraction.python.modules import Module

_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


def index(module: Module) -> None:
    """Fill in the indexes of a module, which is parsed."""
    scope = Scope(module.tree, module, None)
    module.scopes[module.tree] = scope
    todo: deque[tuple[ast.AST, Scope]] = deque([(module.tree, scope)])
    while todo:
        node, scope = todo.popleft()
        module.containing[node] = scope
        scope.nodes.append(node)
        _bind(node, scope)
        inner = scope
        if isinstance(node, (ast.ClassDef, *FUNCTIONS, *_COMPREHENSIONS)):
            inner = Scope(node, module, scope)
            scope.inner.append(inner)
            module.scopes[node] = inner
            _bind_inside(node, inner)
        outside = _outside(node)
        for name, value in ast.iter_fields(node):
            children = value if isinstance(value, list) else [value]
            for number, child in enumerate(children):
                if not isinstance(child, ast.AST):
                    continue
                module.parents[child] = node
                if isinstance(child, (ast.stmt, ast.ExceptHandler, ast.match_case)):
                    module.blocks[child] = (id(value), number)
                if name in ("annotation", "returns"):
                    module.annotations.add(child)
                todo.append((child, scope if name in outside else inner))


def _outside(node: ast.AST) -> tuple[str, ...]:
    """Return the fields of a node whose names belong to the scope around it."""
    if isinstance(node, ast.ClassDef):
        return ("bases", "keywords", "decorator_list")
    if isinstance(node, FUNCTIONS):
        return ("decorator_list", "args", "returns")
    return ()


def _bind(node: ast.AST, scope: Scope) -> None:
    """Note what a node binds in the scope around it."""
    if isinstance(node, (ast.Import, ast.ImportFrom)):
        _bind_import(node, scope)
        return
    name = getattr(node, "name", None)
    match node:
        case ast.Assign():
            for target in node.targets:
                _bind_target(target, node, scope, "value", node.value)
        case ast.AnnAssign():
            _bind_target(node.target, node, scope, "value" if node.value else "opaque", node.value, node.annotation)
        case ast.AugAssign():
            _bind_target(node.target, node, scope, "opaque", None)
        case ast.NamedExpr():
            _bind_target(node.target, node, scope, "value", node.value)
        case ast.For() | ast.AsyncFor():
            _bind_target(node.target, node, scope, "element", node.iter)
        case ast.withitem() if node.optional_vars:
            _bind_target(node.optional_vars, node, scope, "opaque", None)
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            _add(scope, Binding(node.name, node, "definition"))
        case ast.ExceptHandler() | ast.MatchAs() | ast.MatchStar() if name:
            _add(scope, Binding(name, node, "opaque"))
        case ast.Global():
            scope.global_names.update(node.names)
        case ast.Call():
            scope.calls.append(node)


def _bind_import(node: ast.Import | ast.ImportFrom, scope: Scope) -> None:
    source = scope.module.absolute(node.module or "", node.level) if isinstance(node, ast.ImportFrom) else ""
    for alias in node.names:
        if isinstance(node, ast.Import):
            whole = alias.name if alias.asname else alias.name.partition(".")[0]
            _add(scope, Binding(alias.asname or whole, node, "import", target=(whole, "")))
        elif alias.name == "*":
            scope.star_imports.append(source)
        else:
            _add(scope, Binding(alias.asname or alias.name, node, "import", target=(source, alias.name)))


def _bind_inside(node: ast.AST, scope: Scope) -> None:
    """Note what a node binds in the scope that it opens: parameters, the variables of a comprehension."""
    if isinstance(node, FUNCTIONS):
        arguments = node.args
        every = [*arguments.posonlyargs, *arguments.args, arguments.vararg, *arguments.kwonlyargs, arguments.kwarg]
        for argument in every:
            if argument:
                _add(scope, Binding(argument.arg, argument, "parameter", annotation=argument.annotation))
    elif isinstance(node, _COMPREHENSIONS):
        for generator in node.generators:
            _bind_target(generator.target, generator, scope, "element", generator.iter)


def _bind_target(
    target: ast.AST,
    node: ast.AST,
    scope: Scope,
    how: str,
    value: ast.expr | None,
    annotation: ast.expr | None = None,
    path: tuple[int, ...] = (),
) -> None:
    match target:
        case ast.Name(id=name):
            _add(scope, Binding(name, node, how, value, path, annotation))
        case ast.Tuple(elts=elements) | ast.List(elts=elements):
            for index, element in enumerate(elements):
                if isinstance(element, ast.Starred):
                    _bind_target(element.value, node, scope, "opaque", None)
                else:
                    _bind_target(element, node, scope, how, value, None, (*path, index))
        case ast.Attribute(value=ast.Name(id=owner), attr=attribute):
            # `self.name = value`: kept under a name that no variable can have.
            _add(scope, Binding(f"{owner}.{attribute}", node, how, value, path, annotation))


def _add(scope: Scope, binding: Binding) -> None:
    if binding.name in scope.global_names:
        scope = scope.module.scope
    elif binding.how == "value" and isinstance(scope.node, _COMPREHENSIONS) and isinstance(binding.node, ast.NamedExpr):
        while scope.parent and isinstance(scope.node, _COMPREHENSIONS):
            scope = scope.parent
    scope.bindings.setdefault(binding.name, []).append(binding)
