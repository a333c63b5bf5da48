"""The rows of a campaign's table as missions, and which of them make pairs."""

from __future__ import annotations

import json
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

from node_kit.one_line import OneLineError

from metacontrol_experiments.campaign.matrix import Run
from metacontrol_experiments.campaign.progress import PROVENANCE, Status, run_of
from metacontrol_experiments.contingency.contingency import Kind
from metacontrol_experiments.contingency.parsing import ContingencyError, parse_contingency
from metacontrol_experiments.managers.manager import MROS, NONE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

OURS, BASELINE = MROS, NONE
"""The manager that is judged, and the one that others are compared with."""
QUALITIES = ("safety", "energy")

_FIGURES = ("success", "goal_reached", "duration_s", "above_safety", "above_energy", "outcome")


class ReportError(OneLineError, ValueError):
    """There is nothing to report on; the message names file and remedy."""


class Failure(Enum):
    """What goes wrong in a mission beside clutter and power."""

    NONE = "none"
    COMPONENT = "component failure"
    OTHER = "other"


@dataclass(frozen=True)
class Mission:
    """A row of the table.

    Attributes:
        run: what was asked for.
        status: how it ended; figures and summary are there where it is done.
        problem: why it is not.
        figures: by the name of their column; None where they are not known.
        summary: of the mission; empty where there is none.
        provenance: commit, host, versions and when it ended, as far as they are known.
    """

    run: Run
    status: Status = Status.DONE
    problem: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def done(self) -> bool:
        """Whether it was driven to its end."""
        return self.status is Status.DONE

    @property
    def manager(self) -> str:
        """What adapts."""
        return self.run.manager

    @property
    def world(self) -> tuple[object, ...]:
        """Part, cell and repeat: missions of two managers in the same world are a pair."""
        run = self.run
        cell = (run.route, run.initial_configuration, run.clutter, run.power, run.failure)
        return run.part, *cell, run.repeat

    @cached_property
    def failure(self) -> Failure:
        """What goes wrong beside clutter and power."""
        found = Failure.NONE
        for text in self.run.contingencies:
            try:
                kind = parse_contingency(text).kind
            except ContingencyError:
                return Failure.OTHER
            if kind.breaks_component:
                return Failure.COMPONENT
            if kind not in (Kind.CLUTTER, Kind.POWER):
                found = Failure.OTHER
        return found

    def above(self, quality: str) -> float | None:
        """Return the share of its time above the threshold of a quality; None where that is not known."""
        share = self.figures.get(f"above_{quality}")
        return None if share is None else float(share)

    @property
    def success(self) -> bool | None:
        """Whether it succeeded; None where that is not known."""
        found = self.figures.get("success")
        return None if found is None else bool(found)

    @property
    def time_to_goal(self) -> float | None:
        """How long it took to the goal, s; None where it was not reached."""
        duration = self.figures.get("duration_s")
        return float(duration) if duration is not None and self.figures.get("goal_reached") else None


def missions_of(rows: Iterable[Mapping[str, Any]], where: str) -> tuple[Mission, ...]:
    """Return the missions of a table's rows.

    Args:
        rows: column -> value.
        where: the table, for messages.

    Raises:
        ReportError: it is no table of a campaign, or it is empty.
    """
    missions = tuple(_mission(row, f"{where}: row {number}") for number, row in enumerate(rows, start=1))
    if not missions:
        raise ReportError(f"{where}: holds no mission; drive some by: metacontrol campaign")
    return missions


def managers_of(missions: Iterable[Mission]) -> tuple[str, ...]:
    """Return the managers: the baseline, ours, and the others by name."""
    names = {mission.manager for mission in missions}
    first = [name for name in (BASELINE, OURS) if name in names]
    return *first, *sorted(names - set(first))


def pairs_of(missions: Iterable[Mission], first: str, second: str) -> list[tuple[Mission, Mission]]:
    """Return the pairs of two managers: missions that are done, of equal part, cell, repeat and seed."""
    others = {mission.world: mission for mission in missions if mission.manager == second and mission.done}
    found = []
    for mission in missions:
        other = others.get(mission.world)
        if mission.manager == first and mission.done and other is not None and other.run.seed == mission.run.seed:
            found.append((mission, other))
    return found


def of_manager(missions: Iterable[Mission], manager: str) -> list[Mission]:
    """Return the missions of a manager that are done."""
    return [mission for mission in missions if mission.manager == manager and mission.done]


def _mission(row: Mapping[str, Any], where: str) -> Mission:
    """Return the mission of a row.

    Raises:
        ReportError: it is none.
    """
    lacking = [item.name for item in fields(Run) if item.default is MISSING and item.name not in row]
    lacking += [name for name in ("status", *_FIGURES) if name not in row]
    if lacking:
        raise ReportError(
            f"{where}: has no column {', '.join(lacking)}, so it is no table of a campaign: name the "
            "results.parquet that metacontrol campaign left"
        )
    try:
        run = run_of(row)
        summary = json.loads(row.get("summary") or "{}")
        status = Status(row["status"])
        if not isinstance(summary, dict):
            raise TypeError("its summary is no mapping")
    except (AttributeError, ValueError, TypeError, RecursionError) as error:
        raise ReportError(f"{where}: is no result of a run ({error}); drive the campaign again") from error
    return Mission(
        run=run,
        status=status,
        problem=str(row.get("problem") or ""),
        figures={name: row[name] for name in _FIGURES},
        summary=summary,
        provenance={name: str(row[name]) for name in PROVENANCE if row.get(name) is not None},
    )
