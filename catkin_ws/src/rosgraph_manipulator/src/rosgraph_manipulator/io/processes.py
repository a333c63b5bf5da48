"""Processes of nodes: each has its own session, and none outlives the process that started it, its owner.

Three things keep a dying owner from leaving processes behind:

- The kernel kills the nodes (parent-death signal).
- A reaper process kills all that carry the owner's mark in their environment, also the children of nodes.
- An owner that starts kills what an earlier owner with the same mark left.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

MARK = "MROS_LAUNCHER"
"""Environment variable of every process that a launcher starts; its value names the launcher and its master."""

DIE_WITH_OWNER = ("/usr/bin/setpriv", "--pdeathsig", "KILL", "--")
"""From util-linux, which every Debian has. The kernel sends the signal when the *thread* ends that started the process,
so only a main thread may start one."""

WARM_START = Path(__file__).with_name("warm_start.py")


class StartError(Exception):
    """A process can't be started; the message says why."""


@dataclass(frozen=True)
class Command:
    """A command to start.

    Attributes:
        words: the executable and its arguments.
        cwd: the folder in which it is started.
        environment: its whole environment, with the mark.
        log: file for its standard output; None: it shares the owner's standard output.
        prefixed: whether the words begin with a launch-prefix.
    """

    words: tuple[str, ...]
    cwd: str
    environment: Mapping[str, str]
    log: str | None = None
    prefixed: bool = False

    @property
    def interpreter(self) -> tuple[str, ...]:
        """The Python that the executable names in its first line; empty where it is no Python script."""
        if self.prefixed:
            return ()
        try:
            with open(self.words[0], "rb") as file:
                first = file.readline(256)
            words = shlex.split(first[2:].decode()) if first.startswith(b"#!") else []
        except (OSError, ValueError):
            return ()
        return tuple(words) if words and any("python" in os.path.basename(word) for word in words) else ()


@dataclass
class Process:
    """One process; `waiting` tells whether it still waits for its command."""

    popen: subprocess.Popen[bytes]
    started: float  # time.monotonic()
    waiting: bool = False
    pidfd: int = field(default=-1)

    @property
    def pid(self) -> int:
        """Process id, which is also the id of its session and of its process group."""
        return self.popen.pid

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it runs."""
        return self.popen.poll()

    def begin(self, command: Command) -> None:
        """Give a waiting process its command.

        Raises:
            StartError: the process has ended.
        """
        role = {"arguments": command.words[1:], "cwd": command.cwd, "log": command.log}
        assert self.popen.stdin is not None  # noqa: S101
        try:
            self.popen.stdin.write(json.dumps(role).encode() + b"\n")
            self.popen.stdin.close()
        except OSError as error:
            raise StartError(f"{command.words[0]}: its process has ended before it began: {error}") from error
        self.waiting, self.started = False, time.monotonic()

    def signal(self, number: int) -> None:
        """Send a signal to the process and to its children in the same process group."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    def close(self) -> None:
        """Kill what is left of the process group, and close the pipe and the file descriptor of the process."""
        self.signal(signal.SIGKILL)
        self.popen.wait()
        if self.popen.stdin is not None:
            with contextlib.suppress(OSError):
                self.popen.stdin.close()
        if self.pidfd >= 0:
            os.close(self.pidfd)
            self.pidfd = -1


def start(command: Command) -> Process:
    """Start a process.

    Raises:
        StartError: the system refuses.
    """
    log = None
    if command.log:
        with contextlib.suppress(OSError):  # a full disk must not keep a robot from driving
            log = open(command.log, "wb")  # noqa: SIM115
    try:
        return _popen((*DIE_WITH_OWNER, *command.words), command, command.cwd, stdout=log)
    finally:
        if log:
            log.close()


def prepare(command: Command) -> Process | None:
    """Start a process that does the imports of a Python node and then waits for `begin`; None for any other node.

    Raises:
        StartError: the system refuses.
    """
    interpreter = command.interpreter
    if not interpreter:
        return None
    words = (*DIE_WITH_OWNER, *interpreter, str(WARM_START), command.words[0])
    process = _popen(words, command, "/", stdin=subprocess.PIPE)
    process.waiting = True
    return process


def _popen(words: Sequence[str], command: Command, cwd: str, stdout: Any = None, stdin: int | None = None) -> Process:
    try:
        os.makedirs(command.cwd, exist_ok=True)
        popen = subprocess.Popen(
            words,
            cwd=cwd,
            env=dict(command.environment),
            stdin=stdin if stdin is not None else subprocess.DEVNULL,
            stdout=stdout,
            start_new_session=True,
        )
    except OSError as error:
        raise StartError(f"{command.words[0]}: {error.strerror or error}") from error
    return Process(popen, time.monotonic(), pidfd=os.pidfd_open(popen.pid))


def wait_for_ends(processes: Sequence[Process], timeout: float) -> bool:
    """Wait until all processes have ended; return False where some still run after `timeout` (s)."""
    deadline = time.monotonic() + timeout
    left = [process for process in processes if process.status is None]
    while left:
        remaining = deadline - time.monotonic()
        if remaining <= 0:
            return False
        poll = select.poll()
        for process in left:
            poll.register(process.pidfd, select.POLLIN)
        poll.poll(1000.0 * remaining)
        left = [process for process in left if process.status is None]
    return True


def kill_marked(mark: str, spared: frozenset[int] = frozenset()) -> list[int]:
    """Kill every process with this mark in its environment; return their ids."""
    killed = []
    for process in psutil.process_iter():
        if process.pid in spared or process.pid == os.getpid():
            continue
        with contextlib.suppress(psutil.Error, OSError):
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                process.kill()
                killed.append(process.pid)
    return killed


def start_reaper(mark: str) -> subprocess.Popen[bytes]:
    """Start the reaper: it waits until this process has ended, and then kills every process with the mark."""
    return subprocess.Popen(
        [sys.executable, "-m", __name__, str(os.getpid()), mark], start_new_session=True, stdin=subprocess.DEVNULL
    )


def main() -> None:
    """Wait until process argv[1] has ended, then kill every process with the mark argv[2]."""
    with contextlib.suppress(ProcessLookupError):
        select.select([os.pidfd_open(int(sys.argv[1]))], [], [])
    while kill_marked(sys.argv[2]):  # again: a dying process may have started another one
        time.sleep(0.05)


if __name__ == "__main__":
    main()
