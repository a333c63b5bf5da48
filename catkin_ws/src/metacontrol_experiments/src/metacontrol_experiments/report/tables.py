"""The paper's three tables and the time to the goal: what each row is about, its figures, and the paired tests."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from metacontrol_experiments.report.missions import (
    BASELINE,
    OURS,
    Failure,
    Mission,
    managers_of,
    of_manager,
    pairs_of,
)
from metacontrol_experiments.report.statistics import Estimate, PairedTest, holm, mcnemar, mean, rate, ratio, wilcoxon

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

TOTAL = "total"
COMPONENT = "component failure"

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Measure:
    """What a table is about.

    Attributes:
        key: of the table.
        title: of the table.
        of: the figure of a mission; None where it has none.
        larger_is_better: how figures compare.
        is_rate: whether it is a success or not; else it is a mean.
        by: what the rows are about.
        published: whether it is one of the paper's three tables.
    """

    key: str
    title: str
    of: Callable[[Mission], float | None]
    larger_is_better: bool = False
    is_rate: bool = False
    by: tuple[str, ...] = ()
    published: bool = True

    def better(self, first: float, second: float) -> bool:
        """Tell whether the first figure is better than the second one, by more than rounding."""
        gain = first - second if self.larger_is_better else second - first
        return gain > _ROUNDING


def _success(mission: Mission) -> float | None:
    return None if mission.success is None else float(mission.success)


MEASURES = (
    Measure("safety", "Time above the safety threshold", lambda mission: mission.above("safety"), by=("clutter",)),
    Measure("energy", "Time above the energy threshold", lambda mission: mission.above("energy"), by=("power",)),
    Measure("success", "Mission success", _success, True, True, ("clutter", "power", "failure")),
    Measure("time", "Time to the goal", lambda mission: mission.time_to_goal, published=False),
)


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        measure: of the table.
        name: of the row, as the published figures have it.
        missions: that it is about, those of all managers, done or not.
        figures: of each manager that has any.
    """

    measure: Measure
    name: str
    missions: tuple[Mission, ...]
    figures: Mapping[str, Estimate]


@dataclass(frozen=True)
class Comparison:
    """Two managers in the same worlds.

    Attributes:
        row: what is compared.
        first: a manager.
        second: another one.
        test: of the pairs.
        corrected: p after Holm's correction for all tests of the report.
        ratio: of the sums of figures, first by second; None where the second one's is 0.
    """

    row: Row
    first: str
    second: str
    test: PairedTest
    corrected: float = 1.0
    ratio: Estimate | None = None

    @property
    def effect(self) -> float:
        """A12, turned so that more than 0.5 means that the first manager is better."""
        found = self.test.superiority
        return found if self.row.measure.larger_is_better else 1.0 - found


@dataclass(frozen=True)
class Analysis:
    """All tables of a campaign.

    Attributes:
        missions: of all managers.
        managers: in the order of columns.
        rows: of all tables, in their order.
        comparisons: by table, row and both managers.
    """

    missions: tuple[Mission, ...]
    managers: tuple[str, ...]
    rows: tuple[Row, ...]
    comparisons: Mapping[tuple[str, str, str, str], Comparison]

    def rows_of(self, measure: Measure) -> list[Row]:
        """Return the rows of a table."""
        return [row for row in self.rows if row.measure is measure]

    def row(self, table: str, name: str) -> Row | None:
        """Return a row; None where the campaign has no such missions."""
        return next((row for row in self.rows if (row.measure.key, row.name) == (table, name)), None)

    def comparison(self, row: Row, first: str, second: str) -> Comparison | None:
        """Return the comparison of two managers; None where they have no pair, or were not compared."""
        return self.comparisons.get((row.measure.key, row.name, first, second))


def analyse(missions: Sequence[Mission]) -> Analysis:
    """Return all tables of a campaign, with every test corrected for all others."""
    managers = managers_of(missions)
    rows = tuple(
        Row(measure, name, tuple(chosen), figures)
        for measure in MEASURES
        for name, chosen in _rows(measure, missions).items()
        if (figures := _figures(measure, chosen, managers))
    )
    compared = [
        found
        for row in rows
        for first, second in _contests(managers)
        if (found := _compare(row, first, second)) is not None
    ]
    corrected = holm([found.test.p for found in compared])
    return Analysis(
        tuple(missions),
        managers,
        rows,
        {
            (found.row.measure.key, found.row.name, found.first, found.second): replace(found, corrected=p)
            for found, p in zip(compared, corrected, strict=True)
        },
    )


def undisturbed(missions: Iterable[Mission]) -> list[Mission]:
    """Return the missions in which nothing but clutter and power is wrong, as in the paper's totals."""
    return [mission for mission in missions if mission.failure is Failure.NONE]


def _rows(measure: Measure, missions: Sequence[Mission]) -> dict[str, list[Mission]]:
    """Return the missions of each row by its name, in order; the total comes last."""
    calm, found = undisturbed(missions), {}
    if "clutter" in measure.by:
        for clutter in sorted({mission.run.clutter for mission in calm}):
            found[f"clutter {clutter}"] = [mission for mission in calm if mission.run.clutter == clutter]
    if "power" in measure.by:
        for power in sorted({mission.run.power for mission in calm}):
            found[f"power {power:g}"] = [mission for mission in calm if mission.run.power == power]
    if "failure" in measure.by:
        found |= _failures(missions)
    return found | {TOTAL: calm}


def _failures(missions: Sequence[Mission]) -> dict[str, list[Mission]]:
    """Return the rows of missions with failures: those of components together, then each kind of failure."""
    broken = [mission for mission in missions if mission.failure is Failure.COMPONENT]
    other = [mission for mission in missions if mission.failure is Failure.OTHER]
    kinds = sorted({mission.run.failure for mission in broken})
    found = {COMPONENT: broken}
    if len(kinds) > 1:
        found |= {f"{COMPONENT}: {kind}": [m for m in broken if m.run.failure == kind] for kind in kinds}
    return found | {
        f"failure: {kind}": [m for m in other if m.run.failure == kind]
        for kind in sorted({mission.run.failure for mission in other})
    }


def _figures(measure: Measure, missions: Iterable[Mission], managers: Iterable[str]) -> dict[str, Estimate]:
    chosen, found = list(missions), {}
    for manager in managers:
        values = [value for mission in of_manager(chosen, manager) if (value := measure.of(mission)) is not None]
        if values:
            found[manager] = rate([bool(value) for value in values]) if measure.is_rate else mean(values)
    return found


def _contests(managers: Sequence[str]) -> list[tuple[str, str]]:
    """Return which managers are compared: each with the baseline, and ours with each other."""
    found = [(manager, BASELINE) for manager in managers if manager != BASELINE and BASELINE in managers]
    return found + [(OURS, manager) for manager in managers if OURS in managers and manager not in (OURS, BASELINE)]


def _compare(row: Row, first: str, second: str) -> Comparison | None:
    of = row.measure.of
    pairs = [
        (one, other)
        for mission, partner in pairs_of(row.missions, first, second)
        if (one := of(mission)) is not None and (other := of(partner)) is not None
    ]
    if not pairs:
        return None
    ones, others = [one for one, _ in pairs], [other for _, other in pairs]
    if row.measure.is_rate:
        test = mcnemar([bool(one) for one in ones], [bool(other) for other in others])
        return Comparison(row, first, second, test)
    return Comparison(row, first, second, wilcoxon(ones, others), ratio=ratio(ones, others))
