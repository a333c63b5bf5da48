"""Compare the figures of the same missions on ROS and in lockstep."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_bags.intervals import Interval, interval

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

ENGINES = ("ros", "lockstep")


@dataclass(frozen=True)
class Pair:
    """The summaries of one seed's mission."""

    seed: int
    ros: Mapping[str, Any]
    lockstep: Mapping[str, Any]


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
    """A figure over seeds; the difference is lockstep less ROS, paired by seed."""

    title: str
    seeds: int
    ros: Interval
    lockstep: Interval
    difference: Interval

    @property
    def differs(self) -> bool:
        """Whether the difference is more than chance, at 95 %."""
        return abs(self.difference.mean) > self.difference.half

    @property
    def verdict(self) -> str:
        """The difference in words."""
        if not math.isfinite(self.difference.half):
            return "needs more seeds"
        if not self.differs:
            return "no difference seen"
        return f"differs by {self.difference.mean / self.ros.mean:+.1%}" if self.ros.mean else "differs"


def rows(pairs: Sequence[Pair]) -> list[Row]:
    """Return the figures that both engines have, each over the seeds for which both have it."""
    made = []
    for title, of in FIGURES.items():
        found = [(of(pair.ros), of(pair.lockstep)) for pair in pairs]
        both = [(one, other) for one, other in found if one is not None and other is not None]
        if both:
            ros, lockstep = (interval(list(values)) for values in zip(*both, strict=True))
            made.append(Row(title, len(both), ros, lockstep, interval([other - one for one, other in both])))
    return made


def markdown(pairs: Sequence[Pair]) -> str:
    """Return a page: what was run, all figures with 95 % confidence intervals over seeds, and what follows."""
    compared = rows(pairs)
    parts = (_missions(pairs), "\n".join(_table(compared)), _conclusion(pairs, compared), "\n".join(_changes(pairs)))
    return "\n\n".join(parts) + "\n"


def _missions(pairs: Sequence[Pair]) -> str:
    first = pairs[0].ros
    summaries = [summary for pair in pairs for summary in (pair.ros, pair.lockstep)]
    commits = sorted({str(summary["commit"])[:12] for summary in summaries})
    strikes = dict.fromkeys(str(entry["name"]) for summary in summaries for entry in summary["perturbations"])
    factors = [pair.ros["real_time_factor"] for pair in pairs if pair.ros["real_time_factor"]]
    return (
        f"Route {first['route']} from configuration {first['initial_configuration']}, "
        f"{'with the meta-controller' if first['metacontrol'] else 'the baseline'}, contingencies: "
        f"{', '.join(strikes) or 'none'}; seeds {', '.join(str(pair.seed) for pair in pairs)}, each on ROS (at "
        f"{statistics.fmean(factors or [math.nan]):.2f} simulated seconds per second) and in lockstep; code "
        f"{', '.join(commits)}. A seed gives the same world and noise; when messages arrive is chance on ROS.\n\n"
        "Means over seeds with Student's 95 % confidence interval. The difference is lockstep less ROS, paired by seed."
    )


def _table(compared: Sequence[Row]) -> Iterator[str]:
    yield "| figure | seeds | ROS | lockstep | difference | at 95 % |"
    yield "|---|---|---|---|---|---|"
    for row in compared:
        intervals = (row.ros.text(3), row.lockstep.text(3), row.difference.text(3))
        yield f"| {row.title} | {row.seeds} | {' | '.join(intervals)} | {row.verdict} |"


def _conclusion(pairs: Sequence[Pair], compared: Sequence[Row]) -> str:
    """Return the conclusion in words."""
    same = sum(_chosen(pair.ros) == _chosen(pair.lockstep) for pair in pairs)
    told = f"Both engines deployed the same configurations in the same order with {same} of {len(pairs)} seeds."
    if len(pairs) < 2:
        return f"{told} Whether the figures differ takes more seeds."
    apart = [f"{row.title} ({row.difference.text(3)})" for row in compared if row.differs]
    if not apart:
        return f"{told} None of the {len(compared)} figures differs by more than chance."
    return f"{told} Of {len(compared)} figures, {len(apart)} differ by more than chance: {', '.join(apart)}."


def _changes(pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield a line with the configurations of each mission."""
    yield "Configurations, with the time of each change in s:"
    yield ""
    for pair in pairs:
        yield f"- seed {pair.seed}: ROS {_story(pair.ros)}; lockstep {_story(pair.lockstep)}"


def _story(summary: Mapping[str, Any]) -> str:
    changes = [f"{change['to']} ({change['stamp_s']:.1f})" for change in summary["reconfigurations"]]
    return " → ".join([str(summary["initial_configuration"]), *changes])


def _chosen(summary: Mapping[str, Any]) -> list[str]:
    return [str(change["to"]) for change in summary["reconfigurations"]]
