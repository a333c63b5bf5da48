"""The processes of one run: start them apart from the terminal, find all their descendants, end them all.

Every process gets a mark in its environment, which its descendants inherit: roslaunch puts each node in a session of
its own, and a node whose parent died belongs to nobody, but both still carry the mark.
"""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import signal
import socket
import subprocess
import time
import uuid
from contextlib import contextmanager
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

MARK = "METACONTROL_RUN"
"""Name of the environment variable that marks a run's processes."""

_POLL_S = 0.05
_ENDED_BY_SIGINT = ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")
"""They are ended by SIGINT, which also comes when this process is killed. A background job of a shell script has SIGINT
ignored, and its children would inherit that."""


class RunError(RuntimeError):
    """The mission could not be started; the message names the log."""


@contextmanager
def reserved_port() -> Iterator[int]:
    """Yield a TCP port that the system gives to nobody else in the body; a master can listen on it."""
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        holder.bind(("", 0))
        yield int(holder.getsockname()[1])


def is_free(port: int) -> bool:
    """Tell whether nobody listens on a TCP port of this machine."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True


def wait_until(condition: Callable[[], bool], deadline_s: float) -> bool:
    """Wait for a condition; tell whether it came true within a time in wall s."""
    end = time.monotonic() + deadline_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(_POLL_S)
    return True


class ProcessTree:
    """Processes of one run with all their descendants."""

    def __init__(self, environment: dict[str, str]) -> None:
        """Take the variables that every process gets beside the environment of this process."""
        self.environment = {**environment, MARK: uuid.uuid4().hex}
        self._started: list[subprocess.Popen[bytes]] = []

    def start(self, command: Sequence[str], log: Path) -> subprocess.Popen[bytes]:
        """Start a command in a session of its own, so that Ctrl-C does not reach it; its output goes to a file.

        Raises:
            OSError: there is no such command, or the log cannot be opened.
        """
        if not shutil.which(command[0]):
            raise FileNotFoundError(errno.ENOENT, "no such command", command[0])
        with log.open("wb") as output:
            process = subprocess.Popen(
                [*_ENDED_BY_SIGINT, *command],
                env={**os.environ, **self.environment},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._started.append(process)
        return process

    def owns(self, pid: int) -> bool:
        """Tell whether a process belongs to this run and still runs."""
        try:
            process = psutil.Process(pid)
            marked = process.environ().get(MARK) == self.environment[MARK]
            return bool(marked and process.status() != psutil.STATUS_ZOMBIE)
        except (psutil.Error, OSError):  # gone, or another user's: not ours
            return False

    def alive(self) -> list[psutil.Process]:
        """Return the processes of this run that still run."""
        return [process for process in psutil.process_iter() if self.owns(process.pid)]

    def stop(self, process: subprocess.Popen[bytes], grace_s: float) -> bool:
        """Ask a process to end by SIGINT, wait, and tell whether it ended in time."""
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(grace_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def close(self, grace_s: float = 12.0) -> None:
        """End whatever still runs, latest first, by SIGINT, SIGTERM, SIGKILL."""
        for started in reversed(self._started):
            self.stop(started, grace_s)
        for number in (signal.SIGTERM, signal.SIGKILL):
            for process in self.alive():
                try:
                    process.send_signal(number)
                except psutil.NoSuchProcess:
                    continue
            if wait_until(lambda: not self.alive(), 3.0):
                break
        for started in self._started:
            started.poll()


@contextmanager
def signals_as_interrupts() -> Iterator[None]:
    """Make SIGTERM and SIGHUP end the body as Ctrl-C does."""

    def interrupt(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    former = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder.

    Raises:
        RunError: one is at work in it.
    """
    lock = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunError(f"--output: another run is at work in {folder}: choose another folder") from error
        yield
    finally:
        os.close(lock)
