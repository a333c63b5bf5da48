"""The processes of drivers on this host: that one has ended, and how it is started again as it was started before."""

from __future__ import annotations

import os
import select
import subprocess
from dataclasses import dataclass
from typing import TYPE_CHECKING

import psutil
from rosgraph_launcher.io.processes import DIE_WITH_OWNER

if TYPE_CHECKING:
    from collections.abc import Mapping


class DriverError(RuntimeError):
    """A process cannot be watched or started; the message names the component."""


@dataclass(frozen=True)
class _Command:
    """How a process was started."""

    words: tuple[str, ...]
    cwd: str
    environment: Mapping[str, str]


class DriverProcesses:
    """Watches processes by the names of their components, and starts those again that have ended.

    What it starts, it starts from the main thread, and ends with that.
    """

    def __init__(self) -> None:
        """Watch nothing."""
        self._commands: dict[str, _Command] = {}
        self._pidfds: dict[int, str] = {}  # file descriptor -> component
        self._started: list[subprocess.Popen[bytes]] = []

    @property
    def running(self) -> frozenset[str]:
        """The components whose processes are watched and have not ended."""
        return frozenset(self._pidfds.values())

    def watch(self, component: str, pid: int) -> None:
        """Watch a process from now on, and keep in mind how it was started.

        Raises:
            DriverError: it has ended, or belongs to another user.
        """
        try:
            pidfd = os.pidfd_open(pid)
            process = psutil.Process(pid)
            command = _Command(tuple(process.cmdline()), process.cwd(), process.environ())
        except (OSError, psutil.Error) as error:
            raise DriverError(f"{component}: its process {pid} cannot be watched: {error}") from error
        self._commands[component] = command
        self._pidfds[pidfd] = component

    def ended(self) -> list[str]:
        """Return the components whose processes have ended since the last call."""
        poll = select.poll()
        for pidfd in self._pidfds:
            poll.register(pidfd, select.POLLIN)
        ended = []
        for pidfd, _ in poll.poll(0):
            ended.append(self._pidfds.pop(pidfd))
            os.close(pidfd)
        self._started = [process for process in self._started if process.poll() is None]
        return ended

    def start(self, component: str) -> None:
        """Start a process again: the same command in the same folder with the same environment.

        Raises:
            DriverError: it was never watched, or cannot be started.
        """
        command = self._commands.get(component)
        if command is None:
            raise DriverError(f"{component}: nobody knows how its process was started: it never ran on this host")
        try:
            process = subprocess.Popen(
                (*DIE_WITH_OWNER, *command.words),
                cwd=command.cwd,
                env=dict(command.environment),
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
            self._started.append(process)
            self._pidfds[os.pidfd_open(process.pid)] = component
        except OSError as error:
            raise DriverError(f"{component}: cannot be started again: {error}") from error
