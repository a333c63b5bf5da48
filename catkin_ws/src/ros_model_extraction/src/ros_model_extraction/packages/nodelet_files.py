"""The files that describe a package's nodelets, for pluginlib."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position

from ros_model_extraction.io.source_files import read_xml

_BASE = "nodelet::Nodelet"


@dataclass(frozen=True)
class Nodelet:
    """A nodelet as its file describes it.

    Attributes:
        name: what it is loaded by, `package/Class`.
        type: its class, with namespaces.
        library: the target that has it: `lib/libdemo` gives `demo`.
        position: its place in the file.
    """

    name: str
    type: str
    library: str
    position: Position


def nodelets_of(path: Path, shown: str) -> Iterator[Nodelet]:
    """Yield the nodelets of a file; none where it can't be read, which pluginlib would tell.

    Args:
        path: the file.
        shown: its path for people.
    """
    try:
        data = read_xml(path, "a description of plug-ins")
        root = ElementTree.fromstring(data)  # noqa: S314 -- read_xml refuses entities
    except (ModelError, ElementTree.ParseError):
        return
    for library in [root] if root.tag == "library" else root.findall("library"):
        target = (library.get("path") or "").rpartition("/")[2].removesuffix(".so").removeprefix("lib")
        for found in library.findall("class"):
            kind = found.get("type") or ""
            if found.get("base_class_type") == _BASE and kind:
                name = found.get("name") or kind.replace("::", "/")
                yield Nodelet(name, kind, target, Position(shown, _line(data, name, kind), 1))


def _line(data: bytes, *texts: str) -> int:
    places = [data.find(f'"{text}"'.encode()) for text in texts]
    at = next((place for place in places if place >= 0), 0)
    return data.count(b"\n", 0, at) + 1
