"""Reads `.ros` files: from text to the frozen data of packages, with the position of every element."""

from __future__ import annotations

import functools
import re
from typing import TYPE_CHECKING, Any, cast

from ros_model.language.builder import Builder, Field, split_name, text_of
from ros_model.language.metamodel import PortKind
from ros_model.language.packages import (
    PARTS,
    Artifact,
    MessageField,
    Node,
    Package,
    PackageSet,
    ParameterDeclaration,
    PortDeclaration,
    Spec,
    SpecKind,
    with_types_by_value,
)
from ros_model.language.parser import Parser

if TYPE_CHECKING:
    from lark import Token

_TYPE_NAME = re.compile(r"(\w+)[./](?:(?:msg|srv|action)[./])?(.+)", re.DOTALL)


def parse_packages(text: str, file: str = "<text>") -> PackageSet:
    """Return what the text of a `.ros` file says; `file` is its name in positions and errors.

    Raises:
        ModelError: it is not well-formed; says file:line:column, what was expected, near what.
    """
    return cast(PackageSet, _parser().parse(text, file))


def type_name(text: str) -> str:
    """Return the name of a message, service or action as ROS has it: `package/Type` for `package.Type`."""
    match = _TYPE_NAME.fullmatch(text)
    return f"{match[1]}/{match[2]}" if match else text


@functools.cache
def _parser() -> Parser:
    return Parser("ros.lark", "package_set", _Builder())


class _Builder(Builder):
    """Builds a set of packages: one method for each rule of the grammar."""

    def package_set(self, items: list[Any]) -> PackageSet:
        return with_types_by_value(PackageSet(tuple(items[1:]), self.header))

    def package(self, items: list[Any]) -> Package:
        keyword, name, *rest = items
        artifacts = [item for item in rest if isinstance(item, Artifact)]
        fields = self.fields((item for item in rest if isinstance(item, tuple)), keyword)
        dependencies = fields.get("dependencies", ())
        return Package(
            name=text_of(name),
            artifacts=tuple(artifacts),
            specs=fields.get("specs", ()),
            dependencies=tuple(name for external, name in dependencies if not external),
            catkin=keyword.type == "CATKIN_PACKAGE",
            external_dependencies=tuple(name for external, name in dependencies if external),
            repository=fields.get("repository"),
            position=self.at(keyword),
        )

    def repository(self, items: list[Token]) -> Field:
        return "repository", text_of(items[1]), items[0]

    def dependencies(self, items: list[Any]) -> Field:
        return "dependencies", tuple(items[1:]), items[0]

    def package_dependency(self, items: list[Token]) -> tuple[bool, str]:
        return False, text_of(items[0])

    def external_dependency(self, items: list[Token]) -> tuple[bool, str]:
        return True, text_of(items[0])

    # Executables and nodes

    def artifact(self, items: list[Any]) -> Artifact:
        keyword, name, *nodes = items
        return Artifact(text_of(name), tuple(nodes), self.at(keyword))

    def node(self, items: list[Any]) -> Node:
        name, rest = split_name(items)
        fields = self.fields(rest, items[0], needs_name=True, name=name)
        ports = tuple(port for kind in PortKind for port in fields.get(kind.value, ()))
        return Node(fields["name"], ports, fields.get("parameters", ()), self.at(items[0]))

    def port(self, items: list[Any]) -> tuple[dict[str, Any], Token]:
        name, rest = split_name(items)
        return self.fields(rest, items[0], needs_name=True, name=name), items[0]

    def interface(self, items: list[Token]) -> Field:
        return "interface", type_name(text_of(items[1])), items[0]

    def parameters(self, items: list[Any]) -> Field:
        return "parameters", tuple(items[1:]), items[0]

    def parameter(self, items: list[Any]) -> ParameterDeclaration:
        return self.typed_parameter(ParameterDeclaration, items)

    # Message specifications

    def specs(self, items: list[Any]) -> Field:
        return "specs", tuple(items[1:]), items[0]

    def topic_spec(self, items: list[Any]) -> Spec:
        return self._specification(SpecKind.TOPIC, items)

    def service_spec(self, items: list[Any]) -> Spec:
        return self._specification(SpecKind.SERVICE, items)

    def action_spec(self, items: list[Any]) -> Spec:
        return self._specification(SpecKind.ACTION, items)

    def part(self, items: list[Any]) -> tuple[Token, tuple[MessageField, ...]]:
        return items[0], tuple(items[1:])

    def field(self, items: list[Any]) -> MessageField:
        (declared, position), name, constant = items
        return MessageField(declared, text_of(name), constant, position)

    def field_type(self, items: list[Any]) -> Any:
        name, brackets = items
        suffix = "".join(brackets.split()) if brackets else ""
        return type_name(text_of(name)) + suffix, self.at(name)

    def constant(self, items: list[Token]) -> str:
        return text_of(items[0])

    # Helpers

    def port_of(self, kind: PortKind, item: tuple[dict[str, Any], Token]) -> PortDeclaration:
        fields, keyword = item
        return PortDeclaration(
            fields["name"], kind, fields.get("interface", ""), fields.get("namespace"), self.at(keyword)
        )

    def _specification(self, kind: SpecKind, items: list[Any]) -> Spec:
        keyword, name, *rest = items
        found: dict[str, tuple[MessageField, ...]] = {}
        for word, fields in rest:
            if word in found:
                self.refuse(f"second '{word}' in this {keyword}: keep one", word)
            found[word] = fields
        parts = tuple((part, found[part]) for part in PARTS[kind] if part in found)
        return Spec(text_of(name), kind, parts, self.at(keyword))
