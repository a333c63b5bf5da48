"""CPU and memory of processes, children included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import psutil
from metacontrol_msgs.msg import DiagnosticWords as Words

from rosgraph_monitor.diagnostics.status import Level, Status

if TYPE_CHECKING:
    from collections.abc import Mapping

_MEGABYTE = 1024 * 1024
ProcessKey = tuple[int, float]
"""Process id and time of creation: ids are used again."""


@dataclass(frozen=True)
class Sample:
    """CPU seconds of each process so far, and MB resident of all, at a time in wall s."""

    at: float
    cpu_s: Mapping[ProcessKey, float]
    memory_mb: float


def read_sample(pid: int, now: float, with_children: bool = True) -> Sample | None:
    """Read a process, with all its descendants if wanted; None if it has ended."""
    cpu: dict[ProcessKey, float] = {}
    memory = 0.0
    try:
        root = psutil.Process(pid)
        for process in [root, *(root.children(recursive=True) if with_children else ())]:
            try:
                with process.oneshot():
                    times = process.cpu_times()
                    cpu[process.pid, process.create_time()] = times.user + times.system
                    memory += process.memory_info().rss / _MEGABYTE
            except psutil.Error:
                if process is root:
                    raise
    except psutil.Error:
        return None
    return Sample(now, cpu, memory)


def cpu_percent(before: Sample, after: Sample) -> float | None:
    """Return the use of CPU between two samples in percent of one core; None if no time lies between.

    Processes that began in between count from their start, those that ended are not known and count nothing.
    """
    elapsed = after.at - before.at
    if elapsed <= 0.0:
        return None
    used = sum(max(total - before.cpu_s.get(key, 0.0), 0.0) for key, total in after.cpu_s.items())
    return 100.0 * used / elapsed


class UsageMeter:
    """Measures the nodes that it is given, from one call to the next."""

    def __init__(self, alone: frozenset[str] = frozenset()) -> None:
        """Measure these nodes without their child processes: a launcher's children are nodes of their own."""
        self._alone = alone
        self._before: dict[tuple[str, int], Sample] = {}

    def measure(self, pids: Mapping[str, int], now: float) -> list[Status]:
        """Return "CPU Usage" and "Memory Usage" of each node, given its process id; CPU from the second call on."""
        statuses = []
        samples = {}
        for node, pid in pids.items():
            sample = read_sample(pid, now, node not in self._alone)
            if sample is None:
                continue
            samples[node, pid] = sample
            before = self._before.get((node, pid))
            cpu = cpu_percent(before, sample) if before else None
            if cpu is not None:
                statuses.append(Status(Level.OK, node, Words.CPU_USAGE, ((node, f"{cpu:.2f}"),)))
            statuses.append(Status(Level.OK, node, Words.MEMORY_USAGE, ((node, f"{sample.memory_mb:.1f}"),)))
        self._before = samples
        return statuses
