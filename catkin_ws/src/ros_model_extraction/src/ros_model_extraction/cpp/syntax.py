"""Nodes of C++ syntax trees: their text, and what functions, calls and types are made of."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tree_sitter import Node

_ESCAPE = re.compile(r"\\(.)")


def walk(root: Node | None) -> Iterator[Node]:
    """Yield a node and all below it, in the order of the text."""
    todo = [root] if root is not None else []
    while todo:
        node = todo.pop()
        yield node
        todo += reversed(node.named_children)


def text(node: Node | None) -> str:
    """Return a node's source on one line."""
    return "" if node is None or node.text is None else " ".join(node.text.decode("utf-8", "replace").split())


def type_text(node: Node | None) -> str:
    """Return a type without spaces, `const` and references."""
    return re.sub(r"\b(const|typename|static|struct|class)\b|[\s&*]", "", text(node))


def arguments_of(node: Node) -> list[Node]:
    """Return the arguments of a call, of `new`, of a declaration."""
    arguments = node.child_by_field_name("arguments")
    return [child for child in arguments.named_children if child.type != "comment"] if arguments else []


def template_arguments(type_name: str) -> list[str]:
    """Return what stands between the outermost `<` and `>` of a type, taken apart at its commas."""
    _, bracket, rest = type_name.partition("<")
    if not bracket:
        return []
    parts, depth = [""], 0
    for character in rest.rstrip().removesuffix(">"):
        depth += {"<": 1, ">": -1}.get(character, 0)
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts]


def parameter_types(function: Node) -> list[str]:
    """Return the types of a function's parameters."""
    return [kind for _, kind, _ in sorted(parameters(function).values(), key=lambda item: item[0])]


def parameters(function: Node) -> dict[str, tuple[int, str, Node | None]]:
    """Return place, type and default of a function's parameters by name."""
    declarator = function
    while declarator is not None and declarator.type not in ("function_declarator", "lambda_expression"):
        following = declarator.child_by_field_name("declarator")
        if following is None:
            return {}
        declarator = following
    if declarator.type == "lambda_expression":
        inner = declarator.child_by_field_name("declarator")
        if inner is None:
            return {}
        declarator = inner
    listed = declarator.child_by_field_name("parameters")
    found = {}
    number = 0
    for node in listed.named_children if listed else ():
        if node.type in ("parameter_declaration", "optional_parameter_declaration"):
            name = text(node.child_by_field_name("declarator")).lstrip("*& ").partition("=")[0].strip()
            found[name or f"#{number}"] = (
                number,
                type_text(node.child_by_field_name("type")),
                node.child_by_field_name("default_value"),
            )
            number += 1
    return found


def function_name(function: Node) -> str:
    """Return the name of the function that a node declares or defines; "" if it does neither."""
    declarator: Node | None = function
    while declarator is not None and declarator.type != "function_declarator":
        declarator = declarator.child_by_field_name("declarator")
    return text(declarator.child_by_field_name("declarator")) if declarator is not None else ""


def class_name(name: str) -> str:
    """Return a class's name without its namespaces and template arguments."""
    return name.partition("<")[0].rpartition("::")[2].strip()


def child_of(node: Node, name: str) -> Node:
    """Return a node's child by the name of its field; the node itself where it has none."""
    return node.child_by_field_name(name) or node


def last_name(name: str) -> str:
    """Return the last part of a qualified name or a member's, without template arguments."""
    return name.partition("<")[0].rpartition("::")[2].rpartition(".")[2].rpartition("->")[2]


def literal_text(literal: str) -> str:
    """Return what a text in quotes says."""
    return _ESCAPE.sub(r"\1", literal.partition('"')[2].removesuffix('"'))
