"""Calibration: every variant drives routes with several seeds, in lockstep and without contingency; levels from that.

A file of runs grows by one line for each mission, so an interrupted calibration goes on where it stopped. The same
missions give the same lines in the same order, whatever the number of processes.

Measured levels of a variant, over all its missions:
- safety: the mean of the risk that a mission stays below for 95 % of its time (paper: below the threshold for more than
  95 % of the time). A mean over time would say little: the risk is 0 wherever nothing is near.
- energy: the mean over time.
- performance: the mean of the shortest time that any variant took on the route by the time taken, 0 for a goal missed.
"""

from __future__ import annotations

import csv
import itertools
import multiprocessing
import signal
import statistics
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from metacontrol_bags.metrics import MAX_SHARE, quantile, share_above, summarise

from metacontrol_experiments.mission.mission import MissionError
from metacontrol_experiments.mission.routes import read_route
from metacontrol_experiments.mission.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

SAFETY_SHARE = 1.0 - MAX_SHARE["safety"]
QUALITIES = ("safety", "energy", "performance")


class CalibrationError(RuntimeError):
    """Runs cannot be read or are not enough; the message names file and remedy."""


@dataclass(frozen=True)
class Job:
    """A mission to be driven."""

    variant: str
    route: str
    seed: int

    def __str__(self) -> str:
        return f"{self.variant} on {self.route} with seed {self.seed}"


@dataclass(frozen=True)
class Run:
    """A mission that was driven: a line of the file of runs.

    Attributes:
        variant: name of the configuration.
        route: name.
        seed: of everything random.
        outcome: how the mission ended.
        collisions: contact episodes.
        duration_s: simulated s.
        path_m: length of the way driven, m.
        safety: risk that it stayed below for 95 % of the time.
        safety_mean: mean risk.
        safety_above: share of time above the threshold of safety.
        energy: mean.
        energy_above: share of time above the threshold of energy.
        commit: of the code that drove it.
    """

    variant: str
    route: str
    seed: int
    outcome: str
    collisions: int
    duration_s: float
    path_m: float
    safety: float
    safety_mean: float
    safety_above: float
    energy: float
    energy_above: float
    commit: str

    @property
    def job(self) -> Job:
        """What it was asked for."""
        return Job(self.variant, self.route, self.seed)

    @property
    def reached(self) -> bool:
        """Whether the goal was."""
        return self.outcome == "reached"


@dataclass(frozen=True)
class Level:
    """A measured level.

    Attributes:
        value: mean over missions.
        spread: standard deviation over missions.
    """

    value: float
    spread: float


_COLUMNS = tuple(field.name for field in fields(Run))


def plan(variants: Sequence[str], routes: Sequence[str], seeds: int) -> list[Job]:
    """Return the missions with seeds 1 to `seeds`, seed by seed: a part of them says something, too."""
    return [Job(*job) for job in ((v, r, s) for s, v, r in itertools.product(range(1, seeds + 1), variants, routes))]


