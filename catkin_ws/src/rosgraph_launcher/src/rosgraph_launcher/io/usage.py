"""Reads what processes of this host use."""

from __future__ import annotations

import time

import psutil

from rosgraph_launcher.usage import Sample, Use

_MEGABYTE = 1024 * 1024


def read_sample(pid: int, with_children: bool = True) -> Sample | None:
    """Read a process, with all its descendants if wanted; None if it has ended or can't be read."""
    uses = {}
    try:
        root = psutil.Process(pid)
        for process in [root, *(root.children(recursive=True) if with_children else ())]:
            try:
                with process.oneshot():
                    times = process.cpu_times()
                    memory = process.memory_info().rss / _MEGABYTE
                    uses[process.pid, process.create_time()] = Use(times.user + times.system, memory)
            except (psutil.Error, OSError):
                if process is root:
                    raise
    except (psutil.Error, OSError, ValueError):  # the last of a number that is no process id
        return None
    return Sample(time.monotonic(), uses)
