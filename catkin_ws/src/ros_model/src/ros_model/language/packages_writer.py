"""Writes `.ros` files in one canonical form, the dialect of 2021; what is written reads back as an equal model."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ros_model.language.metamodel import PortKind
from ros_model.language.notation import (
    block,
    comments,
    indented,
    name_text,
    port_sections,
    quoted,
    section,
    sequence,
    typed_fields,
)
from ros_model.language.packages import SpecKind

if TYPE_CHECKING:
    from ros_model.language.packages import (
        Artifact,
        MessageField,
        Node,
        Package,
        PackageSet,
        ParameterDeclaration,
        PortDeclaration,
        Spec,
    )

_PORT_WORDS = {  # in the order of the grammar
    PortKind.SERVICE_SERVER: ("ServiceServers", "ServiceServer", "service"),
    PortKind.PUBLISHER: ("Publishers", "Publisher", "message"),
    PortKind.SUBSCRIBER: ("Subscribers", "Subscriber", "message"),
    PortKind.SERVICE_CLIENT: ("ServiceClients", "ServiceClient", "service"),
    PortKind.ACTION_SERVER: ("ActionServers", "ActionServer", "action"),
    PortKind.ACTION_CLIENT: ("ActionClients", "ActionClient", "action"),
}
_SPEC_WORDS = {SpecKind.TOPIC: "TopicSpec", SpecKind.SERVICE: "ServiceSpec", SpecKind.ACTION: "ActionSpec"}
_NAMESPACES = {"/": "GlobalNamespace", "~": "PrivateNamespace"}
_TYPE_NAME = re.compile(r"^(\w+)/(.+)\Z", re.DOTALL)
_FIELD_TYPE = re.compile(r"(.*?)(\[\d*\])?", re.DOTALL)
_BARE_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LINE = 96  # columns of a specification on one line; with its indentation it may take twelve more
_BARE_CONSTANT = re.compile(r"[-+\w.]+")


def write_packages(packages: PackageSet) -> str:
    """Return the text of a `.ros` file.

    Ports are written by kind. A port whose type nobody knows has none.

    Raises:
        ModelError: a value has no notation in the language (infinite, not a number).
    """
    lines = sequence(map(_package, packages.packages))
    return "\n".join([*comments(packages.header), "PackageSet {", *indented(lines), "}"]) + "\n"


def _package(package: Package) -> list[str]:
    lines = [] if package.repository is None else [f"FromGitRepo {quoted(package.repository)}"]
    lines += section("Specs", "{}", map(_spec, package.specs))
    lines += sequence(map(_artifact, package.artifacts))
    dependencies = [
        *([f"PackageDependency {quoted(name)}"] for name in package.dependencies),
        *([f"ExternalDependency {quoted(name)}"] for name in package.external_dependencies),
    ]
    lines += section("Dependencies", "{}", dependencies)
    word = "CatkinPackage" if package.catkin else "Package"
    return [f"{word} {name_text(package.name)} {{", *indented(lines), "}"]


def _artifact(artifact: Artifact) -> list[str]:
    lines = sequence(map(_node, artifact.nodes))
    return [f"Artifact {name_text(artifact.name)} {{", *indented(lines), "}"]


def _node(node: Node) -> list[str]:
    lines = [f"name {name_text(node.name)}"]
    lines += port_sections(_PORT_WORDS, node.ports, _port)
    lines += section("Parameters", "{}", ([_parameter(parameter)] for parameter in node.parameters))
    return ["Node {", *indented(lines), "}"]


def _port(word: str, interface: str, port: PortDeclaration) -> str:
    fields = [f"name {quoted(port.name)}"]
    if port.type:
        fields.append(f"{interface} {quoted(_dotted(port.type))}")
    return f"{word} {block([*fields, *_namespace(port.namespace)])}"


def _parameter(parameter: ParameterDeclaration) -> str:
    fields = [f"name {quoted(parameter.name)}", *_namespace(parameter.namespace), *typed_fields(parameter)]
    return f"Parameter {block(fields)}"


def _namespace(namespace: str | None) -> list[str]:
    if namespace is None:
        return []
    word = _NAMESPACES.get(namespace[:1])
    path = namespace[1:] if word else namespace
    parts = f"{{ parts {{ {', '.join(map(name_text, path.split('/')))} }} }}" if path else "{ }"
    return [f"namespace {word or 'RelativeNamespace'} {parts}"]


def _spec(spec: Spec) -> list[str]:
    """Return a specification on one line, where that is not too long."""
    start = f"{_SPEC_WORDS[spec.kind]} {name_text(spec.name)}"
    line = f"{start} {block(f'{part} {block(map(_field, fields))}' for part, fields in spec.parts)}"
    if len(line) <= _LINE:
        return [line]
    lines = [line for part, fields in spec.parts for line in (f"{part} {{", *indented(map(_field, fields)), "}")]
    return [f"{start} {{", *indented(lines), "}"]


def _field(field: MessageField) -> str:
    match = _FIELD_TYPE.fullmatch(field.type)
    name, brackets = (match[1], match[2] or "") if match else (field.type, "")
    text = f"{_word(_dotted(name))}{brackets} {_word(field.name)}"
    if field.constant is None:
        return text
    return f"{text}={field.constant if _BARE_CONSTANT.fullmatch(field.constant) else quoted(field.constant)}"


def _word(text: str) -> str:
    """Return a type or name of a field; no word is a keyword there."""
    return text if _BARE_WORD.fullmatch(text) else quoted(text)


def _dotted(type_name: str) -> str:
    """Return a type as the language has it: `package.Type` for `package/Type`, what is neither as it is."""
    return _TYPE_NAME.sub(r"\1.\2", type_name)
