"""Processes of nodes: each has its own session, and none outlives the process that started it, its owner.

Three things keep a dying owner from leaving processes behind:

- The kernel kills the nodes (parent-death signal).
- A reaper process kills all that the owner started, also the children of nodes: their environment says so.
- An owner that starts kills what an earlier owner with the same mark left. Nobody else kills by the mark alone: an
  owner that hangs may have a successor with the same mark.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from node_kit.io.supervisor import owner_id

from rosgraph_launcher.io.pidfds import open_pidfd
from rosgraph_launcher.io.warm_start.sitecustomize import SETTING
from rosgraph_launcher.launching.options import LONGEST_TIMEOUT

MARK = "MROS_LAUNCHER"
"""Environment variable of every process that a launcher starts; its value names the launcher and its master."""


OWNER = "MROS_LAUNCHER_OWNER"
"""Environment variable beside it; its value names the process of the launcher, see `owner_id`."""

DIE_WITH_OWNER = ("/usr/bin/setpriv", "--pdeathsig", "KILL", "--")
"""From util-linux, which every Debian has. The kernel sends the signal when the *thread* ends that started the process,
so only a main thread may start one."""

WARM_START = str(Path(__file__).with_name("warm_start"))
"""The folder of the module `sitecustomize` that lets a Python node do imports in advance."""

PYTHON = re.compile(r"python(3(\.\d+)?)?")
HARMLESS_FLAGS = {"-u", "-B", "-O", "-OO"}  # of Python: they leave `sitecustomize` and PYTHONPATH as they are

EXEC_TIME = 0.01
"""s, wall, by far more than the kernel takes to put a program in place of another."""

REAP_TIMEOUT = 1.0
"""s, wall, in which a killed process ends, unless the kernel holds it: it waits for a device, or a debugger has it."""


class StartError(Exception):
    """A process can't be started; the message says why."""


@dataclass(frozen=True)
class Command:
    """A command to start.

    Attributes:
        words: the executable and its arguments.
        cwd: the folder in which it is started.
        environment: its whole environment, with the mark.
        log: file to which its standard output is appended; None: it shares the owner's standard output.
        prefixed: whether the words begin with a launch-prefix.
        safe_imports: modules that its package declares to be safe to import in advance, by their first names.
    """

    words: tuple[str, ...]
    cwd: str
    environment: Mapping[str, str]
    log: str | None = None
    prefixed: bool = False
    safe_imports: tuple[str, ...] = ()

    @property
    def is_python(self) -> bool:
        """Whether the executable is a script for Python 3 that may do imports in advance."""
        if self.prefixed:
            return False
        try:
            with open(self.words[0], "rb") as file:
                first = file.readline(256)
            words = shlex.split(first[2:].decode()) if first.startswith(b"#!") else []
        except (OSError, ValueError):
            return False
        if words and os.path.basename(words[0]) == "env":
            words = words[2:] if words[1:2] == ["-S"] else words[1:]
        if not words or not PYTHON.fullmatch(os.path.basename(words[0])) or not HARMLESS_FLAGS.issuperset(words[1:]):
            return False
        found = shutil.which(words[0], path=self.environment.get("PATH"))
        return found is not None and os.path.basename(os.path.realpath(found)).startswith("python3")


