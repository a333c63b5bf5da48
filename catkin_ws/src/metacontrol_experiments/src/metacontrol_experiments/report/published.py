"""What a report is compared with: published figures, and targets. They come from one file."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

from node_kit.one_line import OneLineError
from ros_model.project.schema_check import violations

if TYPE_CHECKING:
    from collections.abc import Mapping

_NUMBER = {"type": "number", "title": "a number"}
_TEXT = {"type": "string", "title": "text"}
_ROW = {"type": "object", "title": "a mapping of managers to per cent", "additionalProperties": _NUMBER}
_ROW |= {"required": ["title"], "properties": {"title": _TEXT}}
_TARGET_KEYS = ("at_most", "at_least", "baseline_over", "above_baseline", "extra_time_at_most_s")
_SCHEMA = {
    "type": "object",
    "title": "a mapping with source, tables and targets",
    "additionalProperties": False,
    "required": ["source", "tables", "targets"],
    "properties": {
        "source": _TEXT,
        "tables": {
            "type": "object",
            "title": "a mapping of tables",
            "additionalProperties": {"type": "object", "title": "a mapping of rows", "additionalProperties": _ROW},
        },
        "reconfiguration_s": _NUMBER,
        "reconfigurations_per_run": {"type": "array", "minItems": 2, "maxItems": 2, "items": _NUMBER, "title": "range"},
        "extra_time_s": _NUMBER,
        "targets": {
            "type": "array",
            "title": "a list of targets",
            "items": {
                "type": "object",
                "title": "a target",
                "additionalProperties": False,
                "properties": {
                    "table": _TEXT,
                    "row": _TEXT,
                    **dict.fromkeys(_TARGET_KEYS, _NUMBER),
                    "better_in_every_row_than": {"type": "array", "items": _TEXT, "title": "a list of managers"},
                },
            },
        },
    },
}


class PublishedError(OneLineError, ValueError):
    """The file of published figures makes no sense; the message names the place."""


class Aim(Enum):
    """What a target asks of a figure."""

    AT_MOST = "at_most"
    AT_LEAST = "at_least"
    BASELINE_OVER = "baseline_over"
    ABOVE_BASELINE = "above_baseline"
    EXTRA_TIME = "extra_time_at_most_s"
    BETTER = "better_in_every_row_than"


@dataclass(frozen=True)
class Target:
    """What is to be reached.

    Attributes:
        aim: what it asks.
        bound: share or points (0..1), quotient, or s; 0 where managers are named.
        table: of the figure; "" where it is in none.
        row: of the figure.
        managers: that are to be surpassed.
    """

    aim: Aim
    bound: float = 0.0
    table: str = ""
    row: str = ""
    managers: tuple[str, ...] = ()


@dataclass(frozen=True)
class Published:
    """Published figures and targets.

    Attributes:
        source: of the figures.
        rows: table -> row -> manager -> share or rate (0..1).
        titles: table -> row -> title.
        reconfiguration_s: how long a reconfiguration takes, s; None where it is not published.
        reconfigurations_per_run: least and most; None where they are not published.
        extra_time_s: by which missions take longer than the baseline, s; None where it is not published.
        targets: in the order of the file.
    """

    source: str
    rows: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)
    titles: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    reconfiguration_s: float | None = None
    reconfigurations_per_run: tuple[float, float] | None = None
    extra_time_s: float | None = None
    targets: tuple[Target, ...] = ()

    def figure(self, table: str, row: str, manager: str) -> float | None:
        """Return a published share or rate (0..1); None where none is published."""
        return self.rows.get(table, {}).get(row, {}).get(manager)


def parse_published(content: Any, where: str) -> Published:
    """Return what the content of a YAML file says.

    Args:
        content: as the YAML reader returns it.
        where: the file, for messages.

    Raises:
        PublishedError: it makes no sense.
    """
    for violation in violations(content, _SCHEMA):
        raise PublishedError(f"{where}: {violation}")
    per_run = content.get("reconfigurations_per_run")
    return Published(
        source=content["source"],
        rows={
            table: {
                row: {manager: figure / 100.0 for manager, figure in told.items() if manager != "title"}
                for row, told in rows.items()
            }
            for table, rows in content["tables"].items()
        },
        titles={table: {row: told["title"] for row, told in rows.items()} for table, rows in content["tables"].items()},
        reconfiguration_s=content.get("reconfiguration_s"),
        reconfigurations_per_run=None if per_run is None else (per_run[0], per_run[1]),
        extra_time_s=content.get("extra_time_s"),
        targets=tuple(_target(entry, f"{where}: targets[{number}]") for number, entry in enumerate(content["targets"])),
    )


def _target(entry: dict[str, Any], where: str) -> Target:
    aims = [aim for aim in Aim if aim.value in entry]
    if len(aims) != 1:
        raise PublishedError(f"{where}: give one of {', '.join(aim.value for aim in Aim)}")
    (aim,) = aims
    if aim is Aim.BETTER:
        return Target(aim, managers=tuple(entry[aim.value]))
    bound = float(entry[aim.value])
    if aim is Aim.EXTRA_TIME:
        return Target(aim, bound)
    if "table" not in entry or "row" not in entry:
        raise PublishedError(f"{where}: give its table and its row")
    if aim is not Aim.BASELINE_OVER:
        bound /= 100.0
    return Target(aim, bound, entry["table"], entry["row"])
