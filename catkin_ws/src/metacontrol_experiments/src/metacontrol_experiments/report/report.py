"""A whole report: the analysis of a table, its figures and its Markdown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from metacontrol_experiments.report import figures, judgement, remarks, tables_text
from metacontrol_experiments.report.pair_figure import draw_pair
from metacontrol_experiments.report.statistics import CONFIDENCE, RESAMPLES
from metacontrol_experiments.report.tables import Analysis, analyse
from metacontrol_experiments.report.text import code, count, plain
from metacontrol_experiments.report.verdicts import contests, judge, losses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure
    from metacontrol_bags.record import OccupancyMap

    from metacontrol_experiments.report.missions import Mission
    from metacontrol_experiments.report.pair import Series
    from metacontrol_experiments.report.published import Published
    from metacontrol_experiments.report.verdicts import Contest, Verdict

TITLE = "Results"
FOLDER = "figures"
"""Of the pictures, beside the Markdown file."""
PAIR = "pair"
"""Name of the picture of two missions."""


@dataclass(frozen=True)
class Table:
    """What the report is about.

    Attributes:
        missions: of the table.
        name: of its file.
        campaign: the text of the campaign's file; "" where the table does not have it.
        asked: how many missions the campaign asks for; None where that is not known.
    """

    missions: tuple[Mission, ...]
    name: str
    campaign: str = ""
    asked: int | None = None


@dataclass(frozen=True)
class Single:
    """The single-run pair.

    Attributes:
        missions: baseline and ours with their series; empty where there is no such pair.
        told: where the series come from, or why there are none.
    """

    missions: tuple[tuple[Mission, Series], ...] = ()
    told: str = ""


@dataclass(frozen=True)
class Picture:
    """A figure of the report."""

    name: str
    title: str
    caption: str
    figure: Figure | None


@dataclass(frozen=True)
class Report:
    """Everything that a report says.

    Attributes:
        markdown: text of the page.
        pictures: those that can be drawn.
        losses: where ours is behind.
        verdicts: on the targets.
    """

    markdown: str
    pictures: tuple[Picture, ...]
    losses: tuple[Contest, ...]
    verdicts: tuple[Verdict, ...]


def make_report(table: Table, published: Published, single: Single, floor: OccupancyMap | None) -> Report:
    """Return the report of a table.

    Args:
        table: of a campaign.
        published: figures and targets.
        single: the pair whose levels are drawn over time.
        floor: what stands on the floor; None where it is not known.
    """
    analysis = analyse(table.missions)
    found = contests(analysis, published)
    verdicts = judge(analysis, published, found)
    pictures = _pictures(analysis, published, single, floor)
    gaps = remarks.gaps(analysis, published)
    gaps += [_not_drawn(picture, single) for picture in pictures if picture.figure is None]
    sections = {
        "Where the meta-controller loses": judgement.where_ours_loses(found, published),
        "Targets": judgement.targets(verdicts, published),
        "Before you read on": _listed([*_failed(table.missions), *remarks.doubts(analysis, table.asked), *gaps]),
        "Missions": tables_text.endings(table.missions, analysis.managers),
        "The paper's tables": "\n\n".join(
            [f"Published figures are those of {published.source}.", *tables_text.paper_tables(analysis, published)]
        ),
        "Adaptations": tables_text.activities(analysis, published),
        "Durations of reconfigurations": tables_text.durations(analysis, published),
        "Cost of the meta-controller": tables_text.cost_table(analysis),
        "Figures": "\n\n".join(_shown(picture) for picture in pictures if picture.figure is not None),
        "How it was computed": _method(analysis),
        "The campaign": _campaign(table),
    }
    body = "\n\n".join(f"## {title}\n\n{text}" for title, text in sections.items() if text)
    return Report(
        f"# {TITLE}\n\n{_introduction(table, analysis)}\n\n{body}\n",
        tuple(picture for picture in pictures if picture.figure is not None),
        tuple(losses(found)),
        tuple(verdicts),
    )


def _pictures(
    analysis: Analysis, published: Published, single: Single, floor: OccupancyMap | None
) -> tuple[Picture, ...]:
    pair = draw_pair(single.missions) if single.missions else None
    return (
        Picture(
            PAIR,
            "A pair of missions",
            f"The same world with the baseline above and the meta-controller below. {single.told} The shade begins "
            "with the first contingency on the way.",
            pair,
        ),
        Picture(
            "tradeoff",
            "Violation against duration",
            "Means with 95 % intervals, without component failure; to the left and below is better.",
            figures.trade_off(analysis, published),
        ),
        Picture(
            "distributions",
            "Distributions",
            "Missions without component failure that have at most a share of time above a threshold, or time to the "
            "goal; above and to the left is better.",
            figures.distributions(analysis),
        ),
        Picture(
            "map",
            "Where violations happen",
            "Seconds above the thresholds per mission in cells of the floor, without component failure. What stands "
            "on the floor is grey; clutter is somewhere else in each mission.",
            figures.violation_map(analysis, floor),
        ),
        Picture(
            "reconfigurations",
            "How long reconfigurations take",
            "Boxes are quartiles with the median, whiskers the 5 % and 95 % quantiles; dots are single "
            "reconfigurations, where they are at most 200.",
            figures.reconfigurations(analysis, published),
        ),
    )


def _introduction(table: Table, analysis: Analysis) -> str:
    dates = sorted(filter(None, (mission.provenance.get("ended", "") for mission in table.missions)))
    commits = sorted({mission.provenance.get("commit", "unknown") for mission in table.missions})
    engines = sorted({mission.run.engine for mission in table.missions})
    until = f", driven until {dates[-1]}" if dates else ""
    return (
        f"{count(len(table.missions), 'mission')} (engine {', '.join(engines)}) of the managers "
        f"{', '.join(map(code, analysis.managers))}{until}; code {', '.join(code(commit) for commit in commits)}. Made "
        f"from the table {code(table.name)} by `metacontrol report`."
    )


def _failed(missions: Sequence[Mission]) -> list[str]:
    """Return a line for the missions that crashed or hung, and one for each of them."""
    found = remarks.broken(missions)
    if not found:
        return []
    names = [f"{code(m.run.name)} {m.status.value}: {plain(m.problem)}" for m in found]
    return [f"{count(len(found), 'mission')} crashed or hung; no figure has them:\n" + _listed(names, "  ")]


def _listed(lines: Sequence[str], indent: str = "") -> str:
    return "\n".join(f"{indent}- {line}" for line in lines)


def _shown(picture: Picture) -> str:
    return f"### {picture.title}\n\n![{picture.title}]({FOLDER}/{picture.name}.png)\n\n{picture.caption}"


def _not_drawn(picture: Picture, single: Single) -> str:
    reason = single.told if picture.name == PAIR else "no mission tells what it shows."
    return f"No figure “{picture.title}”: {reason}"


def _method(analysis: Analysis) -> str:
    return _listed(
        [
            "The three tables are about missions without component failure, but for the rows that name one. A share is "
            "the mean of the shares of the missions.",
            f"Intervals have {100 * CONFIDENCE:g} % confidence: Wilson's for rates; for means and ratios percentiles "
            f"of a bootstrap with {RESAMPLES:,} resamples of missions or pairs. Its random numbers are seeded, so "
            "the same table gives the same report.",
            "A pair is two missions of equal part, cell, repeat and seed: the same world, clutter, noise and "
            "contingencies. Successes are tested by McNemar's exact test, shares and times by Wilcoxon's signed-rank "
            "test with zero differences ranked (Pratt), both two-sided.",
            f"Holm's method corrects all {len(analysis.comparisons)} tests of this report together: of each manager "
            "with the baseline, and of the meta-controller with each other manager, in each row of each table and in "
            "the time to the goal.",
            "A12 (Vargha and Delaney) is how probably a mission of the manager is better than one of the baseline; "
            "ties count half.",
            "The meta-controller is behind where its figure in the table is worse, or the mean difference over pairs.",
            "A violation begins when the true level passes the threshold. Relief is when the level keeps the threshold "
            "from then on for 5 s, or to the end of the mission.",
            "Extra time to the goal is over the pairs in which both missions reach the goal.",
        ]
    )


def _campaign(table: Table) -> str:
    if not table.campaign.strip():
        return "The table does not tell which campaign it is of."
    return "\n".join(f"    {line}".rstrip() for line in table.campaign.rstrip().splitlines())
