"""The series of the single-run pair: from the logs of its runs, else driven anew in lockstep."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.campaign.matrix import DEADLINE_S
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.io.campaign_driver import drive
from metacontrol_experiments.io.report_files import read_log
from metacontrol_experiments.mission.settings import LOCKSTEP, LOG_NAME
from metacontrol_experiments.report.pair import read_series, typical_pair
from metacontrol_experiments.report.report import Single
from metacontrol_experiments.report.text import code, plain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from metacontrol_experiments.report.missions import Mission

_COMPARED = ("outcome", "duration_s", "time_above_threshold")
"""Figures by which a mission that was driven anew is known to be the same."""


def find_pair(missions: Sequence[Mission], table: Path, tell: Callable[[str], None], *, anew: bool) -> Single:
    """Return the pair that stands for all missions.

    Args:
        missions: of the table.
        table: logs of runs are in its folder.
        tell: gets a line before missions are driven.
        anew: whether missions without a log are driven.
    """
    pair = typical_pair(missions)
    if pair is None:
        return Single(told="No pair of the baseline and the meta-controller is there.")
    both = (pair.baseline, pair.ours)
    world, _, _ = pair.ours.run.name.rpartition("/")
    chosen = f"{pair.chosen} It is {code(world)}, repeat {pair.ours.run.repeat}."
    logged = [read_series(log) if (log := read_log(table, mission.run)) else None for mission in both]
    series = [found for found in logged if found is not None]
    if len(series) == len(both):
        return Single(tuple(zip(both, series, strict=True)), chosen)
    if not anew:
        return Single(told="Its runs left no log.")
    tell("driving a pair of missions anew, for the figure of their levels over time")
    found, remarks = [], []
    for mission in both:
        result, files = drive(replace(mission.run, engine=LOCKSTEP), DEADLINE_S, keep_log=True)
        driven = read_series(files.get(LOG_NAME, b"").decode())
        if result.status is not Status.DONE or driven is None or result.summary is None:
            return Single(told=f"{plain(mission.run.name)} could not be driven: {result.attempts[-1].problem}")
        if any(result.summary.get(name) != mission.summary.get(name) for name in _COMPARED):
            remarks.append(mission.manager)
        found.append((replace(mission, summary=result.summary, figures=_figures(mission, result.summary)), driven))
    anew_told = "Driven anew in lockstep"
    if remarks:
        anew_told += f", with other figures than in the table ({', '.join(remarks)})"
    return Single(tuple(found), f"{chosen} {anew_told}.")


def _figures(mission: Mission, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the figures of a mission as its new summary has them."""
    above = {f"above_{name}": share for name, share in summary["time_above_threshold"].items()}
    told = {name: summary[name] for name in ("outcome", "duration_s", "success", "goal_reached")}
    return {**mission.figures, **told, **above}
