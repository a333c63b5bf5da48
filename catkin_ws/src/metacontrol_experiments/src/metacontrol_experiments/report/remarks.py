"""What a reader has to know of a table before believing its figures: what failed, what is missing, what is mixed."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from metacontrol_bags.metrics import DEFAULT_THRESHOLDS

from metacontrol_experiments.report.missions import BASELINE, OURS, QUALITIES, Failure, of_manager, pairs_of
from metacontrol_experiments.report.tables import MEASURES, undisturbed

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from metacontrol_experiments.report.missions import Mission
    from metacontrol_experiments.report.published import Published
    from metacontrol_experiments.report.tables import Analysis

_NAMED = 3
"""How many commits or hosts a line names."""


def broken(missions: Iterable[Mission]) -> list[Mission]:
    """Return the missions that crashed or hung."""
    return [mission for mission in missions if not mission.done]


def if_failures(missions: Sequence[Mission], manager: str) -> tuple[float, float] | None:
    """Return a manager's success rate without its crashed and hung missions, and with them as failures.

    Returns:
        Both rates (0..1), over missions without failure of a component; None where none crashed or hung.
    """
    calm = [mission for mission in undisturbed(missions) if mission.manager == manager]
    lost = len(broken(calm))
    known = [mission.success for mission in calm if mission.done and mission.success is not None]
    if not lost or not known:
        return None
    return sum(known) / len(known), sum(known) / (len(known) + lost)


def doubts(analysis: Analysis, asked: int | None) -> list[str]:
    """Return what weakens the comparison, a line for each.

    Args:
        analysis: of the table.
        asked: how many missions the campaign has; None where that is not known.
    """
    missions = analysis.missions
    found = []
    if asked and asked != len(missions):
        found.append(f"The campaign asks for {asked:,} missions; the table has {len(missions):,}.")
    found += _repeats(analysis)
    found += [line for manager in analysis.managers for line in _unpaired(missions, manager)]
    for what, name in (("commits", "commit"), ("hosts", "host"), ("sets of library versions", "versions")):
        found += _mixed(missions, what, name)
    engines = Counter(mission.run.engine for mission in missions)
    if len(engines) > 1:
        told = ", ".join(f"{count} by {engine}" for engine, count in sorted(engines.items()))
        found.append(f"The table mixes engines: {told}.")
    found += _thresholds(missions)
    return found


def gaps(analysis: Analysis, published: Published) -> list[str]:
    """Return what cannot be told of this table, a line for each."""
    missions, managers = analysis.missions, analysis.managers
    found = []
    if BASELINE not in managers:
        found.append(f"No mission of the baseline ({BASELINE}): no difference to it, no test, no extra time.")
    if OURS not in managers:
        found.append(f"No mission of the meta-controller ({OURS}): nothing is judged.")
    for measure in MEASURES:
        rows = {row.name for row in analysis.rows_of(measure)}
        titles = published.titles.get(measure.key, {})
        absent = [title for row, title in titles.items() if row not in rows]
        if absent:
            found.append(f"{measure.title}: no mission for the published rows {', '.join(absent)}.")
    if not undisturbed(missions) and any(mission.failure is not Failure.NONE for mission in missions):
        found.append("Every mission has a failure beside clutter and power: there are no totals.")
    told = [mission for mission in missions if mission.done]
    if not any(mission.summary.get("cost") for mission in told):
        found.append("CPU and memory of the meta-controller are known of missions on ROS only: there are none here.")
    if told and not any("violations" in mission.summary for mission in told):
        found.append(
            "The summaries do not tell violations one by one, as those of today do: no time to relief, no map."
        )
    for quality in QUALITIES:
        unknown = sum(mission.above(quality) is None for mission in told)
        if unknown:
            found.append(f"{quality} is not known of {unknown} mission(s): its table is without them.")
    return found


def asked_by(campaign: Any) -> int | None:
    """Return how many missions the content of a campaign's file asks for; None where it makes no sense."""
    try:
        return sum(
            len(part["routes"])
            * len(part["initial_configurations"])
            * len(part.get("clutter", [0]))
            * len(part.get("power", [1.0]))
            * len(part.get("failures", {"none": []}))
            * sum(map(int, part["managers"].values()))
            for part in campaign["parts"].values()
        )
    except (KeyError, TypeError, AttributeError, ValueError):
        return None


def _repeats(analysis: Analysis) -> Iterator[str]:
    """Yield what is unequal in the number of repeats: between managers, and between the cells of one."""
    for part in sorted({mission.run.part for mission in analysis.missions}):
        each: dict[str, set[int]] = {}
        for manager in analysis.managers:
            own = [m for m in analysis.missions if m.run.part == part and m.manager == manager]
            cells = Counter(mission.world[:-1] for mission in own)
            if cells:
                each[manager] = set(cells.values())
        cells_of = {
            manager: len({m.world[:-1] for m in analysis.missions if m.run.part == part and m.manager == manager})
            for manager in each
        }
        if len(set(map(frozenset, each.values()))) > 1 or any(len(counts) > 1 for counts in each.values()):
            told = ", ".join(f"{manager} {_range(counts)}" for manager, counts in each.items())
            yield f"Repeats of a cell in part `{part}` are unequal: {told}."
        if len(set(cells_of.values())) > 1:
            told = ", ".join(f"{manager} {count}" for manager, count in cells_of.items())
            yield f"Managers have unequal numbers of cells in part `{part}`: {told}."


def _unpaired(missions: Sequence[Mission], manager: str) -> Iterator[str]:
    """Yield which pairs of a manager and the baseline are missing."""
    own, theirs = of_manager(missions, manager), of_manager(missions, BASELINE)
    if manager == BASELINE or not theirs:
        return
    seeds = {mission.world: mission.run.seed for mission in theirs}
    unlike = sum(seeds.get(mission.world, mission.run.seed) != mission.run.seed for mission in own)
    pairs = len(pairs_of(missions, manager, BASELINE))
    if pairs < min(len(own), len(theirs)):
        because = f"; {unlike} of them have unequal seeds" if unlike else ""
        told = f"`{manager}` ({len(own)} missions) and the baseline ({len(theirs)}) make only {pairs} pairs"
        yield f"{told}: the rest count in the tables, but in no test{because}."


def _mixed(missions: Sequence[Mission], what: str, name: str) -> Iterator[str]:
    counts = Counter(mission.provenance.get(name, "unknown") for mission in missions)
    if len(counts) > 1:
        listed = [f"{value[:12] if name == 'commit' else value} ({count})" for value, count in counts.most_common()]
        more = f" and {len(listed) - _NAMED} more" if len(listed) > _NAMED else ""
        yield f"The table mixes {len(counts)} {what}: {', '.join(listed[:_NAMED])}{more}."


def _thresholds(missions: Sequence[Mission]) -> Iterator[str]:
    """Yield whether thresholds differ between missions, or from the published ones."""
    usual = _listed(DEFAULT_THRESHOLDS)
    told = {_listed(mission.summary["thresholds"]) for mission in missions if "thresholds" in mission.summary}
    if len(told) > 1:
        yield f"Missions have different thresholds: {'; '.join(sorted(told))}."
    elif told and told != {usual}:
        yield f"The thresholds are {told.pop()}; the published figures hold for {usual}."


def _listed(limits: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {limit:g}" for name, limit in sorted(limits.items()))


def _range(counts: set[int]) -> str:
    return str(min(counts)) if len(counts) == 1 else f"{min(counts)} to {max(counts)}"
