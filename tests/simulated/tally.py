"""The figures of many histories, which can be kept in a file and added to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from helpers.soaking import read_figures, write_figures

from simulated.faults import Kind
from simulated.history import History, Outcome


@dataclass
class Tally:
    """What many histories came to.

    Attributes:
        tree: the code that was run.
        first_seed: the first history's.
        next_seed: the next history's.
        seconds: wall time that was spent, s.
        steps: events of all histories.
        struck: how often each fault struck, and how many messages were sent, lost, delayed.
        systems: histories by system.
        recoveries: for each kind of fault, and for "all", histories by their recovery time, s.
        failed: seeds of histories in which something was broken, with what it was.
    """

    tree: str
    first_seed: int
    next_seed: int
    seconds: float = 0.0
    steps: int = 0
    struck: Counter[str] = field(default_factory=Counter)
    systems: Counter[str] = field(default_factory=Counter)
    recoveries: dict[str, Counter[str]] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def histories(self) -> int:
        """How many histories were run."""
        return self.next_seed - self.first_seed

    @property
    def faults(self) -> int:
        """How many faults struck."""
        return sum(self.struck[kind.value] for kind in Kind)

    def add(self, told: History, outcome: Outcome) -> None:
        """Add a history."""
        self.next_seed = told.seed + 1
        self.steps += outcome.steps
        self.struck += outcome.counts
        self.systems[told.system] += 1
        if outcome.broken:
            self.failed[str(told.seed)] = outcome.broken[0].splitlines()[0]
        elif outcome.recovery is not None:
            for kind in {"all", *(fault.kind.value for fault in told.faults)}:
                self.recoveries.setdefault(kind, Counter())[f"{outcome.recovery:.1f}"] += 1

    def write(self, path: Path) -> None:
        """Write the figures, at once or not at all."""
        write_figures(path, vars(self))

    @classmethod
    def read(cls, path: Path) -> Tally:
        """Read figures that `write` has written.

        Raises:
            FiguresError: the file has another form.
        """

        def make(content: dict[str, Any]) -> Tally:
            for name in ("struck", "systems"):
                content[name] = Counter(content[name])
            content["recoveries"] = {kind: Counter(times) for kind, times in content["recoveries"].items()}
            return cls(**content)

        return read_figures(path, make)

    def report(self) -> str:
        """Return the figures as a page in Markdown."""
        lines = [
            f"{self.histories:,} histories (seeds {self.first_seed} to {self.next_seed - 1}) of code {self.tree}",
            f"in {self.seconds / 3600.0:.2f} h: {self.steps:,} steps, {self.faults:,} faults",
            f"histories in which something was broken: {len(self.failed)}",
            f"systems: {', '.join(f'{name} {count:,}' for name, count in sorted(self.systems.items()))}",
            "",
            "| fault | struck | histories that recovered | recovery, median (s) | p95 (s) | longest (s) |",
            "|---|---|---|---|---|---|",
        ]
        for kind in ("all", *sorted(kind.value for kind in Kind)):
            times = self.recoveries.get(kind, Counter())
            struck = self.faults if kind == "all" else self.struck[kind]
            shown = " | ".join(f"{quantile(times, share):.1f}" if times else "-" for share in (0.5, 0.95, 1.0))
            lines.append(f"| {kind} | {struck:,} | {times.total():,} | {shown} |")
        others = {kind.value for kind in Kind}
        lines += ["", ", ".join(f"{name} {n:,}" for name, n in sorted(self.struck.items()) if name not in others)]
        lines += [f"- seed {seed}: {what}" for seed, what in self.failed.items()]
        return "\n".join(lines) + "\n"


def quantile(times: Mapping[str, int], share: float) -> float:
    """Return the time that a share of the histories kept, s."""
    ordered = sorted((float(time), count) for time, count in times.items())
    wanted, seen = share * sum(times.values()), 0
    for time, count in ordered:
        seen += count
        if seen >= wanted:
            return time
    return ordered[-1][0]
