"""The middle part of a report in Markdown: the tables, the tests beside them, and what the managers did."""

from __future__ import annotations

import statistics
from collections import Counter
from typing import TYPE_CHECKING

from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.report.adaptations import SPANS, activity, costs, spans, total_cost
from metacontrol_experiments.report.judgement import row_title
from metacontrol_experiments.report.missions import BASELINE, OURS, QUALITIES
from metacontrol_experiments.report.remarks import if_failures
from metacontrol_experiments.report.tables import MEASURES, TOTAL, undisturbed
from metacontrol_experiments.report.text import (
    TIE,
    UNKNOWN,
    code,
    count,
    counts,
    number,
    percent,
    probability,
    seconds,
    table,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from metacontrol_experiments.report.missions import Mission
    from metacontrol_experiments.report.published import Published
    from metacontrol_experiments.report.statistics import Estimate
    from metacontrol_experiments.report.tables import Analysis, Comparison, Measure, Row


def paper_tables(analysis: Analysis, published: Published) -> list[str]:
    """Return a section for each of the paper's tables."""
    return [_section(analysis, measure, published) for measure in MEASURES if measure.published]


def endings(missions: Sequence[Mission], managers: Sequence[str]) -> str:
    """Return how the missions of each manager ended."""
    outcomes = sorted({str(mission.figures.get("outcome")) for mission in missions if mission.done})
    rows = [["manager", "missions", *outcomes, "crashed", "hung"]]
    for manager in managers:
        own = [mission for mission in missions if mission.manager == manager]
        ends = Counter(str(mission.figures.get("outcome")) for mission in own if mission.done)
        failed = Counter(mission.status for mission in own)
        numbers = [len(own), *(ends[name] for name in outcomes), failed[Status.CRASHED], failed[Status.HUNG]]
        rows.append([code(manager), *(f"{number:,}" for number in numbers)])
    told = table(rows)
    for manager in managers:
        found = if_failures(missions, manager)
        if found:
            without, with_them = found
            told += (
                f"\n\nIf those of {code(manager)} that crashed or hung counted as failures, its success without "
                f"component failure would be {percent(with_them)} % instead of {percent(without)} %."
            )
    return told


def activities(analysis: Analysis, published: Published) -> str:
    """Return what the managers did: reconfigurations, violations, relief, time."""
    calm = undisturbed(analysis.missions)
    names = [name for quality in QUALITIES for name in (f"violations of {quality} per mission", "s until relief")]
    titles = ["manager", "reconfigurations per mission", "failed", "collisions per mission", "duration, s", *names]
    rows = [[*titles, "extra time to the goal, s", "pairs"]]
    row = analysis.row("time", TOTAL)
    unrelieved = []
    for manager in analysis.managers:
        found = activity(calm, manager)
        cells = [
            code(manager),
            number(found.reconfigurations),
            str(found.failed),
            number(found.collisions),
            seconds(found.duration),
        ]
        for quality in QUALITIES:
            relief = found.relief.get(quality)
            cells += [number(relief.per_mission if relief else None), seconds(relief.seconds if relief else None)]
            if relief and relief.unrelieved:
                lasting = count(relief.unrelieved, "violation")
                unrelieved.append(f"{lasting} of {quality} of {code(manager)} (of {relief.violations:,})")
        extra = analysis.comparison(row, manager, BASELINE) if row else None
        rows.append([*cells, _difference(extra, seconds), f"{extra.test.difference.count:,}" if extra else UNKNOWN])
    told = f"Missions without component failure.{_published(published)}\n\n{table(rows)}"
    if unrelieved:
        told += f"\n\n{', '.join(unrelieved)} lasted to the end of their missions; they count until then."
    return told


def durations(analysis: Analysis, published: Published) -> str:
    """Return how long reconfigurations took, by manager and trigger."""
    rows = [["manager", "trigger", "reconfigurations", *(f"{span.removesuffix('_s')}, s" for span in SPANS)]]
    for manager in analysis.managers:
        for kind, values in spans(analysis.missions, manager).items():
            total = max(map(len, values.values()))
            rows.append([code(manager), code(kind), f"{total:,}", *(_median(values[span]) for span in SPANS)])
    if len(rows) == 1:
        return "Nothing was reconfigured."
    paper = published.reconfiguration_s
    beside = "" if paper is None else f" Published is {paper:g} s for a reconfiguration."
    return f"Median and 95 % quantile, over all missions.{beside}\n\n{table(rows)}"


def cost_table(analysis: Analysis) -> str:
    """Return CPU and memory of the nodes that missions tell of; "" where none does."""
    rows = [["manager", "node", "CPU, % of a core", "memory, MB"]]
    for manager in analysis.managers:
        found = costs(analysis.missions, manager)
        rows += [[code(manager), code(node), number(cost.cpu), number(cost.memory)] for node, cost in found.items()]
        if len(found) > 1:
            total = total_cost(analysis.missions, manager)
            rows.append([code(manager), "all of these", number(total.cpu), number(total.memory)])
    if len(rows) == 1:
        return ""
    return f"Mean CPU and largest memory of a mission, mean over missions.\n\n{table(rows)}"


def _section(analysis: Analysis, measure: Measure, published: Published) -> str:
    rows = analysis.rows_of(measure)
    if not rows:
        return f"### {measure.title}\n\nNo mission has it."
    managers = [manager for manager in analysis.managers if any(manager in row.figures for row in rows)]
    figures = table([_head(measure, managers), *(_line(row, managers, published) for row in rows)])
    kind = "Wilson's" if measure.is_rate else "bootstrap"
    unit = "rate of missions" if measure.is_rate else "mean share of a mission's time"
    told = f"### {measure.title}\n\nIn %, {unit}, with {kind} 95 % interval.\n\n{figures}"
    return told + _tests(analysis, rows, managers, published)


def _head(measure: Measure, managers: Sequence[str]) -> list[str]:
    return [measure.title.lower(), "published MROS", "published baseline", *map(code, managers), "missions"]


def _line(row: Row, managers: Sequence[str], published: Published) -> list[str]:
    figures: list[Estimate | None] = [row.figures.get(manager) for manager in managers]
    missions = counts([figure.count if figure else 0 for figure in figures])
    paper = (published.figure(row.measure.key, row.name, manager) for manager in (OURS, BASELINE))
    return [row_title(row, published), *map(percent, paper), *map(percent, figures), missions]


def _tests(analysis: Analysis, rows: Sequence[Row], managers: Sequence[str], published: Published) -> str:
    others = [manager for manager in managers if manager != BASELINE]
    lines = [["less the baseline, over pairs", *map(code, others), "pairs"]]
    for row in rows:
        compared = [analysis.comparison(row, manager, BASELINE) for manager in others]
        if any(compared):
            pairs = counts([found.test.difference.count if found else 0 for found in compared])
            lines.append([row_title(row, published), *(_difference(found, percent) for found in compared), pairs])
    if len(lines) == 1:
        return ""
    test = "McNemar's exact test" if rows[0].measure.is_rate else "Wilcoxon's signed-rank test"
    return (
        f"\n\nDifference in points with bootstrap interval; {test}, p corrected by Holm; A12, above 0.5 where better "
        f"than the baseline.\n\n{table(lines)}"
    )


def _difference(found: Comparison | None, unit: Callable[..., str]) -> str:
    if found is None:
        return UNKNOWN
    told = unit(found.test.difference, signed=True)
    return f"{told}; {probability(found.corrected)}; A12{TIE}{found.effect:.2f}"


def _published(published: Published) -> str:
    told = []
    if published.reconfigurations_per_run:
        least, most = published.reconfigurations_per_run
        told.append(f"{least:g} to {most:g} reconfigurations per mission")
    if published.extra_time_s is not None:
        told.append(f"{published.extra_time_s:g} s of extra time")
    return f" Published of MROS: {' and '.join(told)}." if told else ""


def _median(values: Sequence[float]) -> str:
    if not values:
        return UNKNOWN
    ranked = sorted(values)
    return f"{statistics.median(ranked):.2f}, {ranked[min(len(ranked) - 1, int(0.95 * len(ranked)))]:.2f}"
