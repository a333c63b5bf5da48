"""Drives a run in a process of its own that is kept for the next one, and replaced when it dies or hangs."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import asdict
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.campaign.progress import LONGEST_LOG, MOST_ATTEMPTS, Attempt, Result, Status, is_final
from metacontrol_experiments.io.campaign_on_ros import drive_on_ros
from metacontrol_experiments.io.code_version import current_commit
from metacontrol_experiments.io.ground_files import read_ground
from metacontrol_experiments.mission.ground import FACTORY, Ground
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_experiments.mission.settings import BAG_NAME, LOG_NAME, ROS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from metacontrol_experiments.campaign.matrix import Run

_GRACE_S = 3.0
_PACKAGES = ("distributed", "jpype1", "numpy", "opencv-python-headless", "owlready2", "pybullet", "scipy")

_own = threading.local()


def drive(run: Run, deadline: float, *, keep_log: bool, ground: Ground = FACTORY) -> tuple[Result, dict[str, bytes]]:
    """Drive a run, once more where it crashes or hangs.

    Args:
        run: what is asked for.
        deadline: wall s for an attempt.
        keep_log: return the mission's log, too, and on ROS its bag.
        ground: of the run; its files must be on this machine, too.

    Returns:
        What became of it, and the content of its files by their names.
    """
    problem = _ground_problem(run, ground)
    attempts = [Attempt(Status.CRASHED, 0.0, problem)] * MOST_ATTEMPTS if problem else []
    answer: dict[str, Any] = {}
    while not is_final(attempts):
        if run.engine == ROS:
            attempt, answer = drive_on_ros(run, deadline, ground)
        else:
            child = _child()
            attempt, answer = child.drive(run, deadline, ground)
            if attempt.status is not Status.DONE:
                child.close()
        attempts.append(attempt)
    files = {}
    if keep_log and "log" in answer:
        files[LOG_NAME] = answer["log"].encode()
    if keep_log and "bag" in answer:
        files[BAG_NAME] = answer["bag"]
    return Result(run, tuple(attempts), answer.get("summary"), provenance()), files


def provenance() -> dict[str, str]:
    """Return commit, host and versions, and the time."""
    return {
        "commit": current_commit(),
        "host": socket.gethostname(),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": f"python {platform.python_version()} "
        + " ".join(f"{name} {importlib.metadata.version(name)}" for name in _PACKAGES),
    }


def _ground_problem(run: Run, ground: Ground) -> str:
    """Return why a run cannot be driven with the files of world and routes that are here; empty where it can."""
    try:
        found = read_ground(ground.world, ground.routes).mark
    except RouteError as error:
        return str(error)
    return f"the files of world and routes are {found} here, not {run.ground}" if found != run.ground else ""


def _environment(own: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a process that drives missions.

    Dask lets its workers give memory back at once (`MALLOC_TRIM_THRESHOLD_`). A mission takes it again at each step:
    a sixth of its time would go to the kernel.
    """
    return {name: value for name, value in own.items() if name != "MALLOC_TRIM_THRESHOLD_"}


def _child() -> _Child:
    """Return this thread's process; a new one where there is none."""
    child: _Child | None = getattr(_own, "child", None)
    if child is None or not child.runs:
        child = _own.child = _Child()
    return child


class _Child:
    """A process that drives missions. It ends with its parent."""

    def __init__(self) -> None:
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the process)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "metacontrol_experiments.io.campaign_child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            bufsize=0,
            env=_environment(os.environ),
            start_new_session=True,  # Ctrl-C is for the command
        )

    @property
    def runs(self) -> bool:
        return self._process.poll() is None

    def drive(self, run: Run, deadline: float, ground: Ground) -> tuple[Attempt, dict[str, Any]]:
        """Drive a run; return how that went, and the answer."""
        began = time.monotonic()
        start = os.fstat(self._log.fileno()).st_size
        line = b""
        try:
            asked = {"run": asdict(run), "ground": asdict(ground)}
            self._stream("stdin").write(json.dumps(asked, default=str).encode() + b"\n")
            line = self._answer(began + deadline)
        except BrokenPipeError:
            pass
        wall_s = round(time.monotonic() - began, 3)
        if line.endswith(b"\n"):
            answer = json.loads(line)
            if "problem" not in answer:
                return Attempt(Status.DONE, wall_s), answer
            return Attempt(Status.CRASHED, wall_s, answer["problem"], self._said(start)), {}
        if line == b"" and self._ended():
            problem = f"its process ended with status {self._process.returncode}"
            return Attempt(Status.CRASHED, wall_s, problem, self._said(start)), {}
        self._process.send_signal(signal.SIGABRT)  # it tells where it hangs
        self._ended()
        return Attempt(Status.HUNG, wall_s, f"no end within {deadline:g} s of wall time", self._said(start)), {}

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        for name in ("stdin", "stdout"):
            self._stream(name).close()
        self._process.wait()
        self._log.close()

    def _answer(self, until: float) -> bytes:
        """Return what the process answers: a line, or a part of one when time is over or the process ends."""
        output, read = self._stream("stdout"), b""
        while not read.endswith(b"\n"):
            left = until - time.monotonic()
            if left <= 0.0 or not select.select([output], [], [], left)[0]:
                return read or b"?"
            more = output.read(65536)
            if not more:
                return b""
            read += more
        return read

    def _ended(self) -> bool:
        """Tell whether the process ends soon."""
        try:
            self._process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _said(self, start: int) -> str:
        """Return the end of what the process has said since a position of its log."""
        size = os.fstat(self._log.fileno()).st_size
        return os.pread(self._log.fileno(), LONGEST_LOG, max(start, size - LONGEST_LOG)).decode(errors="replace")

    def _stream(self, name: str) -> Any:
        return getattr(self._process, name)
