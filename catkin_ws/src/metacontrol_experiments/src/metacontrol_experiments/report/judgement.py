"""The first part of a report in Markdown: where ours loses, and which targets are reached."""

from __future__ import annotations

from typing import TYPE_CHECKING

from metacontrol_experiments.report.missions import BASELINE, OURS
from metacontrol_experiments.report.published import Aim
from metacontrol_experiments.report.tables import MEASURES
from metacontrol_experiments.report.text import UNKNOWN, code, count, percent, plain, probability, seconds, table
from metacontrol_experiments.report.verdicts import PUBLISHED, losses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from metacontrol_experiments.report.published import Published, Target
    from metacontrol_experiments.report.tables import Row
    from metacontrol_experiments.report.verdicts import Contest, Verdict

_TABLES = {measure.key: measure.title for measure in MEASURES}


def where_ours_loses(found: Sequence[Contest], published: Published) -> str:
    """Return in which rows ours is behind whom."""
    if not found:
        return f"Nothing is compared: {code(OURS)} or a rival is missing."
    lost = losses(list(found))
    rivals = ", ".join(dict.fromkeys(_rival(contest) for contest in found))
    among = f"{count(len(found), 'comparison')} of {code(OURS)} with {rivals} in the rows of the three tables"
    if not lost:
        return f"Nowhere: in none of {among} is its figure the worse one."
    clear = sum(contest.is_clear for contest in lost) or "none"
    rows = [["table", "row", f"{OURS}, %", "behind", "whose figure is, %", "difference over pairs, points", "chance?"]]
    rows += [_lost(contest, published) for contest in lost]
    return (
        f"It is behind in {len(lost)} of {among}; in {clear} of these by more than chance (corrected p < 0.05; beside "
        f"the published system, whose interval is not known: outside our interval).\n\n{table(rows)}"
    )


def targets(verdicts: Sequence[Verdict], published: Published) -> str:
    """Return each target with the figure that decides."""
    if not verdicts:
        return "None is set."
    reached = sum(verdict.reached is True for verdict in verdicts)
    unknown = sum(verdict.reached is None for verdict in verdicts)
    told = f"{reached} of {len(verdicts)} are reached"
    told += f", {unknown} cannot be told." if unknown else "."
    rows = [["target", "figure", ""]]
    rows += [[_title(verdict.target, published), _figure(verdict), _outcome(verdict)] for verdict in verdicts]
    return f"{told}\n\n{table(rows)}" + _missed_rows(verdicts, published)


def row_title(row: Row, published: Published) -> str:
    """Return the title of a row: the published one, or its name."""
    return plain(published.titles.get(row.measure.key, {}).get(row.name, row.name))


def _lost(contest: Contest, published: Published) -> list[str]:
    row, comparison = contest.row, contest.comparison
    difference = UNKNOWN if comparison is None else percent(comparison.test.difference, signed=True)
    by_chance = "more than chance" if contest.is_clear else "may be chance"
    if comparison is not None:
        pairs = count(comparison.test.difference.count, "pair")
        by_chance += f" ({probability(comparison.corrected)}, {pairs})"
    return [
        row.measure.title,
        row_title(row, published),
        percent(contest.ours),
        _rival(contest),
        percent(contest.theirs),
        difference,
        by_chance,
    ]


def _rival(contest: Contest) -> str:
    return f"the published {OURS.upper()}" if contest.rival == PUBLISHED else code(contest.rival)


def _title(target: Target, published: Published) -> str:
    if target.aim is Aim.BETTER:
        return f"better than {', '.join(map(code, target.managers))} in every row of every table"
    if target.aim is Aim.EXTRA_TIME:
        return f"at most {target.bound:g} s longer to the goal than the baseline on average"
    title = published.titles.get(target.table, {}).get(target.row, target.row)
    what = f"{_TABLES.get(target.table, target.table)}, {title}: "
    match target.aim:
        case Aim.AT_MOST:
            return plain(f"{what}at most {100 * target.bound:g} %")
        case Aim.AT_LEAST:
            return plain(f"{what}at least {100 * target.bound:g} %")
        case Aim.BASELINE_OVER:
            return plain(f"{what}at most 1/{target.bound:g} of the baseline's")
        case _:
            return plain(f"{what}at least {100 * target.bound:g} points above the baseline")


def _figure(verdict: Verdict) -> str:
    if verdict.target.aim is Aim.BETTER and verdict.contests:
        return f"better in {verdict.contests - len(verdict.missed_in)} of {verdict.contests} comparisons"
    if verdict.figure is None:
        return UNKNOWN
    over = f", over {count(verdict.pairs, 'pair')}"
    match verdict.target.aim:
        case Aim.EXTRA_TIME:
            return f"{seconds(verdict.figure, signed=True)} s{over} in which both reach the goal"
        case Aim.BASELINE_OVER:
            return f"{percent(verdict.figure)} % of the baseline's{over}; asked is {100 / verdict.target.bound:.2f} %"
        case Aim.ABOVE_BASELINE:
            return f"{percent(verdict.figure, signed=True)} points{over}"
        case _:
            return f"{percent(verdict.figure)} %"


def _outcome(verdict: Verdict) -> str:
    if verdict.reached is None:
        return f"cannot be told: {verdict.reason}"
    return "reached" if verdict.reached else "**missed**"


def _missed_rows(verdicts: Sequence[Verdict], published: Published) -> str:
    """Return the rows in which ours is not better, of which some may be equal."""
    found = [contest for verdict in verdicts for contest in verdict.missed_in]
    if not found:
        return ""
    told: dict[str, list[str]] = {}
    for contest in found:
        title = f"{contest.row.measure.title.lower()}, {row_title(contest.row, published)}"
        rival = "the baseline" if contest.rival == BASELINE else code(contest.rival)
        told.setdefault(f"{title}: {'worse than' if contest.loses else 'equal to'}", []).append(rival)
    return "\n\nNot better in:\n\n" + "\n".join(f"- {where} {', '.join(who)}" for where, who in told.items())
