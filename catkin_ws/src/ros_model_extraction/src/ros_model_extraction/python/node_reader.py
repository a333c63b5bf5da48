"""Reads rospy nodes from source: the interfaces and parameters of the code that an executable can reach."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ros_model.language.metamodel import Position

from ros_model_extraction.node_facts import (
    Configurations,
    FoundParameter,
    FoundPort,
    NodeSource,
    Remark,
    unique,
    unresolved,
)
from ros_model_extraction.python.callers import last_name, root_frame
from ros_model_extraction.python.calls import Arguments, Given
from ros_model_extraction.python.evaluator import Evaluator
from ros_model_extraction.python.known_functions import plain
from ros_model_extraction.python.modules import Module, Scope
from ros_model_extraction.python.reachable_code import Reached, is_static, root_name
from ros_model_extraction.python.values import (
    Class,
    Const,
    External,
    Frame,
    Hole,
    Partial,
    Text,
    Unknown,
    Value,
    World,
    joined,
    source_of,
    text_of,
)
from ros_model_extraction.ros_api import (
    COUNTERPART,
    PYTHON_BELOW,
    PYTHON_FIXED,
    PYTHON_MAKERS,
    PYTHON_UNLESS,
    RECONFIGURE_SERVER,
    Maker,
)

if TYPE_CHECKING:
    from ros_model_extraction.io.python_modules import Library


_MESSAGE = re.compile(r"(?P<package>\w+)\.(?:msg|srv)\.(?:_\w+\.)?(?P<name>\w+)")
_HOMES = {"topics": "", "client": "", "impl.tcpros": "", "impl.tcpros_service": "", "impl.tcpros_pubsub": ""}
_INIT_NODE = "rospy.init_node"
_GET_PARAMETER = {"rospy.get_param", "rospy.get_param_cached"}
_HAS_PARAMETER = "rospy.has_param"
_RECONFIGURE = {"dynamic_reconfigure.Server": False, "dynamic_reconfigure.Client": True}
_INTERESTING = {
    *PYTHON_MAKERS,
    *PYTHON_FIXED,
    *PYTHON_BELOW,
    *_RECONFIGURE,
    *_GET_PARAMETER,
    _INIT_NODE,
    _HAS_PARAMETER,
}

_NAMES = {name.rpartition(".")[2] for name in (*PYTHON_MAKERS, *PYTHON_FIXED, *PYTHON_BELOW)}


def read_python_node(
    script: Path,
    library: Library,
    plugins: Iterable[str] = (),
    parameters: Callable[[str], Any] | None = None,
    configurations: Configurations | None = None,
) -> NodeSource:
    """Return what a script, with all modules that it imports, makes of a node.

    Args:
        script: the executable.
        library: finds the modules; it collects remarks about those that can't be read.
        plugins: classes that the node may load by name, `module:Class`.
        parameters: the value of a parameter by its name as the code has it, or KeyError; without it, defaults count.
        configurations: the parameters of dynamic_reconfigure by the name of the class that is generated.

    Raises:
        SourceError: the script can't be read.
    """
    module = library.script(script)
    evaluator = Evaluator(library, parameters)
    reached = Reached(library, evaluator)
    reached.visit(module.scope)
    for target in plugins:
        reached.visit_plugin(target)
    evaluator.forget_callers()
    reader = _Reader(evaluator, configurations or {})
    for scope in evaluator.program.scopes:
        reader.read(scope)
    remarks = unique([*reached.remarks, *reader.remarks])
    return NodeSource(reader.node_name, tuple(reader.ports), tuple(reader.parameters), remarks, reader.position)


class _Reader:
    """Looks at every call of reached code, and keeps the interfaces that calls of ROS make."""

    def __init__(self, evaluator: Evaluator, configurations: Configurations) -> None:
        self.ports: list[FoundPort] = []
        self.parameters: list[FoundParameter] = []
        self.remarks: list[Remark] = []
        self.node_name = ""
        self.position = Position()
        self._evaluator = evaluator
        self._configurations = configurations

    def read(self, scope: Scope) -> None:
        """Look at the calls of a scope, and at ROS functions that are handed on as values."""
        frame = root_frame(scope)
        called = set()
        for call in scope.calls:
            called.add(call.func)
            if _may_be_ros(call.func, scope):
                try:
                    self._call(call, frame)
                except RecursionError:
                    self.remarks.append(Remark(scope.module.position(call), "too deep to be followed"))
        for node in scope.nodes:
            if not isinstance(node, (ast.Name, ast.Attribute)) or node in called or last_name(node) not in _NAMES:
                continue
            if _is_handed_on(node, scope.module) and _may_be_ros(node, scope):
                for value, _ in self._evaluator.ask(node, frame):
                    if isinstance(value, External) and canonical(value.name) in {*PYTHON_MAKERS, *PYTHON_FIXED}:
                        text = f"{source_of(node)} is handed on as a value: what is made with it is not known"
                        self.remarks.append(Remark(scope.module.position(node), text))

    def _call(self, call: ast.Call, frame: Frame) -> None:
        for callee, world in self._evaluator.ask(call.func, frame):
            function: Value | Scope = callee
            if isinstance(callee, Class):
                function = self._evaluator.program.constructor(callee.scope) or callee
            elif isinstance(callee, Partial):
                function = callee.function
            if not isinstance(function, External) or canonical(function.name) not in _INTERESTING:
                continue
            if isinstance(callee, Partial):
                arguments = self._of_partial(callee, call, frame, world)
            else:
                explicit = function is callee and function.name.endswith(".__init__") and not _is_super(call.func)
                arguments = self._evaluator.arguments(call, frame, world, int(explicit))
            for given, after in arguments:
                self._made(canonical(function.name), given, call, frame, after)

    def _of_partial(
        self, partial: Partial, call: ast.Call, frame: Frame, world: World
    ) -> list[tuple[Arguments, World]]:
        """Return the arguments of a partial function: those that it holds, then those of the call."""
        found = []
        for held, w in self._evaluator.arguments(partial.call, partial.frame, world, 1):
            for values, after in self._evaluator.evaluate_all(held.positional, partial.frame, w):
                for own, last in self._evaluator.arguments(call, frame, after):
                    known = tuple(Given(value=value) for value in values)
                    arguments = Arguments(
                        (*known, *own.positional), {**(held.keywords or {}), **(own.keywords or {})}, own.is_open
                    )
                    found.append((arguments, last))
        return found

    def _made(self, name: str, given: Arguments, call: ast.Call, frame: Frame, world: World) -> None:
        position = frame.scope.module.position(call)
        if name in PYTHON_MAKERS:
            self._port(PYTHON_MAKERS[name], given, call, frame, world)
        elif name in PYTHON_FIXED:
            if name in PYTHON_UNLESS:
                values = self._argument(given, PYTHON_UNLESS[name], frame, world, call)
                if all(value == Const(False) for value, _ in values):
                    return
            self.ports += [FoundPort(made.kind, made.name, made.type, position) for made in PYTHON_FIXED[name]]
        elif name in PYTHON_BELOW:
            interfaces, place = PYTHON_BELOW[name]
            for value, w in self._argument(given, place, frame, world, call):
                prefix = text_of(value) or Text((Hole("namespace"),))
                for made in interfaces:
                    self._found(made.kind, joined([prefix, Text((f"/{made.name}",))]), made.type, w, position)
        elif name in _RECONFIGURE:
            self._reconfigure(_RECONFIGURE[name], given, call, frame, world)
        elif name == _INIT_NODE:
            self._node(given, call, frame, world)
        else:
            self._parameter(name, given, call, frame, world)

    def _port(self, maker: Maker, given: Arguments, call: ast.Call, frame: Frame, world: World) -> None:
        position = frame.scope.module.position(call)
        for name, w in self._argument(given, maker.name, frame, world, call):
            if name == Const(None):
                continue
            for kind, after in self._argument(given, maker.type, frame, w, call):
                self._found(maker.kind, name, message_type(kind), after, position)
                if isinstance(kind, External) and canonical(kind.name) == "rospy.AnyMsg":
                    self.remarks.append(Remark(position, f"{maker.kind.value}: messages of any type"))
                elif not message_type(kind):
                    what = text_of(kind) or source_of(call)
                    self.remarks.append(Remark(position, f"{maker.kind.value}: its type is not known: {what}"))

    def _found(self, kind: Any, name: Value, type_name: str, world: World, position: Position) -> None:
        text, known = ros_name(name)
        if not known:
            self.remarks.append(Remark(position, f"{kind.value}: its name is not known: {text}"))
            text = unresolved(text, position)
        for note in world.notes:
            self.remarks.append(Remark(position, f"{kind.value} {text}: {note}"))
        port = FoundPort(kind, text, type_name, position)
        if port not in self.ports:
            self.ports.append(port)

    def _argument(
        self, given: Arguments, place: tuple[int, str], frame: Frame, world: World, call: ast.Call
    ) -> list[tuple[Value, World]]:
        argument = given.get(*place)
        if argument is None:
            return [(Unknown(call) if given.is_open else Const(None), world)]
        found = []
        for value, w in self._evaluator.given(argument, frame, world):
            is_unknown = isinstance(value, Unknown) and argument.expression is not None
            found.append((Unknown(argument.expression) if is_unknown else value, w))  # type: ignore[arg-type]
        return found

    def _reconfigure(self, is_client: bool, given: Arguments, call: ast.Call, frame: Frame, world: World) -> None:
        """dynamic_reconfigure makes the same three interfaces in the namespace of each server."""
        position = frame.scope.module.position(call)
        place = (0, "name") if is_client else (2, "namespace")
        for value, w in self._argument(given, place, frame, world, call):
            prefix = Text(("~",)) if value == Const(None) else text_of(value) or Text((Hole("namespace"),))
            if not is_client and value != Const(None):
                prefix = Text(("~", *prefix.parts))
            inside = "" if value == Const(None) else "/"
            for made in RECONFIGURE_SERVER:
                kind = COUNTERPART[made.kind] if is_client else made.kind
                name = joined([prefix, Text((f"{inside}{made.name}",))])
                self._found(kind, name, made.type, w, position)
            for kind_of, _ in self._argument(given, (0, "type"), frame, w, call) if not is_client else ():
                self._reconfigurable(kind_of, joined([prefix, Text((inside,))]), position)

    def _reconfigurable(self, kind: Value, prefix: Value, position: Position) -> None:
        """Add the parameters of a server of dynamic_reconfigure, which the package's `.cfg` file lists."""
        name = kind.name.rpartition(".")[2] if isinstance(kind, External) else ""
        shown, _ = ros_name(prefix)
        if name not in self._configurations or "{" in shown:
            self.remarks.append(Remark(position, f"the parameters of {name or 'its server'} are not known"))
            return
        self.parameters += [replace(found, name=f"{shown}{found.name}") for found in self._configurations[name]]

    def _node(self, given: Arguments, call: ast.Call, frame: Frame, world: World) -> None:
        position = frame.scope.module.position(call)
        for name, _ in self._argument(given, (0, "name"), frame, world, call):
            text, known = ros_name(name)
            if not known:
                self.remarks.append(Remark(position, f"the node's own name is not known: {text}"))
            elif self.node_name and self.node_name != text:
                self.remarks.append(Remark(position, f"the node may also be called {text}"))
                continue
            self.node_name = self.node_name or (text if known else "{}")
            self.position = position

    def _parameter(self, function: str, given: Arguments, call: ast.Call, frame: Frame, world: World) -> None:
        position = frame.scope.module.position(call)
        for name, w in self._argument(given, (0, "param_name"), frame, world, call):
            text, known = ros_name(name)
            if text.strip("~/") == "":
                said = f"reads all parameters of {text or '/'}: their names are not known"
                self.remarks.append(Remark(position, said))
                continue
            if not known:
                self.remarks.append(Remark(position, f"parameter: its name is not known: {text}"))
                text = unresolved(text, position)
            default = None
            if function in _GET_PARAMETER:
                for value, _ in self._argument(given, (1, "default"), frame, w, call)[:1]:
                    default = _plain_or_none(value)
            found = FoundParameter(text, default, position)
            if not any(p.name == text and p.default == default for p in self.parameters):
                self.parameters.append(found)


