"""Python modules as syntax trees, with what an evaluator asks of them: scopes, names and what binds them, parents."""

from __future__ import annotations

import ast
import os
import re
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import rospkg
from ros_model.language.metamodel import Position

from ros_model_extraction.source import Remark, SourceError, read_source

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
Comprehension = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
ScopeNode = ast.Module | ast.ClassDef | FunctionNode | Comprehension

_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
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


class Library:
    """Finds modules in the source of packages, and reads each once."""

    def __init__(self, folders: Sequence[Path], package_folder: Path) -> None:
        """Search these folders, then the sources of installed packages.

        Args:
            folders: where top-level modules lie.
            package_folder: positions name files relative to it.
        """
        self.remarks: list[Remark] = []
        self._folders = list(folders)
        self._beside: Path | None = None  # the folder of the script, which Python searches first
        self._package_folder = package_folder
        self._modules: dict[str, Module | None] = {}
        self._packages = rospkg.RosPack()

    def script(self, path: Path) -> Module:
        """Read an executable.

        Raises:
            SourceError: it can't be read, or is no Python.
        """
        module = self._read(path, "__main__", is_package=False)
        module.is_script = True
        self._beside = path.parent
        return module

    def module(self, name: str) -> Module | None:
        """Return a module by its full name; None for one that has no source here, or can't be read (a remark says)."""
        if name not in self._modules:
            self._modules[name] = None
            path = self._find(name) if name else None
            if path:
                try:
                    self._modules[name] = self._read(path, name, path.name == "__init__.py")
                except SourceError as error:
                    self.remarks.append(error.remark)
        return self._modules[name]

    def has_message(self, source: str, name: str) -> bool:
        """Tell whether an installed package defines a message or service: `std_msgs.msg`, `String`."""
        package, _, kind = source.partition(".")
        if kind not in ("msg", "srv"):
            return False
        try:
            folder = Path(self._packages.get_path(package))
        except rospkg.ResourceNotFound:
            return False
        action = re.sub(r"(Action)?(Goal|Result|Feedback)?$", "", name).removesuffix("Action")
        files = (folder / kind / f"{name}.{kind}", folder / "action" / f"{action}.action")
        return any(os.path.isfile(file) for file in files)

    def _find(self, name: str) -> Path | None:
        relative = Path(*name.split("."))
        for folder in self._roots(name.partition(".")[0]):
            for candidate in (folder / relative / "__init__.py", (folder / relative).with_suffix(".py")):
                if os.path.isfile(candidate):  # False where the folder can't be entered
                    return candidate
        return None

    def _roots(self, package: str) -> Iterator[Path]:
        if self._beside:
            yield self._beside
        yield from self._folders
        try:
            yield Path(self._packages.get_path(package)) / "src"
        except rospkg.ResourceNotFound:
            return

    def _read(self, path: Path, name: str, is_package: bool) -> Module:
        shown = str(path)
        for folder in (self._package_folder, self._package_folder.parent):
            if path.is_relative_to(folder):
                shown = str(path.relative_to(folder))
                break
        tree = parse(read_source(path, shown), shown)
        module = Module(name, path, shown, tree, is_package)
        _index(module)
        return module


def parse(data: bytes, shown: str) -> ast.Module:
    """Return the syntax tree of Python source.

    Raises:
        SourceError: it is no Python.
    """
    try:
        return ast.parse(data, shown)
    except SyntaxError as error:
        position = Position(shown, error.lineno or 1, error.offset or 1)
        raise SourceError(Remark(position, f"not read: no Python 3: {error.msg}")) from error
    except (ValueError, RecursionError, MemoryError) as error:
        text = f"not read: no Python 3: {error or type(error).__name__}"
        raise SourceError(Remark(Position(shown, 1, 1), text)) from error


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
        if isinstance(node, (*_FUNCTIONS, ast.ClassDef)):
            break
    return places, loops


# --- the index


def _index(module: Module) -> None:
    scope = Scope(module.tree, module, None)
    module.scopes[module.tree] = scope
    todo: deque[tuple[ast.AST, Scope]] = deque([(module.tree, scope)])
    while todo:
        node, scope = todo.popleft()
        module.containing[node] = scope
        scope.nodes.append(node)
        _bind(node, scope)
        inner = scope
        if isinstance(node, (ast.ClassDef, *_FUNCTIONS, *_COMPREHENSIONS)):
            inner = Scope(node, module, scope)
            scope.inner.append(inner)
            module.scopes[node] = inner
            _bind_inside(node, inner)
        outside = _outside(node)
        for name, value in ast.iter_fields(node):
            children = value if isinstance(value, list) else [value]
            for index, child in enumerate(children):
                if not isinstance(child, ast.AST):
                    continue
                module.parents[child] = node
                if isinstance(child, (ast.stmt, ast.ExceptHandler, ast.match_case)):
                    module.blocks[child] = (id(value), index)
                if name in ("annotation", "returns"):
                    module.annotations.add(child)
                todo.append((child, scope if name in outside else inner))


def _outside(node: ast.AST) -> tuple[str, ...]:
    """Return the fields of a node whose names belong to the scope around it."""
    if isinstance(node, ast.ClassDef):
        return ("bases", "keywords", "decorator_list")
    if isinstance(node, _FUNCTIONS):
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
    if isinstance(node, _FUNCTIONS):
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
