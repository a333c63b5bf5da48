"""Compare the figures of the same missions on ROS and in lockstep."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_bags.intervals import CONFIDENCE, Interval, interval

from metacontrol_experiments.mission.settings import LOCKSTEP, ROS
from metacontrol_experiments.report.missions import ReportError, managers_of
from metacontrol_experiments.report.text import code, count, plain, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from metacontrol_experiments.report.missions import Mission


@dataclass(frozen=True)
class Pair:
    """The same mission on both engines."""

    ros: Mission
    lockstep: Mission

    @property
    def manager(self) -> str:
        """What adapts."""
        return self.ros.manager

    @property
    def same_changes(self) -> bool:
        """Whether both deployed the same configurations in the same order."""
        return _chosen(self.ros.summary) == _chosen(self.lockstep.summary)


def _delay(name: str) -> Callable[[Mapping[str, Any]], float | None]:
    """Return a figure: the mean of a delay over a mission's reconfigurations."""

    def of(summary: Mapping[str, Any]) -> float | None:
        known = [change[name] for change in summary["reconfigurations"] if change[name] is not None]
        return statistics.fmean(known) if known else None

    return of


FIGURES: dict[str, Callable[[Mapping[str, Any]], float | None]] = {
    "goal reached": lambda summary: float(summary["goal_reached"]),
    "duration, s": lambda summary: summary["duration_s"],
    "way, m": lambda summary: summary["path_length_m"],
    "collisions": lambda summary: summary["collisions"],
    "mean risk": lambda summary: summary["mean_qa"]["safety"],
    "share of time above the safety threshold": lambda summary: summary["time_above_threshold"]["safety"],
    "mean energy": lambda summary: summary["mean_qa"]["energy"],
    "share of time above the energy threshold": lambda summary: summary["time_above_threshold"]["energy"],
    "reconfigurations": lambda summary: float(len(summary["reconfigurations"])),
    "detect, s": _delay("detect_s"),
    "decide, s": _delay("decide_s"),
    "execute, s": _delay("execute_s"),
    "control periods missed": lambda summary: summary["control"]["periods_missed"],
}
"""What is compared: title, and how it is found in a summary."""


@dataclass(frozen=True)
class Row:
    """A figure over missions; the difference is lockstep less ROS, paired by mission."""

    title: str
    missions: int
    ros: Interval
    lockstep: Interval
    difference: Interval

    @property
    def known(self) -> bool:
        """Whether there are enough missions to tell a difference."""
        return math.isfinite(self.difference.half)

    @property
    def differs(self) -> bool:
        """Whether the difference is more than chance, at 95 %."""
        return abs(self.difference.mean) > self.difference.half

    @property
    def verdict(self) -> str:
        """The difference in words."""
        if not self.known:
            return "needs more missions"
        if not self.differs:
            return "no difference seen"
        return f"differs by {self.difference.mean / self.ros.mean:+.1%}" if self.ros.mean else "differs"


def pairs_of_engines(missions: Iterable[Mission]) -> list[Pair]:
    """Return the missions that were driven to their end on both engines.

    Raises:
        ReportError: there is none.
    """
    done = [mission for mission in missions if mission.done]
    found = {(*mission.world, mission.manager, mission.run.seed, mission.run.engine): mission for mission in done}
    pairs = [
        Pair(found[*key, ROS], one)
        for (*key, engine), one in found.items()
        if engine == LOCKSTEP and (*key, ROS) in found
    ]
    if not pairs:
        told = ", ".join(f"{number} by {engine}" for engine, number in Counter(m.run.engine for m in done).items())
        raise ReportError(
            f"no mission was driven on both engines ({told or 'none at all'}): drive the same campaign by "
            "metacontrol campaign --engine ros and by --engine lockstep, and name both results"
        )
    return pairs


def rows(pairs: Sequence[Pair]) -> list[Row]:
    """Return the figures that both engines have, each over the missions for which both have it."""
    made = []
    for title, of in FIGURES.items():
        found = [(of(pair.ros.summary), of(pair.lockstep.summary)) for pair in pairs]
        both = [(one, other) for one, other in found if one is not None and other is not None]
        if both:
            ros, lockstep = (interval(list(values)) for values in zip(*both, strict=True))
            made.append(Row(title, len(both), ros, lockstep, interval([other - one for one, other in both])))
    return made