@dataclass
class Process:
    """One process; one that was prepared waits until `begin`."""

    executable: str
    popen: subprocess.Popen[bytes]
    started: float  # time.monotonic()
    pidfd: int = -1  # tells its end; -1: closed
    gate: int = -1  # file descriptor to which its permission to begin is written; -1: it has begun
    is_foreign: bool = False  # whether the system has refused a signal, because another user runs it now

    @property
    def pid(self) -> int:
        """Process id, which is also the id of its session and of its process group."""
        return self.popen.pid

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it runs."""
        return self.popen.poll()

    @property
    def is_stopped(self) -> bool:
        """Whether a signal has stopped it (SIGSTOP, SIGTSTP), so that it heeds nothing but SIGCONT and SIGKILL."""
        with contextlib.suppress(psutil.Error, OSError):
            return psutil.Process(self.pid).status() == psutil.STATUS_STOPPED
        return False

    def begin(self) -> None:
        """Let a prepared process begin.

        Raises:
            StartError: the process has ended.
        """
        gate, self.gate = self.gate, -1
        try:
            os.write(gate, b"\n")
        except OSError as error:
            raise StartError(f"{self.executable}: its process has ended before it began: {error}") from error
        finally:
            os.close(gate)
        self.started = time.monotonic()

    def signal(self, number: int) -> None:
        """Send a signal to the process and to its children in the same process group.

        A group that another user runs, such as root by `sudo` in a launch-prefix, gets none: then `is_foreign` is set.
        """
        try:
            os.killpg(self.pid, number)
        except ProcessLookupError:
            pass
        except PermissionError:
            self.is_foreign = True

    def close(self) -> bool:
        """Do what `close_all` does with this process; return whether it has ended."""
        return not close_all([self])

    def close_descriptors(self) -> None:
        """Close the file descriptors; nothing but `status` and `signal` may be used from then on."""
        for descriptor in (self.gate, self.pidfd):
            if descriptor >= 0:
                os.close(descriptor)
        self.gate = self.pidfd = -1


def check_host() -> None:
    """Refuse a host that lacks what keeps processes from outliving their owner.

    Raises:
        StartError: it does; with the remedy.
    """
    if not os.access(DIE_WITH_OWNER[0], os.X_OK):
        raise StartError(f"there is no {DIE_WITH_OWNER[0]}: install util-linux")
    try:
        os.close(open_pidfd(os.getpid()))
    except OSError as error:
        raise StartError(f"the kernel has no pidfd_open ({error.strerror}): use Linux 5.3 or newer") from error


def start(command: Command) -> Process:
    """Start a process.

    Raises:
        StartError: the system refuses.
    """
    return _start(command, command.environment)


def prepare(command: Command) -> Process | None:
    """Start a process that does imports of a Python node and then waits for `begin`; None for any other node.

    Raises:
        StartError: the system refuses.
    """
    if not command.is_python:
        return None
    try:
        wait, gate = os.pipe()
    except OSError as error:
        raise StartError(f"{command.words[0]}: {error.strerror or error}") from error
    try:
        python_path = command.environment.get("PYTHONPATH")
        environment = {
            **command.environment,
            SETTING: f"{wait}:1:{' '.join(command.safe_imports)}:{'' if python_path is None else f'={python_path}'}",
            "PYTHONPATH": os.pathsep.join(filter(None, [WARM_START, python_path])),
        }
        process = _start(command, environment, (wait,))
    except StartError:
        os.close(gate)
        raise
    finally:
        os.close(wait)
    process.gate = gate
    return process


def _start(command: Command, environment: Mapping[str, str], pass_fds: tuple[int, ...] = ()) -> Process:
    log = None
    if command.log:
        with contextlib.suppress(OSError, ValueError):  # a full disk must not keep a robot from driving
            log = open(command.log, "ab")  # noqa: SIM115
    try:
        os.makedirs(command.cwd, exist_ok=True)
        popen = subprocess.Popen(
            (*DIE_WITH_OWNER, *command.words),
            cwd=command.cwd,
            env={**environment, OWNER: owner_id(os.getpid())},
            stdin=subprocess.DEVNULL,
            stdout=log,
            start_new_session=True,
            pass_fds=pass_fds,
        )
    except (OSError, ValueError) as error:  # ValueError: a word has a null character
        raise StartError(f"{command.words[0]}: {getattr(error, 'strerror', '') or error}") from error
    finally:
        if log:
            log.close()
    process = Process(command.words[0], popen, time.monotonic())
    try:
        process.pidfd = open_pidfd(process.pid)
    except OSError as error:
        process.signal(signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            popen.wait(REAP_TIMEOUT)
        raise StartError(f"{command.words[0]}: its end can't be followed: {error.strerror or error}") from error
    return process


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
        poll.poll(1000.0 * min(remaining, LONGEST_TIMEOUT))
        left = [process for process in left if process.status is None]
    return True


def close_all(processes: Sequence[Process]) -> list[Process]:
    """Kill what is left of the process groups, wait for the ends, and close the file descriptors of the processes.

    Returns:
        The processes that have not ended within REAP_TIMEOUT: the kernel holds them, and they end later; or another
        user runs them, and they may go on.
    """
    for process in processes:
        process.signal(signal.SIGKILL)
    wait_for_ends(processes, REAP_TIMEOUT)
    for process in processes:
        process.close_descriptors()
    return [process for process in processes if process.status is None]


def kill_marked(mark: str, owner: str = "") -> list[tuple[int, float]]:
    """Kill every process with this mark in its environment; return the id and the start of each.

    Args:
        mark: names the launcher and its master.
        owner: kill only what this one has started; empty: kill all.

    Raises:
        OSError: the system has no descriptor for looking at the processes.
    """
    killed: list[tuple[int, float]] = []
    unread: list[psutil.Process] = []
    for process in psutil.process_iter():
        if process.pid != os.getpid():
            _kill_if_marked(process, mark, owner, killed, unread)
    if unread:
        time.sleep(EXEC_TIME)
    for process in unread:
        _kill_if_marked(process, mark, owner, killed, [])
    return killed


def _kill_if_marked(
    process: psutil.Process, mark: str, owner: str, killed: list[tuple[int, float]], unread: list[psutil.Process]
) -> None:
    """Kill a process if it is meant, and add it to the killed; or to the unread ones, where it has no environment.

    A process has none for a moment while it begins to run its program. Threads of the kernel never have any.
    """
    with contextlib.suppress(psutil.Error, OSError):
        environment = process.environ()
        if not environment:
            unread.append(process)
        if environment.get(MARK) != mark or (owner and environment.get(OWNER) != owner):
            return
        if process.status() != psutil.STATUS_ZOMBIE:
            process.kill()
            killed.append((process.pid, process.create_time()))


def start_reaper(mark: str) -> subprocess.Popen[bytes]:
    """Start the reaper: it waits until this process has ended, and then kills what it started with the mark."""
    pid = os.getpid()
    words = [sys.executable, "-m", __name__, str(pid), mark, owner_id(pid)]
    return subprocess.Popen(words, start_new_session=True, stdin=subprocess.DEVNULL)


def main() -> None:
    """Wait until process argv[1] has ended, then kill every process with the mark argv[2] and the owner argv[3].

    Again and again while there are others than before, which a dying process may have started. What was killed and
    stays is not waited for: the kernel may hold it for long, and a new launcher has nodes of the same mark.
    """
    with contextlib.suppress(ProcessLookupError):
        select.select([open_pidfd(int(sys.argv[1]))], [], [])
    killed: set[tuple[int, float]] = set()
    while not killed.issuperset(found := kill_marked(*sys.argv[2:4])):
        killed.update(found)
        time.sleep(0.05)


if __name__ == "__main__":
    main()