def canonical(name: str) -> str:
    """Return a ROS function's name as people import it: `rospy.topics.Publisher` -> `rospy.Publisher`."""
    name = name.removesuffix(".__init__")
    package, _, function = name.rpartition(".")
    top, _, inner = package.partition(".")
    if name == "rospy.msg.AnyMsg":
        return "rospy.AnyMsg"
    if top == "rospy" and inner in _HOMES:
        return f"rospy.{function}"
    if top in ("actionlib", "message_filters", "tf", "tf2_ros", "diagnostic_updater", "dynamic_reconfigure"):
        return f"{top}.{function}"
    return name


def message_type(value: Value) -> str:
    """Return `package/Type` of the class of a message, service or action; "" where it is not known."""
    match value:
        case External(name) if match := _MESSAGE.fullmatch(name):
            return f"{match['package']}/{match['name']}"
    return ""


def ros_name(value: Value) -> tuple[str, bool]:
    """Return a name as text, expressions that are not known in braces, and whether all of it is known."""
    match value:
        case Const(str(text)):
            return _private(text), True
        case Text() | Unknown():
            return _private(str(text_of(value))), False
    return f"{{{getattr(value, 'name', type(value).__name__)}}}", False


def _private(text: str) -> str:
    return f"~{text[2:]}" if text.startswith("~/") else text


def _plain_or_none(value: Value) -> Any:
    try:
        return plain(value)
    except ValueError:
        return None


def _may_be_ros(callee: ast.expr, scope: Scope) -> bool:
    """Return whether a callee is worth evaluating: a name, a member of something imported, the base's `__init__`."""
    if isinstance(callee, ast.Attribute) and callee.attr == "__init__":
        return True
    root = root_name(callee)
    return root is not None and is_static(root.id, scope)


def _is_super(callee: ast.expr) -> bool:
    match callee:
        case ast.Attribute(value=ast.Call(func=ast.Name(id="super"))):
            return True
    return False


def _is_handed_on(node: ast.expr, module: Module) -> bool:
    """Return whether an expression is an argument of a call (of others than isinstance) or an item of a list."""
    parent = module.parents.get(node)
    if isinstance(parent, ast.keyword):
        return True
    match parent:
        case ast.Call(func=ast.Name(id="isinstance" | "issubclass")) | ast.Call(func=ast.Attribute(attr="partial")):
            return False
        case ast.Call() | ast.List() | ast.Dict():
            return node is not getattr(parent, "func", None)
    return False
