"""The findings of a check: what is wrong, where, and by which rule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.errors import ModelError, printable

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.metamodel import Position

ERROR = "error"
WARNING = "warning"

RULES = {
    "syntax": "The file is well-formed.",
    "unreadable": "The file can be read and used.",
    "unknown-reference": "A reference leads to what a .ros model declares.",
    "incomplete-reference": "A reference names package, artifact, node and, for ports and parameters, a name.",
    "executable": "roslaunch finds the executable of each component.",
    "host": "A machine of a launch file is declared, and its address is one that a host can have.",
    "remapping": "A remapped name is one that the source of the node declares.",
    "wrong-kind": "References and connections lead to ports of the right kind.",
    "connection": "A connection has ends, and they are ports of the system.",
    "type-mismatch": "The ends of a connection have one type.",
    "unknown-name": "The names of interfaces and parameters are known; rosmodel extract marks those that are not.",
    "unknown-type": "A message, service or action type is declared by a .ros model or an installed package.",
    "definition-differs": "A specification is that of the installed package.",
    "duplicate": "A name stands once.",
    "two-values": "A parameter has one value.",
    "value": "A value fits its declared type.",
    "settings": "metacontrol.yaml says what its schema allows, and names what is there.",
    "table": "A table has the rows, columns and cells that its family needs.",
    "requirement": "What metacontrol.yaml says of who requires a component changes something.",
    "level": "An expected level is of a quality attribute, and within its range.",
    "name": "A name is one that ROS allows.",
    "substitution": "A value holds nothing that a launch file would evaluate, as $(...), or can't hold.",
    "missing-quality": "A variant has a value for each quality attribute of its siblings.",
}
"""What holds where a rule has found nothing, by its name."""


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


def sorted_by_place(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings in the order of files and lines, without repetitions."""
    unique = dict.fromkeys(findings)
    return tuple(sorted(unique, key=lambda f: (f.position.line, f.position.column) if f.position else (0, 0)))
