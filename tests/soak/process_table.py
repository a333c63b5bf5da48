"""The processes of a mission, read from outside: whoever has the mission's mark in its environment."""

from __future__ import annotations

import os
import re
import time
from dataclasses import dataclass, field

import psutil

from soak.observed import Process, Sample, Usage
from soak.plan import NODE

MARK = "MROS_SOAK_MISSION"
"""Variable in the environment of a mission's command, which all that it starts inherit."""

_NAME = re.compile(r"^__name:=/?(.+)$")
_SETTLED_S = 3.0
"""Age from which on a process has become what it will be: before, it may not have executed its program yet."""


@dataclass
class _Known:
    process: psutil.Process
    role: str
    ours: bool
    settled: bool


@dataclass
class ProcessTable:
    """Reads the processes whose ROS_LOG_DIR is in a mission's folder, or that have its mark."""

    folder: str
    _known: dict[int, _Known] = field(default_factory=dict)

    def sample(self) -> Sample:
        """Return the processes now; those that have ended but were not collected do not count."""
        now = time.monotonic()
        found = []
        for known in self._ours():
            try:
                status = known.process.status()
            except psutil.Error:
                continue
            if status not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
                found.append((known, status == psutil.STATUS_STOPPED))
        roles = [known.role for known, _ in found]
        return Sample(
            now,
            tuple(
                Process(known.process.pid, known.role, stopped, roles.count(known.role) < 2 or _listens(known.process))
                for known, stopped in found
            ),
        )

    def usages(self) -> list[Usage]:
        """Return what memory and descriptors each process has."""
        now = time.monotonic()
        found = []
        for known in self._ours():
            if known.role == NODE and not _listens(known.process):  # a warm process: its life as a node is to come
                continue
            try:
                memory, descriptors = known.process.memory_info().rss / 1e6, known.process.num_fds()
            except psutil.Error:
                continue
            found.append(Usage(now, known.process.pid, known.role, round(memory, 1), descriptors))
        return found

    def find(self, role: str) -> list[psutil.Process]:
        """Return the processes of a role; those that serve come first."""
        return sorted(
            (known.process for known in self._ours() if known.role == role), key=lambda one: not _listens(one)
        )

    def commands(self) -> list[str]:
        """Return the command lines of the processes that have not ended."""
        told = []
        for known in self._ours():
            try:
                if known.process.status() != psutil.STATUS_ZOMBIE:
                    told.append(f"{known.process.pid} {' '.join(known.process.cmdline())}"[:120])
            except psutil.Error:
                continue
        return told

    def processes(self) -> list[psutil.Process]:
        """Return all processes of the mission."""
        return [known.process for known in self._ours()]

    def _ours(self) -> list[_Known]:
        there = psutil.pids()
        for pid in self._known.keys() - set(there):
            del self._known[pid]
        for pid in there:
            known = self._known.get(pid)
            if known is None or not known.settled:
                looked = self._look(pid)
                if looked is None:
                    self._known.pop(pid, None)
                else:
                    self._known[pid] = looked
        return [known for known in self._known.values() if known.ours]

    def _look(self, pid: int) -> _Known | None:
        if pid == os.getpid():
            return _Known(psutil.Process(pid), "", False, True)
        try:
            process = psutil.Process(pid)
            settled = time.time() - process.create_time() > _SETTLED_S
            environment = process.environ()
            ours = environment.get("ROS_LOG_DIR", "").startswith(self.folder) or environment.get(MARK) == self.folder
            return _Known(process, role_of(process.cmdline()) if ours else "", ours, settled)
        except psutil.AccessDenied:
            return _Known(psutil.Process(pid), "", False, False)
        except (psutil.Error, OSError):
            return None


def role_of(command: list[str]) -> str:
    """Return the role of a process from its command line: a node's name, or what else it is; empty: nothing known."""
    for word in command:
        if (match := _NAME.match(word)) is not None and "rosmaster" not in command:
            return match[1]
    text = " ".join(command)
    for part, role in _PROGRAMS.items():
        if part in text:
            return role
    return ""


_PROGRAMS = {
    "pellet/child.py": "pellet",
    "soak.master_proxy": "proxy",
    "rosmaster --core": "master",
    "bin/roslaunch": "roslaunch",
    "rosgraph_launcher.io.processes": "guardian",
    "metacontrol run": "mission",
}


def _listens(process: psutil.Process) -> bool:
    try:
        return any(one.status == psutil.CONN_LISTEN for one in process.net_connections("tcp"))
    except psutil.Error:
        return False
