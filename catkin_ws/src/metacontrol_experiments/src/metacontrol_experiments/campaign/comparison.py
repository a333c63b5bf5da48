"""The same missions on ROS and in lockstep, and how their figures differ."""

from __future__ import annotations

import json
import math
import shlex
import signal
import statistics
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_bags.intervals import Interval, interval

from metacontrol_experiments.ros.runner import RunError, signals_as_interrupts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

ENGINES = ("ros", "lockstep")

SUMMARY = "summary.json"


class ComparisonError(RuntimeError):
    """Missions cannot be compared; the message names file and remedy."""


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


def claim(folder: Path, options: Sequence[str]) -> None:
    """Take a folder for the missions of these options, and remember that.

    Raises:
        ComparisonError: it holds those of others.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path, asked = folder / "options.txt", shlex.join(options) + "\n"
    held = path.read_text(encoding="utf-8") if path.exists() else asked
    if held != asked:
        said = held.strip() or "without options"
        raise ComparisonError(f"{folder} holds other missions ({said}): name another folder by --runs, or delete it")
    path.write_text(asked, encoding="utf-8")


def read_summary(path: Path) -> dict[str, Any]:
    """Read a mission's summary.

    Raises:
        ComparisonError: it is none.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ComparisonError(f"{path}: is no JSON ({error}); run its mission again") from error
    if not isinstance(content, dict) or "reconfigurations" not in content:
        raise ComparisonError(f"{path}: is no summary of a mission; run one")
    return content


def drive(engine: str, seed: int, output: Path, arguments: Sequence[str]) -> None:
    """Run a mission in a process of its own; its summary is in `output` then.

    Raises:
        RunError: it could not be run.
        KeyboardInterrupt: it was interrupted, and has ended.
    """
    command = [sys.executable, "-m", "metacontrol_experiments.cli.main", "run", "--quiet", *arguments]
    command += ["--engine", engine, "--seed", str(seed), "--output", str(output)]
    with (
        signals_as_interrupts(),
        # In a session of its own, so that it is interrupted once, from here, and has the time to end what it started.
        subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process,
    ):
        try:
            _, said = process.communicate()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    # Status 1 is a mission that did not reach its goal, or a program that broke.
    if process.returncode not in (0, 1) or not (output / SUMMARY).exists():
        last = (said.strip().splitlines() or ["it said nothing"])[-1]
        raise RunError(
            f"metacontrol run --engine {engine} --seed {seed} ended with status {process.returncode}: {last}"
        )


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
        """What the difference says."""
        if not math.isfinite(self.difference.half):
            return "needs more seeds"
        if not self.differs:
            return "no difference seen"
        return f"differs by {self.difference.mean / self.ros.mean:+.1%}" if self.ros.mean else "differs"


def rows(pairs: Sequence[Pair]) -> list[Row]:
    """The figures that both engines tell, each of the seeds for which both do."""
    made = []
    for title, of in FIGURES.items():
        found = [(of(pair.ros), of(pair.lockstep)) for pair in pairs]
        both = [(one, other) for one, other in found if one is not None and other is not None]
        if both:
            ros, lockstep = (interval(list(values)) for values in zip(*both, strict=True))
            made.append(Row(title, len(both), ros, lockstep, interval([other - one for one, other in both])))
    return made


def markdown(pairs: Sequence[Pair]) -> str:
    """What was run, a table of all figures with 95 % confidence intervals over seeds, and what follows."""
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
    """What follows, in words."""
    same = sum(_chosen(pair.ros) == _chosen(pair.lockstep) for pair in pairs)
    told = f"Both engines deployed the same configurations in the same order with {same} of {len(pairs)} seeds."
    if len(pairs) < 2:
        return f"{told} Whether the figures differ takes more seeds."
    apart = [f"{row.title} ({row.difference.text(3)})" for row in compared if row.differs]
    if not apart:
        return f"{told} None of the {len(compared)} figures differs by more than chance."
    return f"{told} Of {len(compared)} figures, {len(apart)} differ by more than chance: {', '.join(apart)}."


def _changes(pairs: Sequence[Pair]) -> Iterator[str]:
    """The configurations of each mission."""
    yield "Configurations, with the time of each change in s:"
    yield ""
    for pair in pairs:
        yield f"- seed {pair.seed}: ROS {_story(pair.ros)}; lockstep {_story(pair.lockstep)}"


def _story(summary: Mapping[str, Any]) -> str:
    changes = [f"{change['to']} ({change['stamp_s']:.1f})" for change in summary["reconfigurations"]]
    return " → ".join([str(summary["initial_configuration"]), *changes])


def _chosen(summary: Mapping[str, Any]) -> list[str]:
    return [str(change["to"]) for change in summary["reconfigurations"]]
