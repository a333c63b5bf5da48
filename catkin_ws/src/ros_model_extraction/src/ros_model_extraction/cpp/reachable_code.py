"""Which code of a program's C++ sources its `main`, or a nodelet's class, can reach: libraries have more than that.

Names decide, not types. So too much may count as reached, but nothing that `main` can call by a name in the sources.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from tree_sitter import Node

from ros_model_extraction.cpp.declarations import File
from ros_model_extraction.cpp.syntax import child_of, class_name, function_name, text, walk

_WORDS = ("identifier", "field_identifier", "type_identifier", "namespace_identifier")
_CLASSES = ("class_specifier", "struct_specifier")
_NAMED_IN_TEXT = re.compile(r"(?<!\w)[A-Za-z_]\w*(?:(?:::|/)[A-Za-z_]\w*)+")
_EXPORT = "PLUGINLIB_"


@dataclass
class _Class:
    """A class: its bases, words of its members' types, and the methods that are called through a base."""

    bases: set[str] = field(default_factory=set)
    words: set[str] = field(default_factory=set)
    virtual: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class _Function:
    id: int
    name: str
    owner: str
    words: frozenset[str]


class ReachableCode:
    """The functions and classes that `main` or a nodelet's class can reach; all of them where there is neither."""

    def __init__(self, files: Sequence[File], nodelet: str = "") -> None:
        """Follow the names from `main`, or from a nodelet's class, and from the objects outside of functions."""
        self._classes: dict[str, _Class] = defaultdict(_Class)
        self._functions: list[_Function] = []
        self._globals: set[str] = set()
        self._aliases: dict[str, set[str]] = defaultdict(set)
        for file in files:
            self._collect(file.root)
        self._start = class_name(nodelet) or "main"
        starts = (function.owner if nodelet else function.name for function in self._functions)
        self._has_start = self._start in starts
        self._words: set[str] = set()
        self._reached: set[int] = set()
        if self._has_start:
            self._follow()
        everything = {function.id for function in self._functions}
        self._unreached = everything - self._reached if self._has_start else set()

    def has_function(self, function: Node) -> bool:
        """Return whether a function, by its definition, can be reached; one within another counts as reached."""
        return function.id not in self._unreached

    def has_class(self, name: str) -> bool:
        """Return whether objects of a class can be reached."""
        return not self._has_start or name not in self._classes or name in self._words

    def _follow(self) -> None:
        self._words = {self._start, *self._globals}
        known = -1
        while known != len(self._words) + len(self._reached):
            known = len(self._words) + len(self._reached)
            for name in self._words & self._aliases.keys():
                self._words |= self._aliases[name]
            for name in self._words & self._classes.keys():
                self._words |= self._classes[name].words | self._classes[name].bases
            for function in self._functions:
                if function.id not in self._reached and self._is_called(function):
                    self._reached.add(function.id)
                    self._words |= function.words

    def _is_called(self, function: _Function) -> bool:
        if function.owner not in self._classes:
            return function.name in self._words
        if function.owner not in self._words:
            return False
        plain = function.name.lstrip("~")
        return plain in self._words or plain == function.owner or self._is_virtual(function.owner, function.name, set())

    def _is_virtual(self, owner: str, name: str, seen: set[str]) -> bool:
        """Return whether a method may be called through a base; whoever has a base of another package calls all."""
        seen.add(owner)
        known = self._classes[owner]
        if name in known.virtual or name.startswith("operator"):
            return True
        return any(
            base not in self._classes or (base not in seen and self._is_virtual(base, name, seen))
            for base in known.bases
        )

    # --- what the sources have

    def _collect(self, root: Node) -> None:
        todo = [(root, "")]
        while todo:
            node, owner = todo.pop()
            if node.type == "function_definition":
                self._function(node, owner)
                continue
            if node.type in _CLASSES and node.child_by_field_name("body"):
                owner = class_name(text(node.child_by_field_name("name"))) or owner
                self._class(node, owner)
            elif node.type in ("type_definition", "alias_declaration"):
                name = text(node.child_by_field_name("declarator") or node.child_by_field_name("name"))
                self._aliases[name] |= _words(child_of(node, "type"))
            elif node.type == "field_declaration" and owner:
                self._member(node, owner)
            elif node.type == "declaration" and not owner and not function_name(node):
                self._globals |= set() if text(node).startswith(_EXPORT) else _made_by(node)
            todo += [(child, owner) for child in node.named_children]

    def _function(self, node: Node, owner: str) -> None:
        qualified = function_name(node)
        before, _, name = qualified.rpartition("::")
        owner = class_name(before) or owner
        if owner and _is_declared_virtual(node):
            self._classes[owner].virtual.add(name)
        self._functions.append(_Function(node.id, name, owner, frozenset(_words(node))))

    def _class(self, node: Node, name: str) -> None:
        if not name:
            return
        known = self._classes[name]
        for child in node.named_children:
            if child.type == "base_class_clause":
                known.bases |= {class_name(text(n)) for n in _bases(child)}

    def _member(self, node: Node, owner: str) -> None:
        known = self._classes[owner]
        if name := function_name(node):
            if _is_declared_virtual(node):
                known.virtual.add(name)
        else:
            known.words |= _words(node)


def _bases(clause: Node) -> Iterable[Node]:
    return (n for n in clause.named_children if n.type in ("type_identifier", "qualified_identifier", "template_type"))


def _is_declared_virtual(node: Node) -> bool:
    head = text(node).partition("{")[0]
    return re.search(r"\b(virtual|override|final)\b", head) is not None


def _made_by(declaration: Node) -> set[str]:
    """Return the names in the type of a global variable and in its value; not in its own name, `Class::member`."""
    declarators = declaration.children_by_field_name("declarator")
    parts = [declaration.child_by_field_name("type"), *(one.child_by_field_name("value") for one in declarators)]
    return {word for part in parts if part is not None for word in _words(part)}


def _words(node: Node) -> set[str]:
    """Return the names in a piece of code, and those in its texts that may name a class to be loaded."""
    found: set[str] = set()
    for inner in walk(node):
        if inner.type in _WORDS:
            found.add(text(inner))
        elif inner.type == "string_content":
            found |= {part for match in _NAMED_IN_TEXT.findall(text(inner)) for part in re.split("::|/", match)}
    return found
