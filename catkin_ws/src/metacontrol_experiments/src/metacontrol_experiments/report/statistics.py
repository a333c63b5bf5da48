"""Intervals, tests and effect sizes. Whatever is random is seeded: the same values give the same result."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

CONFIDENCE = 0.95
SIGNIFICANT = 0.05
"""Corrected p below which a difference counts as more than chance."""
RESAMPLES = 2000
"""Of a bootstrap: the ends of its intervals vary by about 3 % of their width from one seed to another."""

_SEED = 20101
"""Of each bootstrap by itself, so that no interval depends on others that are computed before it."""
_BATCH = 10_000_000
"""Numbers that a bootstrap draws at a time, to bound memory."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its confidence interval.

    Attributes:
        value: of the sample.
        low: lower end; None where the sample is too small for an interval.
        high: upper end.
        count: of the values in the sample.
    """

    value: float
    low: float | None
    high: float | None
    count: int


@dataclass(frozen=True)
class PairedTest:
    """Pairs of values, and whether they differ.

    Attributes:
        difference: mean of the first less the second.
        p: of no difference, two-sided, not corrected.
        superiority: Vargha and Delaney's A12: how probably the first is larger than the second; ties count half.
    """

    difference: Estimate
    p: float
    superiority: float


def rate(successes: Sequence[bool]) -> Estimate:
    """Return the rate of successes (0..1) with Wilson's interval.

    Raises:
        ValueError: there is none.
    """
    count, met = len(successes), sum(successes)
    interval = stats.binomtest(met, count).proportion_ci(CONFIDENCE, "wilson")
    return Estimate(met / count, float(interval.low), float(interval.high), count)


def mean(values: Sequence[float]) -> Estimate:
    """Return the mean with the percentile interval of a bootstrap; without an interval for a single value.

    Raises:
        ValueError: there is none.
    """
    return _bootstrap((values,), lambda sample, axis=-1: np.mean(sample, axis=axis))


def ratio(parts: Sequence[float], wholes: Sequence[float]) -> Estimate | None:
    """Return the sum of some values by the sum of others, with the interval of a bootstrap over pairs.

    Returns:
        The ratio; None where the second sum is 0. An end of the interval is infinite where that of resamples may be.
    """
    if not sum(wholes):
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        return _bootstrap(
            (parts, wholes),
            lambda part, whole, axis=-1: np.nan_to_num(
                np.sum(part, axis=axis) / np.sum(whole, axis=axis), nan=math.inf, posinf=math.inf
            ),
        )


def mcnemar(first: Sequence[bool], second: Sequence[bool]) -> PairedTest:
    """Return McNemar's exact test of paired successes.

    Raises:
        ValueError: the lengths differ, or there is none.
    """
    pairs = list(zip(first, second, strict=True))
    only_first = sum(one and not other for one, other in pairs)
    only_second = sum(other and not one for one, other in pairs)
    discordant = only_first + only_second
    p = float(stats.binomtest(only_first, discordant, 0.5).pvalue) if discordant else 1.0
    difference = mean([float(one) - float(other) for one, other in pairs])
    return PairedTest(difference, p, superiority([float(one) for one in first], [float(other) for other in second]))


def wilcoxon(first: Sequence[float], second: Sequence[float]) -> PairedTest:
    """Return Wilcoxon's signed-rank test of paired values; zero differences are ranked, too (Pratt).

    Raises:
        ValueError: the lengths differ, or there is none.
    """
    differences = [round(one - other, 9) for one, other in zip(first, second, strict=True)]  # equal ones tie
    p = float(stats.wilcoxon(differences, zero_method="pratt").pvalue) if any(differences) else 1.0
    return PairedTest(mean(differences), p, superiority(first, second))


def superiority(first: Sequence[float], second: Sequence[float]) -> float:
    """Return Vargha and Delaney's A12: how probably a value of the first is larger; ties count half."""
    count = len(first)
    ranks = stats.rankdata([*first, *second])[:count]
    return float((ranks.sum() / count - (count + 1) / 2) / len(second))


def holm(ps: Sequence[float]) -> list[float]:
    """Return p-values corrected for that many tests by Holm's step-down method."""
    corrected, largest = [0.0] * len(ps), 0.0
    for rank, index in enumerate(sorted(range(len(ps)), key=ps.__getitem__)):
        largest = max(largest, min(1.0, (len(ps) - rank) * ps[index]))
        corrected[index] = largest
    return corrected


def _bootstrap(samples: Sequence[Sequence[float]], statistic: Callable[..., Any]) -> Estimate:
    arrays = [np.asarray(sample, dtype=np.float64) for sample in samples]
    count = len(arrays[0])
    if not count:
        raise ValueError("no value")
    value = float(statistic(*arrays))
    if count == 1:
        return Estimate(value, None, None, 1)
    if all(np.ptp(array) == 0.0 for array in arrays):
        return Estimate(value, value, value, count)
    found = stats.bootstrap(
        arrays,
        statistic,
        paired=True,
        vectorized=True,
        n_resamples=RESAMPLES,
        batch=max(1, _BATCH // count),
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(_SEED),
    ).confidence_interval
    return Estimate(value, float(found.low), float(found.high), count)
