"""Drives the baseline missions of the yardstick in lockstep, and keeps a trace of each in a folder."""

from __future__ import annotations

import multiprocessing
import signal
import zipfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from node_kit.one_line import OneLineError

from metacontrol_experiments.campaign.yardstick import SAMPLES, Trace
from metacontrol_experiments.contingency.parsing import parse_contingency
from metacontrol_experiments.io.ground_files import read_ground, routes_file
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.managers.manager import NONE
from metacontrol_experiments.mission.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pybullet_simulator.physics.simulation import Simulation

_LARGEST = 100_000_000
"""Bytes of a trace; a mission of an hour has a thousandth of that."""

Job = tuple[str, str, int, int]
"""Variant, route, seed, clutter."""


def trace_file(folder: Path, job: Job) -> Path:
    """Return where a mission's trace is."""
    variant, route, seed, clutter = job
    return folder / f"{variant}-{route}-{seed}-{clutter}.npz"


class TraceError(OneLineError, ValueError):
    """A trace can't be used; the message names its file, and the remedy."""


def read_trace(path: Path) -> Trace:
    """Return a trace that was kept.

    Raises:
        TraceError: the file is none.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST:
                raise TraceError(f"{path}: holds more than {_LARGEST} bytes: delete it to drive the mission again")
        with np.load(path, allow_pickle=False) as content:
            values = {name: content[name] for name in content.files}
        return Trace(**{name: value if value.ndim else value.item() for name, value in values.items()})
    except TraceError:
        raise
    # numpy and the archive raise whatever their parts do
    except Exception as error:
        problem = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise TraceError(
            f"{path}: is no trace of a mission ({problem}): delete it to drive the mission again"
        ) from error


def drive(jobs: Sequence[Job], folder: Path, processes: int) -> Iterator[Path]:
    """Drive missions whose traces are not there yet, and yield each trace's file."""
    folder.mkdir(parents=True, exist_ok=True)
    missing = [job for job in jobs if not trace_file(folder, job).exists()]
    # Spawned: PyBullet and numpy's threads do not survive a fork.
    spawn, ignore = multiprocessing.get_context("spawn"), (signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for this process
    with ProcessPoolExecutor(processes, spawn, signal.signal, ignore) as pool:
        pending = [pool.submit(_drive, job, folder) for job in missing]
        try:
            for run in pending:
                yield run.result()
        finally:
            for run in pending:
                run.cancel()


def _drive(job: Job, folder: Path) -> Path:
    from metacontrol_experiments.io.lockstep_setup import set_up  # PyBullet and navigation take a while to import

    variant, route_name, seed, clutter = job
    route = read_route(routes_file(read_ground(None, None)), route_name)
    contingencies = (parse_contingency(f"clutter:{clutter}"),) if clutter else ()
    asked = Settings(
        route=route,
        output=Path(),  # nothing is written
        manager=NONE,
        seed=seed,
        initial_configuration=variant,
        contingencies=contingencies,
    )
    samples: list[tuple[float, ...]] = []
    seen: list[float] = []

    def watch(simulation: Simulation) -> None:
        if not seen or simulation.time - seen[-1] > 1.5 / SAMPLES / 2.0:
            seen.append(simulation.time)
            speed = float(np.hypot(*simulation.velocity[:2]))
            left = float(np.hypot(simulation.pose.x - route.goal.x, simulation.pose.y - route.goal.y))
            samples.append((simulation.time, simulation.smooth_acceleration, speed, simulation.velocity[0], left))

    outcome = set_up(asked).run(watch)
    record, state = outcome.record, outcome.state
    start, end = record.start_stamp, record.end_stamp
    rows = np.array(samples)
    seconds = len(rows) // SAMPLES
    rows = rows[: seconds * SAMPLES].reshape(seconds, SAMPLES, -1)
    way = float(np.hypot(route.goal.x - route.start.x, route.goal.y - route.start.y))
    begin = rows[:, 0, 0]
    commands = np.array(record.commands)
    trace = Trace(
        variant=variant,
        route=route_name,
        seed=seed,
        clutter=clutter,
        reached=state.outcome is not None and state.outcome.value == "reached",
        duration_s=end - start,
        risk=np.array([value for stamp, value in record.true_quality["safety"] if start <= stamp <= end]),
        acceleration=rows[:, :, 1],
        speed=rows[:, :, 2],
        forward=rows[:, :, 3].max(axis=1),
        rate=np.array(
            [np.count_nonzero((commands >= one) & (commands < one + 1.0)) for one in begin], dtype=np.float64
        ),
        share=np.maximum.accumulate(1.0 - rows[:, -1, 4] / way),
    )
    path = trace_file(folder, job)
    np.savez_compressed(path.with_suffix(".part.npz"), **asdict(trace))
    path.with_suffix(".part.npz").rename(path)
    return path
