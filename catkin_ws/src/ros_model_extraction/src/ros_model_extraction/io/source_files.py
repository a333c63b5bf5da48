"""Reads files of source code and XML, with limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from node_kit.io.input_files import InputFileError, read_bytes
from ros_model.errors import ModelError
from ros_model.language.metamodel import Position

from ros_model_extraction.node_facts import Remark, SourceError

if TYPE_CHECKING:
    from pathlib import Path

MAX_SIZE = 4_000_000
"""Bytes of the largest source file that is read; people write smaller ones, and what is larger is generated data."""


def read_source(path: Path, shown: str) -> bytes:
    """Return the content of a source file.

    Raises:
        SourceError: it can't be read, is too large, or is no text.
    """
    try:
        data = read_bytes(path, MAX_SIZE)
    except InputFileError as error:
        raise SourceError(Remark(Position(shown, 1, 1), f"not read: {error.problem}")) from error
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise SourceError(Remark(Position(shown, line, 1), "not read: it is no text but binary"))
    return data


def read_xml(path: Path, what: str) -> bytes:
    """Return the content of an XML file that declares no entities.

    Args:
        path: the file.
        what: what it is, for messages.

    Raises:
        ModelError: it can't be read, or has a DOCTYPE or entities.
    """
    try:
        data = read_source(path, str(path))
    except SourceError as error:
        raise ModelError(error.remark.text, error.remark.position) from error
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ModelError(f"{what} has no DOCTYPE and no entities: remove them", Position(str(path), 1, 1))
    return data
