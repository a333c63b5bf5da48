"""The same missions on ROS and in lockstep, and how their figures differ."""

from __future__ import annotations

import statistics
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.intervals import interval
from metacontrol_experiments.runner import RunError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

ENGINES = ("ros", "lockstep")

Summary = dict[str, Any]


@dataclass(frozen=True)
class Pair:
    """The summaries of one seed's mission."""

    seed: int
    ros: Mapping[str, Any]
    lockstep: Mapping[str, Any]


def _delay(name: str) -> Callable[[Mapping[str, Any]], float | None]:
    """Mean over a mission's reconfigurations."""

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


def drive(engine: str, seed: int, output: Path, arguments: Sequence[str]) -> None:
    """Run a mission in a process of its own; its summary is in `output` then.

    Raises:
        RunError: it could not be run.
    """
    command = [sys.executable, "-m", "metacontrol_experiments.cli", "run", "--quiet", *arguments]
    command += ["--engine", engine, "--seed", str(seed), "--output", str(output)]
    done = subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True)
    if done.returncode not in (0, 1):  # 1: a mission that did not reach its goal
        said = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise RunError(f"metacontrol run --engine {engine} --seed {seed} ended with status {done.returncode}: {said}")


def markdown(pairs: Sequence[Pair]) -> str:
    """A table of all figures that both engines tell: means with 95 % confidence intervals over seeds."""
    lines = ["| | ROS | lockstep | difference |", "|---|---|---|---|"]
    for title, of in FIGURES.items():
        found = [(one, other) for pair in pairs for one, other in [(of(pair.ros), of(pair.lockstep))]]
        both = [(one, other) for one, other in found if one is not None and other is not None]
        if both:
            columns: Iterable[list[float]] = (
                [one for one, _ in both],
                [other for _, other in both],
                [other - one for one, other in both],
            )
            lines.append(f"| {title} | {' | '.join(interval(column).text(3) for column in columns)} |")
    changes = [
        f"- seed {pair.seed}: "
        + "; ".join(
            f"{engine} {_story(summary)}" for engine, summary in zip(ENGINES, (pair.ros, pair.lockstep), strict=True)
        )
        for pair in pairs
    ]
    return "\n".join([*lines, "", "Configurations, with the time of each change in s:", "", *changes]) + "\n"


def _story(summary: Mapping[str, Any]) -> str:
    """The configurations of a mission in their order."""
    changes = [f"{change['to']} ({change['stamp_s']:.1f})" for change in summary["reconfigurations"]]
    return " → ".join([str(summary["initial_configuration"]), *changes])
