"""What the next levels of a quality will be, by robust statistics of the last ones.

A level is judged by the quantile that the next one will not pass, not by its face value: one bad level among good ones
does not move it, a lasting change moves it as soon as most of the last levels have changed, and a trend moves it before
the limit is crossed.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

_NORMAL_BY_MAD = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation (Rousseeuw and Croux 1993)."""
_TREND = {4: 6, 5: 8, 6: 11, 7: 13, 8: 16, 9: 18, 10: 21}
"""Mann-Kendall's S that is exceeded by chance in at most 5 % of cases, one-sided, by the number of levels (Kendall)."""
MOST = max(_TREND)
"""Levels that can be judged together at most."""


@dataclass(frozen=True)
class Estimate:
    """What levels say.

    Attributes:
        level: at the time of the last one.
        slope: change per second; 0 where the levels show no trend that is significant at 5 %.
        scatter: standard deviation about that.
    """

    level: float
    slope: float = 0.0
    scatter: float = 0.0

    def ahead(self, seconds: float) -> float:
        """Return the level some seconds after the last one."""
        return self.level + self.slope * seconds


def rank_below_median(count: int, confidence: float) -> int:
    """Return the rank of the greatest of some sorted levels that is surely not above their median (sign test).

    `rank` or fewer of independent levels, whatever their distribution, lie below the median of that distribution as
    often as a fair coin shows so few heads. With 95 %, 1 is returned for 10 levels: the second lowest. The rank is 0
    where they are too few to be sure.
    """
    chance, rank = 0.0, -1
    while (chance := chance + math.comb(count, rank + 1) / 2**count) <= 1.0 - confidence:
        rank += 1
    return max(rank, 0)


def estimate(levels: Sequence[tuple[float, float]]) -> Estimate:
    """Return the robust estimate of levels: median, slope of Theil and Sen, median absolute deviation.

    Args:
        levels: (time in s, level) of the last ones, at most `MOST` of them, in the order of time, at least one.
    """
    end = levels[-1][0]
    changes = [
        ((second - first) / (later - earlier), second - first)
        for (earlier, first), (later, second) in itertools.combinations(levels, 2)
        if later > earlier
    ]
    balance = sum((change > 0) - (change < 0) for _, change in changes)
    has_trend = abs(balance) >= _TREND.get(len(levels), len(changes) + 1)
    slope = statistics.median(rate for rate, _ in changes) if has_trend else 0.0
    now = [level - slope * (when - end) for when, level in levels]
    middle = statistics.median(now)
    scatter = _NORMAL_BY_MAD * statistics.median(abs(level - middle) for level in now)
    return Estimate(middle, slope, scatter)
