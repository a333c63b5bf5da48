"""Drives the runs of a campaign side by side, by Dask: on this machine, or by a scheduler that runs elsewhere.

Workers keep nothing: a result comes back here, so they need no disk in common. When a worker dies, the scheduler gives
its run to another one.
"""

from __future__ import annotations

import logging
import signal
import threading
import uuid
from contextlib import contextmanager
from typing import TYPE_CHECKING

import dask
from distributed import Client, KilledWorker, LocalCluster, as_completed
from distributed.client import FutureCancelledError

from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.campaign.progress import Attempt, Result, Status
from metacontrol_experiments.io.campaign_driver import drive, provenance

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from metacontrol_experiments.campaign.matrix import Campaign, Run

CONNECT_S = 10.0
"""Wall s until a scheduler must have answered."""


START_S = 120.0
"""Wall s until worker processes on this machine must have answered: it may be busy."""
SILENCE_S = 600.0
"""Wall s without a word between the processes on this machine until one counts as lost; others may take the CPU."""


def drive_all(
    campaign: Campaign, runs: Sequence[Run], *, jobs: int, scheduler: str | None
) -> Iterator[tuple[Result, dict[str, bytes]]]:
    """Drive runs of a campaign, and yield what became of each, with its files, as soon as it is over.

    Args:
        campaign: says how long a run may take, and whether it leaves log and bag.
        runs: those that are to be driven.
        jobs: worker processes on this machine.
        scheduler: address of a scheduler in their place.

    Raises:
        CampaignError: the scheduler does not answer, or is lost.
    """
    with _client(jobs, scheduler) as client:
        token = uuid.uuid4().hex  # a scheduler keeps results by key
        waiting = {
            client.submit(
                drive,
                run,
                campaign.deadline,
                keep_log=campaign.logs,
                ground=campaign.ground,
                key=f"{run.name}#{token}",
                pure=False,
            ): run
            for run in runs
        }
        for future in as_completed(list(waiting), loop=client.loop):
            run = waiting.pop(future)
            try:
                yield future.result()
            except KilledWorker as error:
                yield _lost(run, f"its workers died: {error}"), {}
            except FutureCancelledError as error:
                raise CampaignError(f"the scheduler is lost ({error}): give the same command again to go on") from error
            future.release()


def _lost(run: Run, problem: str) -> Result:
    attempt = Attempt(Status.CRASHED, 0.0, " ".join(problem.split()))
    return Result(run, (attempt,), None, provenance())


@contextmanager
def _client(jobs: int, scheduler: str | None) -> Iterator[Client]:
    """Yield a client of the scheduler, or of one with workers on this machine."""
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            said = f"no scheduler of Dask answers ({error})"
            raise CampaignError(f"--scheduler {scheduler}: {said}; start one by: dask scheduler") from error
        with client:
            yield client
        return
    settings = {
        "distributed.worker.multiprocessing-method": "spawn",  # PyBullet and threads do not survive a fork
        "distributed.worker.profile.enabled": False,  # nobody looks at it
        "distributed.comm.timeouts.connect": f"{START_S}s",
        "distributed.comm.timeouts.tcp": f"{SILENCE_S}s",
    }
    with dask.config.set(settings), _interrupts_ignored():
        try:
            cluster = LocalCluster(
                n_workers=jobs,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            )
        except (TimeoutError, RuntimeError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise CampaignError(f"the worker processes do not start ({why}): give the same command again") from error
    with cluster, Client(cluster, set_as_default=False) as client:
        yield client


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Let processes that are started in the body ignore Ctrl-C, which is for this one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
