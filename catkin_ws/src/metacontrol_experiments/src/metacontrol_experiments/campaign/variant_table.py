"""The results of a calibration as Markdown: a table of all variants, and how speed, safety and energy are related.

Every figure is a mean over routes for each seed, then over seeds, with Student's 95 % confidence interval over seeds.
"""

from __future__ import annotations

import math
import re
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

from metacontrol_bags.intervals import Interval, interval

from metacontrol_experiments.campaign.calibration import measure

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from metacontrol_experiments.campaign.calibration import Run

_NAME = re.compile(r"f(\d+)_v(\d+)_r(\d+)(_[bk])?")


@dataclass(frozen=True)
class Figure:
    """A column of the table, and how a mission's value is found."""

    title: str
    digits: int
    of: Callable[[Run], float]


DURATION = Figure("duration, s", 2, lambda run: run.duration_s)
RISK = Figure("risk, level", 3, lambda run: run.safety)
ENERGY = Figure("energy, level", 3, lambda run: run.energy)
FIGURES = (
    DURATION,
    Figure("way, m", 2, lambda run: run.path_m),
    RISK,
    Figure("risk, mean", 3, lambda run: run.safety_mean),
    Figure("risk > 0.6, %", 1, lambda run: 100.0 * run.safety_above),
    ENERGY,
    Figure("energy > 0.62, %", 1, lambda run: 100.0 * run.energy_above),
)


CLAIMS = (
    ("faster variants take less time", DURATION, "v", -1.0),
    ("slower variants run less risk", RISK, "v", 1.0),
    ("higher frequencies cost energy", ENERGY, "f", 1.0),
)
"""Claim, figure, the part of the name in which the variants compared differ, and the sign of the difference."""


def markdown(runs: Sequence[Run]) -> str:
    """Return the tables, with what they are made of."""
    seeds, routes = sorted({run.seed for run in runs}), sorted({run.route for run in runs})
    commits = sorted({run.commit[:12] for run in runs})
    parts = [
        f"{len(runs)} missions in lockstep without contingency: routes {', '.join(routes)}, seeds "
        f"{', '.join(map(str, seeds))}, levels {runs[0].definition}, code {', '.join(commits)}.",
        "\n".join(_variants(runs)),
        "\n".join(_comparisons(runs)),
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _variants(runs: Sequence[Run]) -> Iterable[str]:
    titles = ["variant", "reached", "collisions", *(figure.title for figure in FIGURES), "performance"]
    yield f"| {' | '.join(titles)} |"
    yield "|---" * len(titles) + "|"
    for variant, levels in measure(runs).items():
        own = [run for run in runs if run.variant == variant]
        cells = [
            variant,
            f"{sum(run.reached for run in own)} of {len(own)}",
            str(sum(run.collisions for run in own)),
            *(interval(list(by_seed(own, figure).values())).text(figure.digits) for figure in FIGURES),
            f"{levels['performance'].value:.3f}",
        ]
        yield f"| {' | '.join(cells)} |"


def _comparisons(runs: Sequence[Run]) -> Iterable[str]:
    rows = []
    for claim, figure, part, sign in CLAIMS:
        pairs = neighbours({run.variant for run in runs}, part)
        gains = [difference(runs, figure, *pair) for pair in pairs]
        gains = [Interval(sign * gain.mean, gain.half) for gain in gains]
        if gains:
            clear = sum(gain.mean > gain.half for gain in gains)
            told = f"{clear} of {len(gains)}" if math.isfinite(gains[0].half) else "needs more seeds"
            mean, least = statistics.fmean(gain.mean for gain in gains), min(gains, key=lambda gain: gain.mean)
            cells = (claim, part, f"{mean:.{figure.digits}f}", least.text(figure.digits), told)
            rows.append(f"| {' | '.join(cells)} |")
    if rows:
        yield "| claim | pairs that differ in | mean difference | the least | clear at 95 % |"
        yield "|---|---|---|---|---|"
        yield from rows


def by_seed(runs: Sequence[Run], figure: Figure) -> dict[int, float]:
    """Return the mean over routes for each seed."""
    seeds = sorted({run.seed for run in runs})
    return {seed: statistics.fmean(figure.of(run) for run in runs if run.seed == seed) for seed in seeds}


def difference(runs: Sequence[Run], figure: Figure, low: str, high: str) -> Interval:
    """Return by how much a figure of one variant is above that of another, paired by seeds."""
    one, other = (by_seed([run for run in runs if run.variant == name], figure) for name in (low, high))
    return interval([other[seed] - one[seed] for seed in sorted(one.keys() & other.keys())])


def neighbours(variants: Iterable[str], part: str) -> list[tuple[str, str]]:
    """Return pairs of variants that differ by one step of one part of their names (f, v or r) and in nothing else."""
    known = {match.groups(): name for name in variants if (match := _NAME.fullmatch(name))}
    place = "fvr".index(part)
    pairs = []
    for key, name in sorted(known.items(), key=lambda item: item[1]):
        following = (*key[:place], str(int(key[place]) + 1), *key[place + 1 :])
        if following in known:
            pairs.append((name, known[following]))
    return pairs
