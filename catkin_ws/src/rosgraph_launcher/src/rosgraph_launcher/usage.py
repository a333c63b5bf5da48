"""How much CPU and memory processes use, by what they have used so far."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Use(NamedTuple):
    """What one process has used: s of CPU so far, MB resident."""

    cpu: float
    memory: float


class Sample(NamedTuple):
    """What a process and its descendants have used.

    Attributes:
        at: when it was looked at, s, by a clock of its host that never goes back.
        uses: the use of each process, by its id and the time when it began, because ids are used again.
    """

    at: float
    uses: Mapping[tuple[int, float], Use]

    @property
    def memory(self) -> float:
        """MB resident, of all processes."""
        return sum(use.memory for use in self.uses.values())


def cpu_percent(before: Sample, after: Sample) -> float | None:
    """Return the use of CPU between two samples in percent of one core; None if no time lies between.

    Processes that began in between count from their start, those that ended are not known and count nothing.
    """
    elapsed = after.at - before.at
    if elapsed <= 0.0:
        return None
    nothing = Use(0.0, 0.0)
    used = sum(max(use.cpu - before.uses.get(key, nothing).cpu, 0.0) for key, use in after.uses.items())
    return 100.0 * used / elapsed
