"""What is known of packages: the `.ros` models at hand, and the message types of installed packages."""

from __future__ import annotations

import difflib
import functools
import re
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg

from ros_model.findings import ERROR, WARNING
from ros_model.language.packages import EXTENSIONS, PARTS, MessageField, Node, Package, Spec, SpecKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.metamodel import Reference

BUILTIN_TYPES = frozenset(
    ["bool", "byte", "char", "string", "time", "duration", "float32", "float64", "Header"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)
"""Types of fields that belong to no package; `Header` stands for std_msgs/Header."""

_WORDS = {SpecKind.TOPIC: "message", SpecKind.SERVICE: "service", SpecKind.ACTION: "action"}
_TYPE = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)", re.ASCII)
_OF_AN_ACTION = re.compile(r"(\w+?)(?:Action(?:Goal|Result|Feedback)?|Goal|Result|Feedback)", re.ASCII)


@dataclass(frozen=True)
class Unknown:
    """That something is not known, how that is told, and how bad it is."""

    message: str
    severity: str = ERROR


class Library:
    """Packages by their names; several models may declare parts of one package, and of one node.

    Args:
        packages: what the models at hand declare.
    """

    def __init__(self, packages: Iterable[Package] = ()) -> None:
        self._nodes: dict[str, dict[str, dict[str, Node]]] = {}
        self._specs: dict[str, dict[tuple[SpecKind, str], Spec]] = defaultdict(dict)
        for package in packages:
            artifacts = self._nodes.setdefault(package.name, {})
            for artifact in package.artifacts:
                nodes = artifacts.setdefault(artifact.name, {})
                for node in artifact.nodes:
                    nodes[node.name] = _joined(nodes[node.name], node) if node.name in nodes else node
            for spec in package.specs:
                self._specs[package.name].setdefault((spec.kind, spec.name), spec)

    def __bool__(self) -> bool:
        """Whether any model is at hand."""
        return bool(self._nodes)

    def node(self, reference: Reference) -> Node | Unknown:
        """Return the node that a reference names."""
        artifacts = self._nodes.get(reference.package)
        if artifacts is None:
            if _installed(reference.package):
                return Unknown(
                    f"no .ros model declares the installed package '{reference.package}': extract one, or give its "
                    "folder with --path",
                    WARNING,
                )
            return Unknown(
                f"no .ros model declares package '{reference.package}'{hint(reference.package, self._nodes)}"
            )
        nodes = artifacts.get(reference.artifact)
        if nodes is None:
            where = f"package '{reference.package}' declares no artifact '{reference.artifact}'"
            return Unknown(where + hint(reference.artifact, artifacts))
        if reference.node not in nodes:
            where = f"artifact '{reference.package}.{reference.artifact}' declares no node '{reference.node}'"
            return Unknown(where + hint(reference.node, nodes))
        return nodes[reference.node]

    def missing_type(self, kind: SpecKind, name: str) -> Unknown | None:
        """Return what is wrong with the name of a message, service or action type; None if it is known."""
        match = _TYPE.fullmatch(name)
        if match is None:
            return Unknown(f"'{name}' names no {_WORDS[kind]} type: write package.Type")
        package, plain = match.groups()
        declared = self._specs.get(package, {})
        folder = _installed(package)
        if (kind, plain) in declared or (folder and _is_installed(folder, kind, plain)):
            return None
        if not declared and folder is None:
            text = f"no .ros model or installed package declares the messages of '{package}', so not '{name}' either"
            return Unknown(text, WARNING)
        others = [other for other, word in _WORDS.items() if other is not kind and (other, plain) in declared]
        if others:
            return Unknown(f"'{name}' is a {_WORDS[others[0]]} type, must be a {_WORDS[kind]}")
        return Unknown(
            f"package '{package}' declares no {_WORDS[kind]} '{plain}'"
            + hint(plain, [spec for known_kind, spec in declared if known_kind is kind])
        )

    def knows_package(self, name: str) -> bool:
        """Whether a model declares the package, or it is installed."""
        return name in self._nodes or _installed(name) is not None


def hint(word: str, known: Iterable[str]) -> str:
    """Return `: did you mean ...?` where a known word is almost the one found."""
    found = difflib.get_close_matches(word[:80], [*known], n=1)
    return f": did you mean '{found[0]}'?" if found else ""


def installed_parts(package: str, spec: Spec) -> dict[str, tuple[MessageField, ...]]:
    """Return the fields of an installed message or service by its parts; nothing where there is none."""
    folder = _installed(package)
    if folder is None or spec.kind is SpecKind.ACTION or not _TYPE.fullmatch(f"{package}/{spec.name}"):
        return {}
    path = folder / EXTENSIONS[spec.kind] / f"{spec.name}.{EXTENSIONS[spec.kind]}"
    if not path.is_file():
        return {}
    from genmsg import InvalidMsgSpec, MsgContext
    from genmsg.msg_loader import load_msg_from_file, load_srv_from_file

    context = MsgContext.create_default()
    try:
        if spec.kind is SpecKind.TOPIC:
            loaded = [load_msg_from_file(context, str(path), f"{package}/{spec.name}")]
        else:
            service = load_srv_from_file(context, str(path), f"{package}/{spec.name}")
            loaded = [service.request, service.response]
    except (InvalidMsgSpec, OSError, ValueError):
        return {}
    return {
        part: (
            *(MessageField(constant.type, constant.name, str(constant.val_text)) for constant in found.constants),
            *(MessageField(kind, name) for kind, name in zip(found.types, found.names, strict=True)),
        )
        for part, found in zip(PARTS[spec.kind], loaded, strict=True)
    }


def full_type(declared: str, package: str) -> str:
    """Return the type of a field with its package: `geometry_msgs/Pose[]` for `Pose[]` in geometry_msgs."""
    name, bracket, size = declared.partition("[")
    if name == "Header":
        name = "std_msgs/Header"
    elif "/" not in name and name not in BUILTIN_TYPES:
        name = f"{package}/{name}"
    return name + bracket + size


def _joined(first: Node, second: Node) -> Node:
    """Return a node with what two models declare of it; where both do, the first one's."""
    ports = {(port.kind, port.name) for port in first.ports}
    parameters = {parameter.name for parameter in first.parameters}
    return replace(
        first,
        ports=(*first.ports, *(port for port in second.ports if (port.kind, port.name) not in ports)),
        parameters=(*first.parameters, *(known for known in second.parameters if known.name not in parameters)),
    )


@functools.cache
def _packages() -> rospkg.RosPack:
    return rospkg.RosPack()


def _installed(package: str) -> Path | None:
    try:
        return Path(_packages().get_path(package))
    except rospkg.ResourceNotFound:
        return None


def _is_installed(folder: Path, kind: SpecKind, name: str) -> bool:
    """Whether a package's folder has the type; messages that are made of an action count, too."""
    if (folder / EXTENSIONS[kind] / f"{name}.{EXTENSIONS[kind]}").is_file():
        return True
    if kind is SpecKind.ACTION:
        return (folder / "msg" / f"{name}Action.msg").is_file() or _is_action_of(folder, name.removesuffix("Action"))
    match = _OF_AN_ACTION.fullmatch(name)
    return kind is SpecKind.TOPIC and match is not None and _is_action_of(folder, match[1])


def _is_action_of(folder: Path, name: str) -> bool:
    return (folder / "action" / f"{name}.action").is_file()
