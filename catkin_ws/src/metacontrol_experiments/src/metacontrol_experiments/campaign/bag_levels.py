"""Levels of configurations from the records of bags: which one ran when, and what the observers reported meanwhile."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from metacontrol_bags.words import FunctionGrounding

from metacontrol_experiments.campaign.calibration import CalibrationError
from metacontrol_experiments.campaign.definition import Level, over_runs
from metacontrol_experiments.report.statistics import Estimate, mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from metacontrol_bags.record import MissionRecord, QualityReport

    from metacontrol_experiments.campaign.definition import Definition

LEAST_S = 10.0
"""s for which the levels of a configuration must be known in a bag: its level over a shorter time would be chance."""
HOLD_S = 5.0
"""s for which a reported level holds at most: the reasoner's default `~level_timeout`."""
_UNTIL_THE_END = float("inf")


@dataclass(frozen=True)
class BagLevels:
    """What one bag tells of one configuration.

    Attributes:
        bag: its path.
        configuration: its name.
        seconds: for how long it ran, s.
        levels: of each quality that was observed for long enough.
    """

    bag: str
    configuration: str
    seconds: float
    levels: Mapping[str, float]


@dataclass(frozen=True)
class Measured:
    """The level of a quality of a configuration over all bags.

    Attributes:
        level: over bags, as over missions in simulation.
        estimate: the same with the interval of a bootstrap over bags.
    """

    level: Level
    estimate: Estimate


def levels_of_bag(
    record: MissionRecord,
    bag: str,
    definition: Definition,
    higher_is_better: Mapping[str, bool],
    initial: str = "",
    observed_as: Mapping[str, str] | None = None,
) -> list[BagLevels]:
    """Return what a bag tells of each configuration that ran in it.

    Args:
        record: of the bag.
        bag: its path, for messages.
        definition: of a level.
        higher_is_better: quality -> whether its higher levels are the better ones; other qualities are left out.
        initial: configuration that ran all the time where the bag tells of none.
        observed_as: quality -> the one whose reports tell its level, where that is another one.

    Raises:
        CalibrationError: it tells of no configuration, or of no level; the message has the remedy.
    """
    start, end = record.start_stamp, record.end_stamp
    known = [report for report in record.observed if report.name in higher_is_better]
    if not any(report.level is not None for report in known):
        told = ", ".join(sorted({report.name for report in record.observed})) or "no quality"
        raise CalibrationError(
            f"{bag}: tells no level of {', '.join(higher_is_better)} (but of {told}): record /diagnostics while the "
            "monitor's observers run, or give --namespace"
        )
    times = [(initial, start, end)] if initial and not record.configurations else list(_times(record))
    if not times:
        raise CalibrationError(
            f"{bag}: tells of no configuration: record rosgraph_manipulator/active_configuration, or name the one that "
            "ran by --initial"
        )
    sources = {name: (observed_as or {}).get(name, name) for name in higher_is_better}
    pieces = {name: _pieces([r for r in known if r.name == source], end) for name, source in sources.items()}
    found = []
    for configuration in dict.fromkeys(name for name, _, _ in times):
        spans = [(max(began, start), min(ended, end)) for name, began, ended in times if name == configuration]
        levels = {}
        for quality, (values, begins, ends) in pieces.items():
            durations = np.zeros(len(values))
            for began, ended in spans:
                durations += np.clip(np.minimum(ends, ended) - np.maximum(begins, began), 0.0, None)
            better = higher_is_better[quality]
            level = definition.level(quality, values, durations, higher_is_better=better)
            if level is not None and durations.sum() >= LEAST_S:
                levels[quality] = level
        seconds = sum(max(ended - began, 0.0) for began, ended in spans)
        found.append(BagLevels(bag, configuration, seconds, levels))
    return found


def measure_bags(found: Iterable[BagLevels]) -> dict[str, dict[str, Measured]]:
    """Return configuration -> quality -> level over bags, the configurations in the order of their names."""
    values: defaultdict[str, defaultdict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for entry in found:
        for quality, level in entry.levels.items():
            values[entry.configuration][quality].append(level)
    return {
        configuration: {quality: Measured(over_runs(levels), mean(levels)) for quality, levels in own.items()}
        for configuration, own in sorted(values.items())
    }


def _times(record: MissionRecord) -> Iterator[tuple[str, float, float]]:
    """Yield which configuration was stable, from when to when; those of several functions side by side."""
    running: dict[str, tuple[str, float]] = {}  # function -> configuration and since when
    for stamp, reports in groupby(record.configurations, attrgetter("stamp")):
        stable = {r.function: r.configuration for r in reports if r.state == FunctionGrounding.STABLE}
        for function, (configuration, since) in list(running.items()):
            if stable.get(function) != configuration:
                yield configuration, since, stamp
                del running[function]
        for function, configuration in stable.items():
            if configuration:
                running.setdefault(function, (configuration, stamp))
    for configuration, since in running.values():
        yield configuration, since, _UNTIL_THE_END


def _pieces(reports: Sequence[QualityReport], end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return levels, and from when to when each held: to the next report, but no longer than HOLD_S."""
    ordered = sorted(reports, key=attrgetter("stamp"))
    following = [*(report.stamp for report in ordered[1:]), end]
    kept = [
        (report.level, report.stamp, min(after, report.stamp + HOLD_S))
        for report, after in zip(ordered, following, strict=bool(ordered))
        if report.level is not None
    ]
    levels, begins, ends = np.array(kept, dtype=np.float64).reshape(-1, 3).T
    return levels, begins, ends
