"""The forms in which findings are told: text, JSON, annotations of GitHub, SARIF."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ros_model.errors import printable
from ros_model.findings import ERROR, RULES, WARNING
from ros_model.io.excerpts import Excerpts

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ros_model.findings import Finding
    from ros_model.language.metamodel import Position

_SARIF = "https://json.schemastore.org/sarif-2.1.0.json"
_LEVELS = {ERROR: "error", WARNING: "warning"}


def as_text(findings: Sequence[Finding]) -> str:
    """Return a line for each finding, below it the line of its file, and a caret under the place."""
    lines = Excerpts()
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
