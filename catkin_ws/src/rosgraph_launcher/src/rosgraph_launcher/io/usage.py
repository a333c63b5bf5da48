"""Reads what processes of this host use."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Iterator, Mapping

import psutil

from rosgraph_launcher.usage import Sample, Use

_MEGABYTE = 1024 * 1024


def read_samples(pids: Iterable[int], alone: Collection[int] = ()) -> dict[int, Sample]:
    """Read processes, each with all its descendants; those that have ended or can't be read are left out.

    However many are asked for, by whomever, each process of the host is looked at once.

    Args:
        pids: their ids, or numbers that are none.
        alone: those whose descendants do not count.
    """
    there = _processes()
    wanted, lonely = dict.fromkeys(pid for pid in pids if pid in there), set(alone)
    children = _children(there) if wanted.keys() - lonely else {}
    uses: dict[int, tuple[tuple[int, float], Use] | None] = {}
    samples = {}
    for pid in wanted:
        found = {}
        for one in [pid] if pid in lonely else _family(pid, children):
            if one not in uses:
                uses[one] = _read(there[one])
            use = uses[one]
            if use is not None:
                found[use[0]] = use[1]
        if uses[pid] is not None:
            samples[pid] = Sample(time.monotonic(), found)
    return samples


def _processes() -> dict[int, psutil.Process]:
    found = {}
    try:
        for pid in psutil.pids():
            try:
                found[pid] = psutil.Process(pid)
            except (psutil.Error, OSError):
                continue  # it has ended, or no descriptor is left
    except OSError:
        return {}
    return found


def _children(there: Mapping[int, psutil.Process]) -> dict[int, list[int]]:
    """Return the children of each process; ids are used again, so a child is younger."""
    found: dict[int, list[int]] = {}
    for pid, process in there.items():
        try:
            parent = there.get(process.ppid())
            if parent is not None and parent.create_time() <= process.create_time():
                found.setdefault(parent.pid, []).append(pid)
        except (psutil.Error, OSError):
            continue
    return found


def _family(pid: int, children: Mapping[int, list[int]]) -> Iterator[int]:
    """Yield a process and its descendants, each once."""
    waiting, known = [pid], {pid}
    while waiting:
        one = waiting.pop()
        yield one
        younger = [child for child in children.get(one, ()) if child not in known]
        known.update(younger)
        waiting += younger


def _read(process: psutil.Process) -> tuple[tuple[int, float], Use] | None:
    try:
        with process.oneshot():
            times = process.cpu_times()
            memory = process.memory_info().rss / _MEGABYTE
            return (process.pid, process.create_time()), Use(times.user + times.system, memory)
    except (psutil.Error, OSError):
        return None
