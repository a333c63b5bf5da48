"""The processes of nodes: started in a session of their own, watched, ended; none outlives its owner.

Three nets catch what a dying owner would leave behind: the kernel kills the nodes themselves (parent-death signal), a
reaper of our own kills whatever carries the owner's mark in its environment, children of nodes included, and an owner
that starts kills what an earlier one of the same name left.
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
"""From util-linux, which every Debian has. The signal comes when the *thread* that started the process ends, so only a
main thread may start one."""

WARM_START = Path(__file__).with_name("warm_start.py")


class StartError(Exception):
    """A process can't be started; the message says why."""


@dataclass(frozen=True)
class Command:
    """What to start.

    Attributes:
        words: executable with its arguments.
        cwd: folder to start it in.
        environment: the whole of it, with the mark.
        log: file for the standard output; None: it goes where the owner's goes.
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
    """One process; `waiting` while it has not been given its role."""

    popen: subprocess.Popen[bytes]
    started: float  # time.monotonic()
    waiting: bool = False
    pidfd: int = field(default=-1)

    @property
    def pid(self) -> int:
        """Process id, which is the id of its session and group, too."""
        return self.popen.pid

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it runs."""
        return self.popen.poll()

    def begin(self, command: Command) -> None:
        """Give a waiting process its role.

        Raises:
            StartError: it has ended.
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
        """Send a signal to the process and its children, as far as they are in its group."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    def close(self) -> None:
        """Kill what is left of the process's group, and free what the owner holds of it."""
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
    """Start a Python node's process, which does its imports and waits for `begin`; None where it is no Python node.

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
    """Wait until all processes have ended; False where some have not within `timeout` (s)."""
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
    """Kill every process that carries a mark in its environment; return their ids."""
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
    """Start the process that waits for the end of this one, however it comes, and then kills what carries the mark."""
    return subprocess.Popen(
        [sys.executable, "-m", __name__, str(os.getpid()), mark], start_new_session=True, stdin=subprocess.DEVNULL
    )


def main() -> None:
    """Reap: wait for the end of process argv[1], then kill whatever carries the mark argv[2]."""
    with contextlib.suppress(ProcessLookupError):
        select.select([os.pidfd_open(int(sys.argv[1]))], [], [])
    while kill_marked(sys.argv[2]):  # again: a dying process may have started another one
        time.sleep(0.05)


if __name__ == "__main__":
    main()
