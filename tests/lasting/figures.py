"""What was measured of a system that lives for hours, and whether it is as it was at the start: pure functions."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import NamedTuple

from soak.records import quantile

SHARE = 0.1
"""Of a run: its start and its end. The start comes after the first of these shares, when all has been used once."""
MORE_MEMORY, MORE_MB = 1.1, 5.0
"""A process may have so many times the memory of its start, and so many MB on top."""
MORE_DESCRIPTORS, MORE_THREADS = 1.3, 1.3
"""The same. Connections of nodes that were killed are closed later, so both go up and down."""
MORE = 8
"""Descriptors or threads on top."""


class Reading(NamedTuple):
    """What a process has: `t` in s since its system started, memory in MB."""

    t: float
    pid: int
    role: str
    memory: float
    descriptors: int
    threads: int


class Recovery(NamedTuple):
    """A fault that struck at `struck`, s, all of which was over at `t`, s.

    `seconds` is how long it took from the end of the fault until all was well again; None: it was not.
    """

    t: float
    kind: str
    note: str
    seconds: float | None
    struck: float


class Goal(NamedTuple):
    """How a goal ended at `t`: succeeded, late, or in another way that actionlib has a name for."""

    t: float
    outcome: str
    seconds: float


class End(NamedTuple):
    """The end of a system, and what is broken beside what follows from the figures."""

    t: float
    broken: list[str]


@dataclass
class Run:
    """A system, from its start to its end."""

    readings: list[Reading] = field(default_factory=list)
    recoveries: list[Recovery] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    stretches: list[float] = field(default_factory=list)
    end: End | None = None

    @property
    def lasted(self) -> float:
        """How long it lived, s."""
        return max([0.0, *(reading.t for reading in self.readings), self.end.t if self.end else 0.0])


class Change(NamedTuple):
    """What a process that lived all the time had at the start and at the end of a run."""

    role: str
    memory: tuple[float, float]
    descriptors: tuple[int, int]
    threads: tuple[int, int]

    @property
    def is_flat(self) -> bool:
        """Whether it is as it was."""
        return (
            self.memory[1] <= MORE_MEMORY * self.memory[0] + MORE_MB
            and self.descriptors[1] <= MORE_DESCRIPTORS * self.descriptors[0] + MORE
            and self.threads[1] <= MORE_THREADS * self.threads[0] + MORE
        )


_KINDS = {"reading": Reading, "recovery": Recovery, "goal": Goal, "end": End}


def line(what: str, content: Sequence[object]) -> str:
    """Return something measured as a line."""
    return json.dumps([what, *content]) + "\n"


def read(path: Path) -> Run:
    """Return what a file of lines tells of a run; a line that was cut off is left out."""
    run = Run()
    places = {"reading": run.readings, "recovery": run.recoveries, "goal": run.goals}
    for text in path.read_text(encoding="utf-8").splitlines():
        try:
            what, *content = json.loads(text)
        except ValueError:
            continue
        if what == "stretch":
            run.stretches.append(content[0])
        elif what == "end":
            run.end = End(*content)
        else:
            places[what].append(_KINDS[what](*content))  # type: ignore[attr-defined]
    return run


def changes(run: Run) -> list[Change]:
    """Return what the processes had at the start and the end that lived all the time, by role."""
    share = SHARE * run.lasted
    lives: dict[tuple[str, int], list[Reading]] = defaultdict(list)
    for reading in run.readings:
        lives[reading.role, reading.pid].append(reading)
    found = []
    for (role, _), life in sorted(lives.items()):
        first = [one for one in life if share <= one.t <= 2.0 * share]
        last = [one for one in life if one.t >= run.lasted - share]
        if role and first and last:
            found.append(
                Change(role, *(_pair(first, last, name) for name in ("memory", "descriptors", "threads")))  # type: ignore[arg-type]
            )
    return found


def _pair(first: Iterable[Reading], last: Iterable[Reading], name: str) -> tuple[float, float]:
    return tuple(median(getattr(one, name) for one in part) for part in (first, last))  # type: ignore[return-value]


def broken(run: Run) -> list[str]:
    """Return what is broken in a run, a line each."""
    found = list(run.end.broken) if run.end else []
    for one in changes(run):
        if not one.is_flat:
            found.append(
                f"{one.role} grows: {one.memory[0]:.0f} to {one.memory[1]:.0f} MB, {one.descriptors[0]:g} to "
                f"{one.descriptors[1]:g} descriptors, {one.threads[0]:g} to {one.threads[1]:g} threads"
            )
    found += [f"not well again after {one.kind} ({one.note})" for one in run.recoveries if one.seconds is None]
    found += [
        f"a goal ended at {goal.t:.0f} s as {goal.outcome}, which nothing explains that struck then"
        for goal in run.goals
        if goal.outcome != REACHED and not any(_explains(one, goal) for one in run.recoveries)
    ]
    return found


REACHED = "succeeded"
"""How a goal ends that is reached."""
_OBEYED: dict[str, tuple[str, ...]] = {
    "/move_base/cancel": ("preempted", "recalled"),
    "/move_base/goal": ("preempted", "recalled"),
    "/move_base_simple/goal": ("preempted", "recalled"),
    "/move_base/status": ("lost",),
    "/tf": ("aborted",),
}
"""By topic: how goals may end on which wrong words are published there, because all clients and servers obey them."""


def _explains(one: Recovery, goal: Goal) -> bool:
    """Tell whether a goal ended as it did because somebody published wrong words just then."""
    told = one.note.replace(",", "").split()
    return one.struck <= goal.t <= one.t and any(
        topic in told and goal.outcome in outcomes for topic, outcomes in _OBEYED.items()
    )


def progress(runs: Sequence[Run], hours: float) -> str:
    """Return how far the runs are, in one line."""
    lasted = sum(run.lasted for run in runs) / 3600.0
    recoveries = [one for run in runs for one in run.recoveries]
    bad = sum(one.seconds is None for one in recoveries)
    return f"{lasted:.2f} of {hours:g} h, {len(recoveries):,} faults, {bad} after which not all was well again"


def report(runs: Sequence[Run], tree: str, seed: int) -> str:
    """Return the figures as a page in Markdown."""
    hours = sum(run.lasted for run in runs) / 3600.0
    stretches = [stretch for run in runs for stretch in run.stretches]
    faults = sum(len(run.recoveries) for run in runs)
    lines = [
        f"{len(runs)} systems of seed {seed} on code {tree}, {hours:.2f} h, {faults} faults",
        f"goals: {_goals(runs)}",
        f"stretch of the observer's work, median: {median(stretches or [1.0]):.2f}",
    ]
    for number, run in enumerate(runs):
        lines += ["", f"System {number}, {run.lasted / 3600.0:.2f} h:", "", *_table(run), "", *_latencies(run)]
        lines += ["", *(f"- {what}" for what in broken(run) or ["nothing broken"])]
    return "\n".join(lines) + "\n"


def _goals(runs: Sequence[Run]) -> str:
    counts: dict[str, int] = defaultdict(int)
    for run in runs:
        for goal in run.goals:
            counts[goal.outcome] += 1
    return ", ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"


def _table(run: Run) -> Iterable[str]:
    yield "| process | memory at the start (MB) | at the end | descriptors | at the end | threads | at the end |"
    yield "|---|---|---|---|---|---|---|"
    for one in changes(run):
        pairs = (*one.memory, *one.descriptors, *one.threads)
        yield f"| {one.role} | " + " | ".join(f"{value:.0f}" for value in pairs) + " |"


def _latencies(run: Run) -> Iterable[str]:
    """Yield how long recoveries took in the first and the last quarter of a run."""
    quarter = run.lasted / 4.0
    yield "| recoveries | faults | median (s) | p95 (s) |"
    yield "|---|---|---|---|"
    parts = {
        "first quarter": [one for one in run.recoveries if one.t < quarter],
        "last quarter": [one for one in run.recoveries if one.t >= run.lasted - quarter],
    }
    for name, part in parts.items():
        times = sorted(one.seconds for one in part if one.seconds is not None)
        shown = f"{quantile(times, 0.5):.1f} | {quantile(times, 0.95):.1f}" if times else "- | -"
        yield f"| {name} | {len(part)} | {shown} |"
