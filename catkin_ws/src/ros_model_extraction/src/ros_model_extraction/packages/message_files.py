"""The message, service and action files of a package."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ros_model.language.metamodel import Position
from ros_model.language.packages import EXTENSIONS, PARTS, MessageField, Spec, SpecKind

from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.node_facts import Remark, SourceError

_FIELD = re.compile(r"(?P<type>[A-Za-z][\w/]*(?:\[\d*\])?)\s+(?P<name>\w+)\s*(?:=(?P<constant>.*))?")
_SEPARATOR = "---"


def read_specs(folder: Path) -> tuple[tuple[Spec, ...], tuple[Remark, ...]]:
    """Return the specifications in a package's msg, srv and action folders, and what in them is wrong."""
    specs: list[Spec] = []
    remarks: list[Remark] = []
    for kind, extension in EXTENSIONS.items():
        for path in sorted((folder / extension).glob(f"*.{extension}")):
            try:
                specs.append(_spec(path, f"{extension}/{path.name}", kind))
            except SourceError as error:
                remarks.append(error.remark)
    return tuple(specs), tuple(remarks)


def _spec(path: Path, shown: str, kind: SpecKind) -> Spec:
    text = read_source(path, shown).decode("utf-8", "replace")
    parts: list[list[MessageField]] = [[] for _ in PARTS[kind]]
    part = 0
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() == _SEPARATOR:
            part += 1
            if part == len(parts):
                raise SourceError(Remark(Position(shown, number, 1), f"not read: more than {len(parts) - 1} '---'"))
        else:
            parts[part] += _field(line, Position(shown, number, 1))
    for fields in parts:
        fields.sort(key=lambda field: field.constant is None)  # constants come first in a message's definition
    return Spec(path.stem, kind, tuple(zip(PARTS[kind], map(tuple, parts), strict=True)), Position(shown, 1, 1))


def _field(line: str, position: Position) -> Iterator[MessageField]:
    code = line.partition("#")[0].strip()
    if not code:
        return
    match = _FIELD.fullmatch(code)
    if match is None:
        raise SourceError(Remark(position, f"not read: {code[:60]!r} is no field: expected a type and a name"))
    constant = match["constant"]
    if constant is not None and match["type"] == "string":
        constant = line.partition("=")[2].strip()  # a text may hold the comment's sign
    yield MessageField(match["type"], match["name"], constant if constant is None else constant.strip())
