"""Drives the missions of a calibration in lockstep, in several processes side by side.

The same missions give the same runs in the same order, whatever the number of processes.
"""

from __future__ import annotations

import multiprocessing
import signal
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TYPE_CHECKING

from metacontrol_experiments.campaign.calibration import CalibrationError, Job, Run, run_of
from metacontrol_experiments.io.ground_files import routes_file
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.managers.manager import NONE
from metacontrol_experiments.mission.mission import MissionError
from metacontrol_experiments.mission.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from metacontrol_experiments.campaign.definition import Definition
    from metacontrol_experiments.mission.ground import Ground


def drive(jobs: Sequence[Job], ground: Ground, definition: Definition, commit: str, processes: int) -> Iterator[Run]:
    """Drive missions, and yield each in the order of `jobs` as soon as it is over.

    Args:
        jobs: the missions.
        ground: where they are driven.
        definition: of the levels.
        commit: of the code that runs.
        processes: how many drive side by side.

    Raises:
        CalibrationError: one cannot be driven, or its process has died.
    """
    if processes == 1 or len(jobs) < 2:
        yield from (_drive(job, ground, definition, commit) for job in jobs)
        return
    # Spawned: PyBullet and numpy's threads do not survive a fork.
    spawn, ignore = multiprocessing.get_context("spawn"), (signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for this process
    with ProcessPoolExecutor(processes, spawn, signal.signal, ignore) as pool:
        pending = [pool.submit(_drive, job, ground, definition, commit) for job in jobs]
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


def _drive(job: Job, ground: Ground, definition: Definition, commit: str) -> Run:
    from metacontrol_experiments.io.lockstep_setup import set_up  # PyBullet and navigation take a while to import
    from metacontrol_experiments.lockstep.system import LockstepError

    asked = Settings(
        route=read_route(routes_file(ground), job.route),
        output=Path(),  # nothing is written
        manager=NONE,
        seed=job.world_seed,
        initial_configuration=job.variant,
        world=ground.world,
        commit=commit,
    )
    try:
        record = set_up(asked).run().record
    except (LockstepError, MissionError) as error:
        raise CalibrationError(f"{job}: {error}") from error
    return run_of(job, record, asked.thresholds, definition, ground.mark, commit)
