"""The files that describe a package's nodelets, for pluginlib."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position

from ros_model_extraction.io.source_files import read_xml
from ros_model_extraction.node_facts import Remark, SourceError

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


def nodelets_of(path: Path, shown: str) -> list[Nodelet]:
    """Return the nodelets of a file.

    Args:
        path: the file.
        shown: its path for people.

    Raises:
        SourceError: it can't be read, as pluginlib can't either.
    """
    try:
        data = read_xml(path, "a description of plug-ins")
        root = ElementTree.fromstring(data)  # noqa: S314 -- read_xml refuses entities
    except ModelError as error:
        line = error.position.line if error.position else 1
        said = error.message.removeprefix("not read: ")
        raise SourceError(Remark(Position(shown, line, 1), f"not read: {said}")) from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the last two: an encoding that is none
        line, column = getattr(error, "position", (1, 0))
        text = f"not read: {error}: save it as well-formed UTF-8 XML"
        raise SourceError(Remark(Position(shown, line, column + 1), text)) from error
    nodelets = []
    for library in [root] if root.tag == "library" else root.findall("library"):
        target = (library.get("path") or "").rpartition("/")[2].removesuffix(".so").removeprefix("lib")
        for found in library.findall("class"):
            kind = found.get("type") or ""
            if found.get("base_class_type") == _BASE and kind:
                name = found.get("name") or kind.replace("::", "/")
                nodelets.append(Nodelet(name, kind, target, Position(shown, _line(data, name, kind), 1)))
    return nodelets


def _line(data: bytes, *texts: str) -> int:
    places = [data.find(f'"{text}"'.encode()) for text in texts]
    at = next((place for place in places if place >= 0), 0)
    return data.count(b"\n", 0, at) + 1
