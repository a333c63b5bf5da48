"""Where ours loses, and which targets are reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from metacontrol_experiments.report.missions import BASELINE, OURS
from metacontrol_experiments.report.published import Aim
from metacontrol_experiments.report.statistics import SIGNIFICANT
from metacontrol_experiments.report.tables import TOTAL

if TYPE_CHECKING:
    from metacontrol_experiments.report.published import Published, Target
    from metacontrol_experiments.report.statistics import Estimate
    from metacontrol_experiments.report.tables import Analysis, Comparison, Row

PUBLISHED = "published"
"""Name of the published system in the place of a manager."""


@dataclass(frozen=True)
class Contest:
    """Our figure in a row beside another one.

    Attributes:
        row: of a table.
        rival: a manager, or PUBLISHED.
        ours: our figure.
        theirs: the rival's; a published one has no interval.
        comparison: over pairs; None where there is none.
        wins: whether ours is better, in the table and over pairs.
        loses: whether ours is worse, in the table or over pairs.
    """

    row: Row
    rival: str
    ours: Estimate
    theirs: float
    comparison: Comparison | None
    wins: bool
    loses: bool

    @property
    def is_clear(self) -> bool:
        """Whether the difference is more than chance: by the test of pairs, or by our interval."""
        if self.rival != PUBLISHED:
            return self.comparison is not None and self.comparison.corrected < SIGNIFICANT
        if self.ours.low is None or self.ours.high is None:
            return False
        return not self.ours.low <= self.theirs <= self.ours.high


@dataclass(frozen=True)
class Verdict:
    """What became of a target.

    Attributes:
        target: as it was set.
        reached: None where it cannot be told.
        figure: that decides; None where several do, or none is there.
        pairs: over how many pairs the figure is; 0 where it is that of the table.
        missed_in: rows and rivals in which ours is not better.
        contests: how many rows and rivals count.
        reason: why it cannot be told.
    """

    target: Target
    reached: bool | None
    figure: Estimate | None = None
    pairs: int = 0
    missed_in: tuple[Contest, ...] = ()
    contests: int = 0
    reason: str = ""


def contests(analysis: Analysis, published: Published) -> list[Contest]:
    """Return ours beside the published system and every other manager, in each row of the paper's tables."""
    found = []
    for row in analysis.rows:
        ours = row.figures.get(OURS)
        if ours is None or not row.measure.published:
            continue
        theirs = published.figure(row.measure.key, row.name, OURS)
        if theirs is not None:
            better, worse = row.measure.better(ours.value, theirs), row.measure.better(theirs, ours.value)
            found.append(Contest(row, PUBLISHED, ours, theirs, None, better, worse))
        found += [_contest(analysis, row, rival) for rival in row.figures if rival != OURS]
    return found


def losses(found: list[Contest]) -> list[Contest]:
    """Return the contests that ours loses, clear ones first."""
    return sorted((contest for contest in found if contest.loses), key=lambda contest: not contest.is_clear)


def judge(analysis: Analysis, published: Published, found: list[Contest]) -> list[Verdict]:
    """Return what became of each target."""
    return [_judge(analysis, target, found) for target in published.targets]


def _contest(analysis: Analysis, row: Row, rival: str) -> Contest:
    ours, theirs = row.figures[OURS], row.figures[rival].value
    comparison = analysis.comparison(row, OURS, rival)
    better = [row.measure.better(ours.value, theirs)]
    worse = [row.measure.better(theirs, ours.value)]
    if comparison is not None:
        difference = comparison.test.difference.value
        better.append(row.measure.better(difference, 0.0))
        worse.append(row.measure.better(0.0, difference))
    return Contest(row, rival, ours, theirs, comparison, all(better), any(worse))


def _judge(analysis: Analysis, target: Target, found: list[Contest]) -> Verdict:
    if OURS not in analysis.managers:
        return Verdict(target, None, reason=f"no mission of {OURS}")
    if target.aim is Aim.BETTER:
        return _judge_rows(analysis, target, found)
    row = analysis.row(target.table, target.row) if target.table else analysis.row("time", TOTAL)
    if row is None or OURS not in row.figures:
        return Verdict(target, None, reason="no such mission")
    if target.aim in (Aim.AT_MOST, Aim.AT_LEAST):
        return _against_bound(target, row.figures[OURS], target.bound)
    comparison = analysis.comparison(row, OURS, BASELINE)
    if comparison is None:
        return Verdict(target, None, reason="no pair with the baseline")
    return _against_baseline(target, comparison)


def _against_baseline(target: Target, comparison: Comparison) -> Verdict:
    if target.aim is not Aim.BASELINE_OVER:
        difference = comparison.test.difference
        return _against_bound(target, difference, target.bound, difference.count)
    quotient = comparison.ratio
    if quotient is None:
        return Verdict(target, None, reason="the baseline's figure is 0")
    return _against_bound(target, quotient, 1.0 / target.bound, quotient.count)


def _against_bound(target: Target, figure: Estimate, bound: float, pairs: int = 0) -> Verdict:
    at_least = target.aim in (Aim.AT_LEAST, Aim.ABOVE_BASELINE)
    reached = figure.value >= bound if at_least else figure.value <= bound
    return Verdict(target, reached, figure, pairs)


def _judge_rows(analysis: Analysis, target: Target, found: list[Contest]) -> Verdict:
    absent = [manager for manager in target.managers if manager not in analysis.managers]
    counted = [contest for contest in found if contest.rival in target.managers]
    missed = tuple(contest for contest in counted if not contest.wins)
    if missed:
        return Verdict(target, False, missed_in=missed, contests=len(counted))
    if absent or not counted:
        missing = ", ".join(absent) or "such a manager"
        return Verdict(target, None, contests=len(counted), reason=f"no mission of {missing}")
    return Verdict(target, True, contests=len(counted))