def markdown(missions: Sequence[Mission]) -> str:
    """Return a page: what was driven, what follows, and all figures of each manager with 95 % confidence intervals.

    Args:
        missions: of both engines, in any order.

    Raises:
        ReportError: none was driven on both.
    """
    pairs = pairs_of_engines(missions)
    by_manager = {
        manager: [pair for pair in pairs if pair.manager == manager]
        for manager in managers_of(pair.ros for pair in pairs)
    }
    compared = {manager: rows(own) for manager, own in by_manager.items()}
    parts = [_told(pairs, missions), _conclusion(by_manager, compared)]
    for manager, own in by_manager.items():
        parts += [f"## {code(manager)}, {count(len(own), 'mission')}", _table(compared[manager])]
    parts += ["## Missions with other changes", "\n".join(_others(pairs))]
    return "\n\n".join(parts) + "\n"


def _told(pairs: Sequence[Pair], missions: Sequence[Mission]) -> str:
    both = [mission for pair in pairs for mission in (pair.ros, pair.lockstep)]
    commits = sorted({mission.provenance.get("commit", "unknown")[:12] for mission in both})
    factors = [factor for pair in pairs if (factor := pair.ros.summary["real_time_factor"])]
    alone = len(missions) - len(both)
    left_out = f" {count(alone, 'mission')} of one engine alone, or not driven to the end, left out." if alone else ""
    return (
        f"{count(len(pairs), 'mission')}, each on ROS (at {statistics.fmean(factors or [math.nan]):.2f} simulated "
        f"seconds per second) and in lockstep; code {', '.join(map(plain, commits))}.{left_out} The seed of a mission "
        "gives the same world and noise; when messages arrive is chance on ROS.\n\n"
        "Means over missions with Student's 95 % confidence interval. The difference is lockstep less ROS, paired by "
        "mission."
    )


def _conclusion(by_manager: Mapping[str, Sequence[Pair]], compared: Mapping[str, Sequence[Row]]) -> str:
    """Return the conclusion in words."""
    changed = "; ".join(
        f"{code(manager)} {sum(pair.same_changes for pair in own)} of {len(own)}" for manager, own in by_manager.items()
    )
    told = f"Missions in which both engines deployed the same configurations in the same order: {changed}."
    known = [(manager, row) for manager, own in compared.items() for row in own if row.known]
    if not known:
        return f"{told} Whether the figures differ takes more missions."
    apart = [f"{row.title} of {code(manager)} ({row.difference.text(3)})" for manager, row in known if row.differs]
    chance = (1.0 - CONFIDENCE) * len(known)
    return (
        f"{told} Of {len(known)} figures, {len(apart)} differ at 95 %, where chance alone would give {chance:.1f}"
        f"{': ' if apart else '.'}{', '.join(apart)}{'.' if apart else ''}"
    )


def _table(compared: Sequence[Row]) -> str:
    head = ["figure", "missions", "ROS", "lockstep", "difference", "at 95 %"]
    intervals = ((row, (row.ros.text(3), row.lockstep.text(3), row.difference.text(3))) for row in compared)
    return table([head, *([row.title, str(row.missions), *texts, row.verdict] for row, texts in intervals)])


def _others(pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield a line with the configurations of each mission that had others on ROS than in lockstep."""
    apart = [pair for pair in pairs if not pair.same_changes]
    if not apart:
        yield "None."
        return
    yield "Configurations, with the time of each change in s:"
    yield ""
    for pair in apart:
        yield f"- {code(pair.ros.run.name)}: ROS {_story(pair.ros.summary)}; lockstep {_story(pair.lockstep.summary)}"


def _story(summary: Mapping[str, Any]) -> str:
    changes = [f"{change['to']} ({change['stamp_s']:.1f})" for change in summary["reconfigurations"]]
    return plain(" → ".join([str(summary["initial_configuration"]), *changes]))


def _chosen(summary: Mapping[str, Any]) -> list[str]:
    return [str(change["to"]) for change in summary["reconfigurations"]]
