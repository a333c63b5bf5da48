"""Calibration: which missions measure the levels of variants, and which levels follow from them.

Every variant drives routes with several seeds, in lockstep and without contingency.

The measured level of safety and energy of a variant is the mean over all its missions of what `definition` makes of
one. The usual level of energy, beside it, is the median over a mission's time. The level of performance is the mean of
the shortest time that any variant took on the route by the time taken, 0 for a goal missed.
"""

from __future__ import annotations

import itertools
import zlib
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from metacontrol_bags.metrics import summarise
from metacontrol_bags.series import held, quantile_of, share_above
from node_kit.one_line import OneLineError

from metacontrol_experiments.campaign.definition import over_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from metacontrol_bags.record import MissionRecord

    from metacontrol_experiments.campaign.definition import Definition, Level

OBSERVED = ("safety", "energy")
TYPICAL = {"energy": "energy_median"}
QUALITIES = (*OBSERVED, "performance", *TYPICAL.values())
"""Qualities that have levels during a mission; quality -> the one that is its usual level; and all.

Only energy has a usual level: it belongs to the variant, while the risk belongs to the place.
"""


_ROUTES = 1000  # seeds that are kept apart for the routes of one seed


class CalibrationError(OneLineError, RuntimeError):
    """Runs cannot be read or are not enough; the message names file and remedy."""


@dataclass(frozen=True)
class Job:
    """A mission to be driven."""

    variant: str
    route: str
    seed: int

    @property
    def world_seed(self) -> int:
        """The seed of everything random: all variants meet the same, but not on another route.

        The floor's jolts are rare. With the same ones on all routes, a few seeds would be a few samples of them.
        """
        return _ROUTES * self.seed + zlib.crc32(self.route.encode()) % _ROUTES

    def __str__(self) -> str:
        return f"{self.variant} on {self.route} with seed {self.seed}"


@dataclass(frozen=True)
class Run:
    """A mission that was driven: a line of the file of runs.

    Attributes:
        variant: name of the configuration.
        route: name.
        seed: of everything random.
        outcome: how the mission ended.
        collisions: contact episodes.
        duration_s: simulated s.
        path_m: length of the way driven, m.
        safety: its level, as `definition` has it.
        safety_mean: mean risk.
        safety_above: share of time above the threshold of safety.
        energy: its level, likewise.
        energy_median: its median over time.
        energy_above: share of time above the threshold of energy.
        ground: what tells the ground from others; empty for the factory.
        definition: of the levels, in words.
        commit: of the code that drove it.
    """

    variant: str
    route: str
    seed: int
    outcome: str
    collisions: int
    duration_s: float
    path_m: float
    safety: float
    safety_mean: float
    safety_above: float
    energy: float
    energy_median: float
    energy_above: float
    ground: str
    definition: str
    commit: str

    @property
    def job(self) -> Job:
        """What it was asked for."""
        return Job(self.variant, self.route, self.seed)

    @property
    def reached(self) -> bool:
        """Whether the goal was reached."""
        return self.outcome == "reached"


def plan(variants: Sequence[str], routes: Sequence[str], seeds: int) -> list[Job]:
    """Return the missions with seeds 1 to `seeds`, seed by seed, so that the first part is of use, too."""
    return [Job(*job) for job in ((v, r, s) for s, v, r in itertools.product(range(1, seeds + 1), variants, routes))]


def run_of(
    job: Job, record: MissionRecord, thresholds: Mapping[str, float], definition: Definition, ground: str, commit: str
) -> Run:
    """Return what a mission's record tells.

    Args:
        job: what was asked for.
        record: of the mission.
        thresholds: level that must not be exceeded, by quality attribute.
        definition: of the levels.
        ground: what tells the ground from others; empty for the factory.
        commit: of the code that drove it.
    """
    summary = summarise(record)
    start, end = record.start_stamp, record.end_stamp
    risk, load = (record.true_quality[name] for name in OBSERVED)
    levels = {name: definition.level(name, *held(record.true_quality[name], start, end)) for name in OBSERVED}
    return Run(
        **asdict(job),
        outcome=summary["outcome"],
        collisions=summary["collisions"],
        duration_s=summary["duration_s"],
        path_m=summary["path_length_m"],
        safety=round(levels["safety"] or 0.0, 4),
        safety_mean=summary["mean_qa"]["safety"],
        safety_above=round(share_above(risk, thresholds["safety"], start, end) or 0.0, 4),
        energy=round(levels["energy"] or 0.0, 4),
        energy_median=round(quantile_of(*held(load, start, end), 0.5) or 0.0, 4),
        energy_above=round(share_above(load, thresholds["energy"], start, end) or 0.0, 4),
        ground=ground,
        definition=definition.describe(OBSERVED),
        commit=commit,
    )


def check_alike(runs: Sequence[Run], ground: str, definition: Definition, where: str) -> None:
    """Check that runs were driven on a ground and measured by a definition.

    Args:
        runs: what is checked.
        ground: what tells it from others; empty for the factory.
        definition: of the levels.
        where: their file, for messages.

    Raises:
        CalibrationError: one was not.
    """
    told = definition.describe(OBSERVED)
    measured = next((run.definition for run in runs if run.definition != told), None)
    if measured is not None:
        raise CalibrationError(f"{where}: holds levels by {measured}, not by {told}: name another by --runs")
    other = next((run.ground for run in runs if run.ground != ground), None)
    if other is not None:
        raise CalibrationError(
            f"{where}: holds runs on {other or 'the factory'}, not on {ground or 'the factory'}: name another by --runs"
        )


def missing_runs(runs: Sequence[Run], variants: Sequence[str]) -> list[Job]:
    """Return the missions that are missing until all variants have driven the same routes with the same seeds."""
    driven = {run.job for run in runs}
    asked = sorted({(run.seed, run.route) for run in runs})
    wanted = [Job(variant, route, seed) for seed, route in asked for variant in variants]
    return [job for job in wanted if job not in driven]


def measure(runs: Sequence[Run]) -> dict[str, dict[str, Level]]:
    """Return variant -> quality attribute -> level, the variants in the order of their names."""
    fastest = {
        route: min((run.duration_s for run in runs if run.route == route and run.reached), default=0.0)
        for route in {run.route for run in runs}
    }
    levels = {}
    for variant in sorted({run.variant for run in runs}):
        own = sorted((run for run in runs if run.variant == variant), key=lambda run: (run.route, run.seed))
        levels[variant] = {
            "safety": over_runs([run.safety for run in own]),
            "energy": over_runs([run.energy for run in own]),
            "energy_median": over_runs([run.energy_median for run in own]),
            "performance": over_runs([fastest[run.route] / run.duration_s if run.reached else 0.0 for run in own]),
        }
    return levels
