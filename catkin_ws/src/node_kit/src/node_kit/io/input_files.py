"""Reads files that users name. Whatever is wrong with one becomes an InputFileError, one line with the remedy."""

from __future__ import annotations

import codecs
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Any

from node_kit.one_line import one_line
from node_kit.yaml_text import YamlError, parse_yaml

if TYPE_CHECKING:
    from node_kit.yaml_text import Place

MAX_SIZE = 16_000_000
"""Bytes of the largest file that is read as a text."""

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


class InputFileError(ValueError):
    """A file can't be read; one line with the file, the place in it where there is one, and the remedy.

    Args:
        path: the file.
        problem: what is wrong, and what to do.
        place: line and column; None if the file can't be read at all.
    """

    def __init__(self, path: str | Path, problem: str, place: Place | None = None) -> None:
        where = str(path) if place is None else f"{path}:{place[0]}:{place[1]}"
        super().__init__(one_line(f"{where}: {problem}"))
        self.problem = problem
        self.place = place


def read_bytes(path: str | Path, largest: int = MAX_SIZE) -> bytes:
    """Return the content of a file.

    Args:
        path: the file; any text, even one that no file can have as its name.
        largest: bytes that it may have.

    Raises:
        InputFileError: it is missing, unreadable, too large, or no regular file.
    """
    try:
        about = Path(path).stat()
        if stat.S_ISFIFO(about.st_mode) or stat.S_ISCHR(about.st_mode) or stat.S_ISSOCK(about.st_mode):
            raise InputFileError(path, "is no regular file: give the path of one")
        if about.st_size > largest:
            raise InputFileError(path, f"{about.st_size} bytes are too many ({largest})", (1, 1))
        with Path(path).open("rb") as file:
            content = file.read(largest + 1)  # some files of the kernel say that they have no size, and never end
        if len(content) > largest:
            raise InputFileError(path, f"more than {largest} bytes are too many", (1, 1))
        return content
    except InputFileError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        problem = getattr(error, "strerror", None) or str(error)
        raise InputFileError(path, f"{problem}: check the path") from error


def read_text(path: str | Path, largest: int = MAX_SIZE) -> str:
    """Return the text of a UTF-8 file; a byte order mark at its beginning is left out.

    Raises:
        InputFileError: as `read_bytes`, or it is not UTF-8; then with the place of the first bad byte.
    """
    data = read_bytes(path, largest).removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        good = data[: error.start].decode("utf-8")
        place = (good.count("\n") + 1, len(good) - (good.rfind("\n") + 1) + 1)
        found = "it looks like UTF-16: " if data.startswith(_UTF_16) else ""
        byte = data[error.start]
        raise InputFileError(
            path, f"byte 0x{byte:02x} is not UTF-8: {found}save the file as UTF-8 text", place
        ) from error


def read_yaml(path: str | Path, largest: int = MAX_SIZE) -> Any:
    """Return what a YAML file says.

    Raises:
        InputFileError: as `read_text`, or it is no YAML, or is nested or expanded too far.
    """
    text = read_text(path, largest)
    try:
        return parse_yaml(text)
    except YamlError as error:
        raise InputFileError(path, error.problem, error.place) from error


def is_file(path: str | Path) -> bool:
    """Return whether a path is that of a file; False also where it can't be looked at, or can't be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def real_path(path: str | Path) -> Path:
    """Return a path, absolute and without links. A circle of links stays, and so does what can be no path."""
    try:
        return Path(os.path.realpath(path))
    except ValueError:
        return Path(path)
