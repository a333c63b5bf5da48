"""The figures of many bad inputs, which can be kept in a file and added to."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from helpers.soaking import read_figures, write_figures

from bad_input.trial import ACCEPTED, BROKEN, REFUSED, Verdict


@dataclass
class Row:
    """What the inputs of one subject came to; times in s of CPU, memory in bytes."""

    accepted: int = 0
    refused: int = 0
    broken: int = 0
    slowest: float = 0.0
    largest: int = 0

    @property
    def inputs(self) -> int:
        """How many there were."""
        return self.accepted + self.refused + self.broken


@dataclass
class Tally:
    """What many inputs came to.

    Attributes:
        tree: the code that was run.
        seed: of the inputs.
        done: numbers of the inputs that were tried: all below it.
        seconds: wall time that was spent, s.
        rows: by subject.
        broken: what was broken, by subject and problem: how often, and the number of the first input.
    """

    tree: str
    seed: int
    done: int = 0
    seconds: float = 0.0
    rows: dict[str, Row] = field(default_factory=dict)
    broken: dict[str, list[int]] = field(default_factory=dict)

    def add(self, number: int, subject: str, verdict: Verdict) -> bool:
        """Add what an input came to; return whether it is broken as none was before."""
        row = self.rows.setdefault(subject, Row())
        setattr(row, verdict.outcome, getattr(row, verdict.outcome) + 1)
        row.slowest = max(row.slowest, verdict.cpu)
        row.largest = max(row.largest, verdict.memory)
        if verdict.outcome != BROKEN:
            return False
        known = self.broken.setdefault(f"{subject}: {verdict.problem}", [0, number])
        known[0] += 1
        return known[0] == 1

    def write(self, path: Path) -> None:
        """Write the figures, at once or not at all."""
        write_figures(path, asdict(self))

    @classmethod
    def read(cls, path: Path) -> Tally:
        """Read figures that `write` has written.

        Raises:
            FiguresError: the file has another form.
        """

        def make(content: dict[str, Any]) -> Tally:
            content["rows"] = {name: Row(**row) for name, row in content["rows"].items()}
            return cls(**content)

        return read_figures(path, make)

    def report(self) -> str:
        """Return the figures as a page in Markdown."""
        count = sum(row.inputs for row in self.rows.values())
        lines = [
            f"{count:,} bad inputs (seed {self.seed}) for {len(self.rows)} readers and listeners of code {self.tree}",
            f"in {self.seconds / 3600.0:.2f} h; broken: {sum(row.broken for row in self.rows.values())}, "
            f"in {len(self.broken)} ways",
            "",
            "| who takes it | inputs | accepted | refused | broken | slowest (s of CPU) | largest growth (MB) |",
            "|---|---|---|---|---|---|---|",
        ]
        for name, row in sorted(self.rows.items()):
            counts = " | ".join(f"{getattr(row, which):,}" for which in ("inputs", ACCEPTED, REFUSED, BROKEN))
            lines.append(f"| {name} | {counts} | {row.slowest:.2f} | {row.largest / 1e6:.0f} |")
        lines += [""] if self.broken else []
        lines += [f"- {what}: {times} times, first input {number}" for what, (times, number) in self.broken.items()]
        return "\n".join(lines) + "\n"