def drive(jobs: Sequence[Job], routes: Path, commit: str, processes: int) -> Iterator[Run]:
    """Drive missions, and yield each in the order of `jobs` as soon as it is over.

    Args:
        jobs: the missions.
        routes: YAML file of routes.
        commit: of the code that runs.
        processes: how many drive side by side.

    Raises:
        CalibrationError: one cannot be driven, or its process has died.
    """
    if processes == 1 or len(jobs) < 2:
        yield from (_drive(job, routes, commit) for job in jobs)
        return
    # Spawned: PyBullet and numpy's threads do not survive a fork.
    spawn, ignore = multiprocessing.get_context("spawn"), (signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for this process
    with ProcessPoolExecutor(processes, spawn, signal.signal, ignore) as pool:
        pending = [pool.submit(_drive, job, routes, commit) for job in jobs]
        try:
            for run in pending:
                yield run.result()
        except BrokenProcessPool as error:
            raise CalibrationError(
                f"a process that drives missions has died ({error}); run it again to go on"
            ) from error
        finally:
            for run in pending:
                run.cancel()


def _drive(job: Job, routes: Path, commit: str) -> Run:
    from metacontrol_experiments.io.lockstep_setup import set_up  # PyBullet and navigation take a while to import
    from metacontrol_experiments.lockstep.system import LockstepError

    asked = Settings(
        route=read_route(routes, job.route),
        output=Path(),  # nothing is written
        metacontrol=False,
        seed=job.seed,
        initial_configuration=job.variant,
        commit=commit,
    )
    try:
        record = set_up(asked).run().record
    except (LockstepError, MissionError) as error:
        raise CalibrationError(f"{job}: {error}") from error
    summary = summarise(record)
    start, end = record.start_stamp, record.end_stamp
    risk, load = record.true_quality["safety"], record.true_quality["energy"]
    limits = asked.thresholds
    return Run(
        **asdict(job),
        outcome=summary["outcome"],
        collisions=summary["collisions"],
        duration_s=summary["duration_s"],
        path_m=summary["path_length_m"],
        safety=round(quantile(risk, SAFETY_SHARE, start, end) or 0.0, 4),
        safety_mean=summary["mean_qa"]["safety"],
        safety_above=round(share_above(risk, limits["safety"], start, end) or 0.0, 4),
        energy=summary["mean_qa"]["energy"],
        energy_above=round(share_above(load, limits["energy"], start, end) or 0.0, 4),
        commit=commit,
    )


def read_runs(path: Path) -> list[Run]:
    """Read a file of runs; a last line that was cut off by an interruption is left out.

    Raises:
        CalibrationError: it is no such file.
    """
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    rows = csv.DictReader(whole.splitlines())
    if whole and tuple(rows.fieldnames or ()) != _COLUMNS:
        raise CalibrationError(f"{path}: its columns are not {', '.join(_COLUMNS)}; name another file of runs")
    try:
        return [_run(row) for row in rows]
    except (TypeError, ValueError, KeyError) as error:
        raise CalibrationError(f"{path}: line {rows.line_num} is no run ({error}); take it out") from error


def append_runs(path: Path, runs: Iterable[Run]) -> Iterator[Run]:
    """Write each run to the end of a file as it comes, and yield it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(text[: text.rfind("\n") + 1])
        writer = csv.writer(file, lineterminator="\n")
        if not file.tell():
            writer.writerow(_COLUMNS)
        file.flush()
        for run in runs:
            writer.writerow(asdict(run).values())
            file.flush()
            yield run


def missing_runs(runs: Sequence[Run], variants: Sequence[str]) -> list[Job]:
    """Return what is missing for all variants to have driven the same routes with the same seeds."""
    driven = {run.job for run in runs}
    asked = sorted({(run.seed, run.route) for run in runs})
    wanted = [Job(variant, route, seed) for seed, route in asked for variant in variants]
    return [job for job in wanted if job not in driven]


def measure(runs: Sequence[Run]) -> dict[str, dict[str, Level]]:
    """Return variant -> quality attribute -> level, the variants in the order of their names."""
    fastest = {
        route: min((run.duration_s for run in runs if run.route == route and run.reached), default=0.0)
        for route in {run.route for run in runs}
    }
    levels = {}
    for variant in sorted({run.variant for run in runs}):
        own = sorted((run for run in runs if run.variant == variant), key=lambda run: (run.route, run.seed))
        levels[variant] = {
            "safety": _level([run.safety for run in own]),
            "energy": _level([run.energy for run in own]),
            "performance": _level([fastest[run.route] / run.duration_s if run.reached else 0.0 for run in own]),
        }
    return levels


def write_levels(path: Path, runs: Sequence[Run]) -> None:
    """Write the expected levels of all variants, with their spread, as `rosmodel generate all` reads them."""
    seeds = sorted({run.seed for run in runs})
    spreads = [f"{name}_spread" for name in QUALITIES]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["name", *QUALITIES, "source", *spreads, "missions", "seeds"])
        for variant, levels in measure(runs).items():
            own = [run for run in runs if run.variant == variant]
            values = [f"{levels[name].value:.3f}" for name in QUALITIES]
            deviations = [f"{levels[name].spread:.3f}" for name in QUALITIES]
            writer.writerow([variant, *values, "measured", *deviations, len(own), f"{seeds[0]}-{seeds[-1]}"])


def _level(values: Sequence[float]) -> Level:
    return Level(statistics.fmean(values), statistics.stdev(values) if len(values) > 1 else 0.0)


def _run(row: dict[str, str]) -> Run:
    """Return a line's run.

    Raises:
        TypeError, ValueError, KeyError: it is none.
    """
    kinds = {"str": str, "int": int, "float": float}
    return Run(**{field.name: kinds[str(field.type)](row[field.name]) for field in fields(Run)})
