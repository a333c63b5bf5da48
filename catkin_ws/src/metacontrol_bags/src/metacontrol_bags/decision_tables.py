"""A decision as tables in a terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from metacontrol_bags.decision import (
    ADVISED,
    EXECUTED,
    FAILED,
    PROPOSED,
    Candidate,
    Cause,
    Decision,
    milliseconds,
)
from metacontrol_bags.printable import all_printable

_STYLES = {EXECUTED: "green", FAILED: "red", PROPOSED: "yellow", ADVISED: "yellow"}


def render(decision: Decision, since: float = 0.0) -> Group:
    """Return a decision as tables.

    Args:
        decision: the decision.
        since: moment from which its time is counted, s of ROS time.
    """
    decision = all_printable(decision)
    return Group(
        _heading(decision, since),
        *_causes(decision.reasons, decision.causes),
        _candidates(decision),
        *_legend(decision),
        _times(decision),
    )


def _heading(decision: Decision, since: float) -> Text:
    target = decision.to_configuration or f"stays with {decision.from_configuration or 'nothing'}"
    change = f"{decision.from_configuration or 'nothing'} -> {target}" if decision.to_configuration else target
    text = Text(f"{decision.objective}: {change}", style="bold")
    text.append(f"  {decision.state}", style=_STYLES.get(decision.state, "cyan"))
    if decision.degraded:
        text.append("  degraded", style="yellow")
    text.append(f"  {decision.id}, at {decision.stamp_planned - since:.2f} s\n", style="dim")
    text.append(decision.explanation, style="")
    return text


def _causes(reasons: Iterable[Cause], words: Iterable[str]) -> list[Any]:
    table = Table("cause", "level", "limit", "passed by", "rules", box=None, header_style="dim")
    rows = 0
    for cause in reasons:
        levels = (
            (f"{cause.level:.3g}", f"{cause.limit:g}", f"{cause.excess:.0%}") if cause.passes_limit else ("", "", "")
        )
        table.add_row(escape(cause.text), *levels, escape(cause.rules))
        rows += 1
    if not rows:  # an older decision
        return [Text(text) for text in words]
    return [table]


def _candidates(decision: Decision) -> Table:
    qualities = sorted({name for candidate in decision.candidates for name in candidate.expected})
    table = Table("", "function design", "utility", *qualities, "why not", header_style="dim")
    for column in (0, *range(2, 3 + len(qualities))):
        table.columns[column].justify = "right"
    for rank, candidate in enumerate(decision.candidates, 1):
        levels = [_level(candidate, name) for name in qualities]
        reason = "[green]chosen[/]" if candidate.chosen else escape(candidate.lost_because)
        table.add_row(str(rank), escape(candidate.name), f"{candidate.utility:g}", *levels, reason)
    return table


def _level(candidate: Candidate, quality: str) -> str:
    """Return the level that counted, and the expected level if it differs."""
    expected = candidate.expected.get(quality)
    counted = candidate.levels.get(quality, expected)
    if expected is None or counted is None:
        return "-"
    return f"{counted:.3g}" if f"{counted:.3g}" == f"{expected:.3g}" else f"{counted:.3g} ({expected:.3g})"


def _legend(decision: Decision) -> list[Text]:
    """Return what a number in brackets is, if there is one."""
    shown = (_level(candidate, name) for candidate in decision.candidates for name in candidate.expected)
    text = "level that counted (level that the model expects)"
    return [Text(text, style="dim")] if any("(" in level for level in shown) else []


def _times(decision: Decision) -> Text:
    parts = [f"{text}" for text in (*decision.corrections, *(f"releases {name}" for name in decision.releases))]
    if decision.stamp_monitored:
        parts.append(f"decided {decision.stamp_planned - decision.stamp_monitored:.2f} s after it was reported")
    parts += [f"analysis {milliseconds(decision.analyse_wall_s)}", f"planning {milliseconds(decision.plan_wall_s)}"]
    if decision.execute_wall_s:
        parts.append(f"execution {decision.execute_wall_s:.2f} s")
    return Text("; ".join(parts) + "\n", style="dim")
