"""Finds the namespaces of node handles in a C++ program, as far as its source tells."""

from __future__ import annotations

from collections.abc import Sequence

from tree_sitter import Node

from ros_model_extraction.cpp.declarations import Place
from ros_model_extraction.cpp.program import MAX_DEPTH, MAX_VALUES, Program, as_text
from ros_model_extraction.cpp.syntax import arguments_of, parameters, text
from ros_model_extraction.python.values import Const, Hole, Text, joined

_FUNCTION_HOMES = ("getNodeHandle", "getMTNodeHandle", "getPrivateNodeHandle", "getMTPrivateNodeHandle")
_HANDLES = ("NodeHandle", "ImageTransport")  # the latter has one
_NULL = ("nullptr", "NULL", "0")
_POINTERS = ("_ptr", "Ptr")
_MAX_CALLS = 32
"""Calls of a function by which it is told what they pass."""


class Handles:
    """Finds how node handles are made; if that is unknown, the namespace is a hole."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._found: dict[tuple[str, Place, int], list[Const | Text]] = {}  # as far as variables are filled
        self._fill_count = 0

    def of(self, node: Node | None, place: Place, depth: int = 0) -> list[Const | Text]:
        """Return the namespaces that a node handle may stand for: "" the node's own, "~" its private one."""
        if node is None or depth > MAX_DEPTH:
            return [Const("")] if node is None else [Text((Hole(text(node)),))]
        found = self._handles(node, place, depth)
        return found[:MAX_VALUES] or [Text((Hole(text(node)),))]

    def _handles(self, node: Node, place: Place, depth: int) -> list[Const | Text]:
        match node.type:
            case "call_expression" | "new_expression":
                return self._called(node, place, depth)
            case "compound_literal_expression" | "initializer_list":  # the default `= {"~"}` of a parameter
                return self._constructed((node.child_by_field_name("value") or node).named_children, place, depth)
            case "pointer_expression" | "parenthesized_expression" if node.named_child_count:
                return self.of(node.named_children[-1], place, depth + 1)
        return self._named(text(node).lstrip("*&").removeprefix("this->"), place, depth)

    def _called(self, node: Node, place: Place, depth: int) -> list[Const | Text]:
        called = text(node).lstrip("*&").partition("(")[0].partition("<")[0].removeprefix("new ").strip()
        if called.removeprefix("this->") in _FUNCTION_HOMES:
            return [Const("~" if "Private" in called else "")]
        if called.endswith(("NodeHandle", "make_shared", "make_unique", "ImageTransport")):
            return self._constructed(arguments_of(node), place, depth)
        if called.endswith((*_POINTERS, "std::move")) and arguments_of(node):
            return self.of(arguments_of(node)[0], place, depth + 1)
        return []

    def _named(self, name: str, place: Place, depth: int) -> list[Const | Text]:
        if self._fill_count != self._program.fill_count:
            self._fill_count = self._program.fill_count
            self._found.clear()
        key = name, place, depth
        if key not in self._found:
            self._found[key] = self._find_named(name, place, depth)
        return self._found[key]

    def _find_named(self, name: str, place: Place, depth: int) -> list[Const | Text]:
        found: list[Const | Text] = []
        for declared in self._program.declared(name, place)[:MAX_VALUES]:
            kind = self._program.alias(declared.type, declared.place)
            if not _names_handle(kind) and not any("NodeHandle" in text(value) for value in declared.values):
                continue
            is_handle = kind.endswith(_HANDLES) and not declared.is_indirect  # else it is made elsewhere
            if not is_handle and (not declared.values or text(declared.values[0]) in _NULL):
                continue
            is_made = [v for v in declared.values if v.type in ("call_expression", "new_expression")]
            if len(declared.values) == 1 and is_made:
                found += self.of(is_made[0], declared.place, depth + 1)
            else:
                found += self._constructed(declared.values, declared.place, depth)
        if not found:
            for argument, at in self._program.passed(name, place)[:_MAX_CALLS]:
                found += self.of(argument, at, depth + 1)
        return list(dict.fromkeys(found))

    def _constructed(self, values: Sequence[Node], place: Place, depth: int) -> list[Const | Text]:
        """Return what the arguments of a node handle's constructor make: nothing, a namespace, a parent and one."""
        if not values:
            return [Const("")]
        first = values[0]
        if _is_textual(first) or not self._is_handle(first, place):
            return [value for value, _ in self._program.texts(first, place, depth + 1)]
        parents = self.of(first, place, depth + 1)
        if len(values) == 1:
            return parents
        inner = [value for value, _ in self._program.texts(values[1], place, depth + 1)]
        return [in_namespace(parent, name) for parent in parents for name in inner]

    def _is_handle(self, node: Node, place: Place) -> bool:
        name = text(node).lstrip("*&").removeprefix("this->")
        if "NodeHandle" in name:
            return True
        if any(
            "NodeHandle" in self._program.alias(declared.type, declared.place)
            for declared in self._program.declared(name, place)
        ):
            return True
        parameter = parameters(place.function).get(name) if place.function is not None else None
        return parameter is not None and "NodeHandle" in parameter[1]


def in_namespace(namespace: Const | Text, name: Const | Text) -> Const | Text:
    """Return a name as a node handle of a namespace resolves it."""
    shown = str(as_text(name))
    if shown.startswith(("/", "~")) or namespace == Const(""):
        return name
    between = "" if namespace == Const("~") or not shown else "/"
    return joined([as_text(namespace), Text((between,)), as_text(name)])


def _names_handle(kind: str) -> bool:
    return any(handle in kind for handle in _HANDLES)


def _is_textual(node: Node) -> bool:
    return node.type in ("string_literal", "concatenated_string", "raw_string_literal", "binary_expression")
