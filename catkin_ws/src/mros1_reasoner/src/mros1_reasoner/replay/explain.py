"""Decisions in words and tables for people, pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from mros1_reasoner.planning.decision import ADVISED, EXECUTED, FAILED, PROPOSED, Cause
from mros1_reasoner.planning.record import CandidateRecord, DecisionRecord

_IN_LINE = 4  # candidates that a log line names
_STYLES = {EXECUTED: "green", FAILED: "red", PROPOSED: "yellow", ADVISED: "yellow"}
_STATES = {
    ADVISED: "dry run, nobody is asked",
    PROPOSED: "waits for approval",
}


def line(record: DecisionRecord) -> str:
    """Return a decision as one line for a log: what, by how much, by which rule, the ranking, durations."""
    parts = [record.explanation]
    rules = list(dict.fromkeys(cause.rules for cause in record.reasons if cause.rules))
    excesses = [f"{cause.quality} by {cause.excess:.0%}" for cause in record.reasons if cause.quality]
    if excesses:
        parts.append(f"limit passed: {', '.join(excesses)}")
    if rules:
        parts.append(f"rules: {', '.join(rules)}")
    parts += [text for text in record.corrections if text not in record.explanation]
    if record.candidates:
        parts.append(f"candidates: {_ranking(record)}")
    parts.append(f"analysed in {_milliseconds(record.analyse_wall_s)}, planned in {_milliseconds(record.plan_wall_s)}")
    if record.state in _STATES:
        parts.insert(0, _STATES[record.state])
    return "; ".join(parts)


def render(record: DecisionRecord, since: float = 0.0) -> Group:
    """Return a decision as tables.

    Args:
        record: the decision.
        since: moment from which its time is counted, s of ROS time.
    """
    return Group(_heading(record, since), *_causes(record.reasons, record.causes), _candidates(record), _times(record))


def _ranking(record: DecisionRecord) -> str:
    texts = []
    for rank, candidate in enumerate(record.candidates[:_IN_LINE], 1):
        reason = "chosen" if candidate.chosen else candidate.lost_because
        texts.append(f"{rank} {candidate.name} ({candidate.utility:g}{f': {reason}' if reason else ''})")
    more = len(record.candidates) - _IN_LINE
    return ", ".join(texts) + (f", and {more} more" if more > 0 else "")


def _heading(record: DecisionRecord, since: float) -> Text:
    target = record.to_configuration or f"stays with {record.from_configuration or 'nothing'}"
    change = f"{record.from_configuration or 'nothing'} -> {target}" if record.to_configuration else target
    text = Text(f"{record.objective}: {change}", style="bold")
    text.append(f"  {record.state}", style=_STYLES.get(record.state, "cyan"))
    if record.degraded:
        text.append("  degraded", style="yellow")
    text.append(f"  {record.id}, at {record.stamp_planned - since:.2f} s\n", style="dim")
    text.append(record.explanation, style="")
    return text


def _causes(reasons: Iterable[Cause], words: Iterable[str]) -> list[Any]:
    table = Table("cause", "level", "limit", "passed by", "rules", box=None, header_style="dim")
    rows = 0
    for cause in reasons:
        levels = (f"{cause.level:.3g}", f"{cause.limit:g}", f"{cause.excess:.0%}") if cause.quality else ("", "", "")
        table.add_row(escape(cause.text), *levels, escape(cause.rules))
        rows += 1
    if not rows:  # an older decision
        return [Text(text) for text in words]
    return [table]


def _candidates(record: DecisionRecord) -> Table:
    qualities = sorted({name for candidate in record.candidates for name, _ in candidate.expected})
    table = Table("", "function design", "utility", *qualities, "why not", header_style="dim")
    for column in (0, *range(2, 3 + len(qualities))):
        table.columns[column].justify = "right"
    for rank, candidate in enumerate(record.candidates, 1):
        levels = [_level(candidate, name) for name in qualities]
        reason = "[green]chosen[/]" if candidate.chosen else escape(candidate.lost_because)
        table.add_row(str(rank), escape(candidate.name), f"{candidate.utility:g}", *levels, reason)
    return table


def _level(candidate: CandidateRecord, quality: str) -> str:
    """Return the level that counted, and where another one was expected, that too."""
    expected = dict(candidate.expected).get(quality)
    counted = dict(candidate.levels).get(quality, expected)
    if expected is None or counted is None:
        return "-"
    return f"{counted:.3g}" if f"{counted:.3g}" == f"{expected:.3g}" else f"{counted:.3g} ({expected:.3g})"


def _times(record: DecisionRecord) -> Text:
    parts = [f"{text}" for text in (*record.corrections, *(f"releases {name}" for name in record.releases))]
    if record.stamp_monitored:
        parts.append(f"decided {record.stamp_planned - record.stamp_monitored:.2f} s after it was reported")
    parts += [f"analysis {_milliseconds(record.analyse_wall_s)}", f"planning {_milliseconds(record.plan_wall_s)}"]
    if record.execute_wall_s:
        parts.append(f"execution {record.execute_wall_s:.2f} s")
    return Text("; ".join(parts) + "\n", style="dim")


def _milliseconds(duration: float) -> str:
    return f"{duration * 1000:.1f} ms"
