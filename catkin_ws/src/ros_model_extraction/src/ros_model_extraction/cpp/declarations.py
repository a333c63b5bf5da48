"""Source files, places in them, and the variables that declarations declare."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ros_model.language.metamodel import Position
from tree_sitter import Node

from ros_model_extraction.cpp.syntax import (
    arguments_of,
    child_of,
    text,
    type_text,
)


@dataclass(frozen=True)
class File:
    """A source file: its path for people, its tree."""

    shown: str
    root: Node

    def position(self, node: Node) -> Position:
        """Return where a node stands."""
        return Position(self.shown, node.start_point[0] + 1, node.start_point[1] + 1)


@dataclass(frozen=True)
class Place:
    """Where an expression stands: file, function (its definition, None outside), class ("" outside)."""

    file: File
    function: Node | None = None
    owner: str = ""


@dataclass(frozen=True)
class Declared:
    """A variable: its type, what it is made with (one value, or the arguments of a constructor), and where.

    `is_indirect`: it is declared as a pointer (not a smart one) or a reference.
    """

    type: str
    values: tuple[Node, ...]
    place: Place
    is_indirect: bool = False


def declarations(node: Node, place: Place) -> Iterator[tuple[str, Declared]]:
    """Yield the variables that a declaration declares."""
    kind = type_text(node.child_by_field_name("type"))
    for declarator in node.children_by_field_name("declarator"):
        value: tuple[Node, ...] = ()
        name_node = declarator
        if declarator.type == "init_declarator":
            given = declarator.child_by_field_name("value")
            name_node = child_of(declarator, "declarator")
            if given is not None:
                is_list = given.type in ("argument_list", "initializer_list")
                value = tuple(given.named_children) if is_list else (given,)
        elif declarator.type == "function_declarator":
            # `Type name(a, b);` may look like a function: its parameters are then the names of variables.
            listed = declarator.child_by_field_name("parameters")
            children = listed.named_children if listed else []
            value = tuple(child.named_children[0] for child in children if child.named_children)
            name_node = child_of(declarator, "declarator")
        default = node.child_by_field_name("default_value")
        if default is not None:
            is_list = default.type in ("argument_list", "initializer_list")
            value = tuple(default.named_children) if is_list else (default,)
        shown = text(name_node)
        is_indirect = shown.startswith(("*", "&"))
        yield shown.lstrip("*& ").partition("[")[0].strip(), Declared(kind, value, place, is_indirect)


def reset_pointer(node: Node) -> tuple[str, tuple[Node, ...]] | None:
    """Return the smart pointer that a call `pointer.reset(value)` gives a value, and the value."""
    function = node.child_by_field_name("function") if node.type == "call_expression" else None
    if function is None or function.type != "field_expression" or text(child_of(function, "field")) != "reset":
        return None
    arguments = arguments_of(node)
    return (text(child_of(function, "argument")), (arguments[0],)) if arguments else None


def appended_text(node: Node) -> tuple[str, Node] | None:
    """Return the variable that `name += value` or `name.append(value)` makes longer, and the value."""
    if node.type == "assignment_expression" and text(node.child_by_field_name("operator")) == "+=":
        return text(child_of(node, "left")), child_of(node, "right")
    function = node.child_by_field_name("function") if node.type == "call_expression" else None
    arguments = arguments_of(node)
    if function is None or function.type != "field_expression" or len(arguments) != 1:
        return None
    is_append = text(child_of(function, "field")) in ("append", "push_back")
    return (text(child_of(function, "argument")), arguments[0]) if is_append else None


def is_in_branch(node: Node, use: Node) -> bool:
    """Return whether a node stands in a branch or loop that a later use does not stand in."""
    around = set()
    outer: Node | None = use
    while outer is not None:
        around.add(outer.id)
        outer = outer.parent
    outer = node.parent
    while outer is not None and outer.id not in around:
        if outer.type in ("if_statement", "for_statement", "while_statement", "for_range_loop", "switch_statement"):
            return True
        outer = outer.parent
    return False
