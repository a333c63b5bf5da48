"""Shows the line of a file at a position, with a caret under the place."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.io.files import read_text

if TYPE_CHECKING:
    from ros_model.language.metamodel import Position

_TOKEN = re.compile(r"""'[^'\n]*'|"[^"\n]*"|[^\s{}(),'"]+|.""")


def caret_lines(position: Position | None) -> list[str]:
    """Return the line of a file at a position, and the caret under it; nothing where that can't be told."""
    return Excerpts().around(position)


class Excerpts:
    """The lines of files, each file read once."""

    def __init__(self) -> None:
        self._files: dict[str, list[str]] = {}

    def around(self, position: Position | None) -> list[str]:
        """Return the line at a position, and the caret under it; nothing where that can't be told."""
        if position is None or position.line < 1:
            return []
        lines = self._of(position.file)
        if position.line > len(lines):
            return []
        line = lines[position.line - 1]
        shown, start = _window(line, position.column - 1)
        match = _TOKEN.match(line, position.column - 1)
        length = max(1, min(len(match[0]) if match else 1, len(shown) - start))
        indent = "".join("\t" if mark == "\t" else " " for mark in shown[:start])
        return [f"    {shown}", f"    {indent}^{'~' * (length - 1)}"]

    def _of(self, file: str) -> list[str]:
        if file not in self._files:
            try:
                self._files[file] = read_text(Path(file)).split("\n")
            except ModelError:
                self._files[file] = []
        return self._files[file]


def _window(line: str, column: int, width: int = 160) -> tuple[str, int]:
    """Return the part of a line that is shown, and where in it the column is."""
    line = "".join(
        mark if mark.isprintable() or mark == "\t" else "\N{REPLACEMENT CHARACTER}" for mark in line.rstrip()
    )
    if len(line) <= width:
        return line, column
    start = max(0, column - width // 2)
    return line[start : start + width], column - start
