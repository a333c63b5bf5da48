"""What a check finds, and the forms in which it is told: text, JSON, annotations of GitHub, SARIF."""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ros_model.errors import ModelError, printable
from ros_model.files import read_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ros_model.language.metamodel import Position

ERROR = "error"
WARNING = "warning"

RULES = {
    "syntax": "The file is well-formed.",
    "unreadable": "The file can be read and used.",
    "unknown-reference": "A reference leads to what a .ros model declares.",
    "incomplete-reference": "A reference names package, artifact, node and, for ports and parameters, a name.",
    "wrong-kind": "References and connections lead to ports of the right kind.",
    "connection": "A connection has ends, and they are ports of the system.",
    "type-mismatch": "The ends of a connection have one type.",
    "unknown-type": "A message, service or action type is declared by a .ros model or an installed package.",
    "definition-differs": "A specification is that of the installed package.",
    "duplicate": "A name stands once.",
    "two-values": "A parameter has one value.",
    "value": "A value fits its declared type.",
    "settings": "metacontrol.yaml says what its schema allows, and names what is there.",
    "table": "A table has the rows, columns and cells that its family needs.",
    "level": "An expected level is of a quality attribute, and within its range.",
    "name": "A name is one that ROS allows.",
    "substitution": "A value holds nothing that a launch file would evaluate, as $(...), or can't hold.",
    "missing-quality": "A variant has a value for each quality attribute of its siblings.",
}
"""What holds where a rule has found nothing, by its name."""

_TOKEN = re.compile(r"""'[^'\n]*'|"[^"\n]*"|[^\s{}(),'"]+|.""")
_SARIF = "https://json.schemastore.org/sarif-2.1.0.json"
_LEVELS = {ERROR: "error", WARNING: "warning"}


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, and where."""

    message: str
    position: Position | None
    rule: str = "syntax"
    severity: str = ERROR

    def __str__(self) -> str:
        """Return `file:line:column: severity: message`, on one line."""
        place = f"{self.position}: " if self.position else ""
        return printable(f"{place}{self.severity}: {self.message}")

    @classmethod
    def of(cls, error: ModelError) -> Finding:
        """Return the finding that an error is."""
        return cls(error.message, error.position, error.rule or ("syntax" if error.position else "unreadable"))


def as_text(findings: Sequence[Finding]) -> str:
    """Return a line for each finding, below it the line of its file, and a caret under the place."""
    lines = _Lines()
    return "\n".join("\n".join([str(finding), *lines.around(finding.position)]) for finding in findings)


def as_json(findings: Sequence[Finding]) -> str:
    """Return a list of objects with file, line, column, severity, rule and message."""
    return json.dumps([{**_place(f.position), "severity": f.severity, "rule": f.rule, "message": f.message}
                       for f in findings], indent=2)  # fmt: skip


def as_github(findings: Sequence[Finding]) -> str:
    """Return a workflow command for each finding, which GitHub shows as an annotation of the file."""
    return "\n".join(_github(finding) for finding in findings)


def as_sarif(findings: Sequence[Finding]) -> str:
    """Return a log in the Static Analysis Results Interchange Format 2.1.0."""
    rules = [{"id": rule, "shortDescription": {"text": text}} for rule, text in RULES.items()]
    driver = {"name": "rosmodel", "informationUri": "https://wiki.ros.org", "rules": rules}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_sarif_result(finding) for finding in findings],
    }
    return json.dumps({"$schema": _SARIF, "version": "2.1.0", "runs": [run]}, indent=2)


FORMATS: dict[str, Callable[[Sequence[Finding]], str]] = {
    "text": as_text,
    "json": as_json,
    "github": as_github,
    "sarif": as_sarif,
}


def caret_lines(position: Position | None) -> list[str]:
    """Return the line of a file at a position, and the caret under it; nothing where that can't be told."""
    return _Lines().around(position)


class _Lines:
    """The lines of files, each file read once."""

    def __init__(self) -> None:
        self._files: dict[str, list[str]] = {}

    def around(self, position: Position | None) -> list[str]:
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


def _place(position: Position | None) -> dict[str, Any]:
    if position is None:
        return {"file": None, "line": None, "column": None}
    return {"file": position.file, "line": position.line, "column": position.column}


def _github(finding: Finding) -> str:
    where = ""
    if finding.position:
        path = _from_here(finding.position.file) or finding.position.file
        file = _escaped(path).replace(":", "%3A").replace(",", "%2C")
        where = f" file={file},line={finding.position.line},col={finding.position.column},title={finding.rule}"
    return f"::{finding.severity}{where}::{_escaped(finding.message)}"


def _escaped(text: str) -> str:
    return printable(text).replace("%", "%25")


def _sarif_result(finding: Finding) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": finding.rule,
        "ruleIndex": list(RULES).index(finding.rule),
        "level": _LEVELS[finding.severity],
        "message": {"text": finding.message},
    }
    if finding.position:
        region = {"startLine": max(1, finding.position.line), "startColumn": max(1, finding.position.column)}
        location = {"artifactLocation": {"uri": _uri(finding.position.file)}, "region": region}
        result["locations"] = [{"physicalLocation": location}]
    return result


def _from_here(file: str) -> str | None:
    """Return a path relative to the working folder, in which GitHub looks for it; None if it is not below that."""
    path = Path(os.path.abspath(file))
    return path.relative_to(Path.cwd()).as_posix() if path.is_relative_to(Path.cwd()) else None


def _uri(file: str) -> str:
    inside = _from_here(file)
    return Path(os.path.abspath(file)).as_uri() if inside is None else quote(inside)


def sorted_by_place(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings in the order of their files' lines, without those that say the same of the same place."""
    unique = dict.fromkeys(findings)
    return tuple(sorted(unique, key=lambda f: (f.position.line, f.position.column) if f.position else (0, 0)))
