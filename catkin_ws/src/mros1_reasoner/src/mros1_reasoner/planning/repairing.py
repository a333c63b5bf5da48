"""Whether to repair what does not work first, or to take another design first: by what each is expected to lose.

A loss is the utility that is missing, in utility times s, over the time for which the choice counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Odds:
    """What to expect of repairs.

    Attributes:
        duration: until all is repaired, s.
        success: the probability of that.
    """

    duration: float
    success: float


@dataclass(frozen=True)
class Stakes:
    """What depends on the choice.

    Attributes:
        repaired: utility of the running design, once it works again.
        other: utility of the design that could be taken in its place; None where none keeps every limit.
        nothing: what it is worth that neither of them works.
        change: how long a change from one to the other takes, s.
        outlook: for how long the choice counts, s.
        returns: whether the running design would be taken again after a change, once it is repaired.
    """

    repaired: float
    other: float | None
    nothing: float
    change: float
    outlook: float
    returns: bool

    @property
    def best(self) -> float:
        """The utility by which losses are measured."""
        return self.repaired if self.other is None else max(self.repaired, self.other)


def loss_of_repair(stakes: Stakes, odds: Odds) -> float:
    """Return the expected loss of a repair that comes first, and a change after it where it fails."""
    after = max(0.0, stakes.outlook - odds.duration)
    works = after * (stakes.best - stakes.repaired)
    during = min(odds.duration, stakes.outlook) * (stakes.best - stakes.nothing)
    return during + odds.success * works + (1.0 - odds.success) * _after_change(stakes, after)


def loss_of_change(stakes: Stakes, odds: Odds) -> float:
    """Return the expected loss of a change that comes first; what does not work is repaired after it."""
    if stakes.other is None or not stakes.returns:
        return _after_change(stakes, stakes.outlook)
    back = min(max(odds.duration, stakes.change), stakes.outlook)
    stays, after = _after_change(stakes, back), stakes.outlook - back
    gap = min(stakes.change, after)
    returns = gap * (stakes.best - stakes.nothing) + (after - gap) * (stakes.best - stakes.repaired)
    return stays + odds.success * returns + (1.0 - odds.success) * after * (stakes.best - stakes.other)


def worth_of_nothing(utilities: Iterable[float]) -> float:
    """Return what it is worth that no design works, given the utilities of all of them.

    It is 0 where every utility is above that. On other scales it is below the least one by as much as this is below the
    greatest, and by 1 at least.
    """
    known = [utility for utility in utilities if math.isfinite(utility)] or [1.0]
    least, most = min(known), max(known)
    return 0.0 if least > 0.0 else least - max(most - least, 1.0)


def _after_change(stakes: Stakes, span: float) -> float:
    """Return the loss of a time, in s, that begins with a change to the other design, if there is one."""
    if stakes.other is None:
        return span * (stakes.best - stakes.nothing)
    gap = min(stakes.change, span)
    return gap * (stakes.best - stakes.nothing) + (span - gap) * (stakes.best - stakes.other)
