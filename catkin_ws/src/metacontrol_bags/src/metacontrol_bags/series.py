"""Figures of series over time. A sample holds until the next one; stamps are in s."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from metacontrol_bags.record import Samples

_ROUNDING = 1e-6
"""Periods by which times that are whole numbers of periods apart may seem less."""


def held(samples: Samples, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return levels and for how long each held within [start, end].

    Returns:
        Two arrays of the same length: level, duration in s. The time before the first sample is left out.
    """
    if not samples or end <= start:
        return np.empty(0), np.empty(0)
    times, levels = np.array(samples, dtype=np.float64).T
    begins = np.clip(times, start, end)
    ends = np.clip(np.append(times[1:], end), start, end)
    return levels, np.maximum(ends - begins, 0.0)


def share_above(samples: Samples, limit: float, start: float, end: float) -> float | None:
    """Return the share of time (0..1) for which the level was above the limit; None without any sample."""
    levels, durations = held(samples, start, end)
    total = float(durations.sum())
    return float(durations[levels > limit].sum()) / total if total > 0 else None


def mean(samples: Samples, start: float, end: float) -> float | None:
    """Return the mean level weighted by time; None without any sample."""
    return mean_of(*held(samples, start, end))


def mean_of(levels: np.ndarray, durations: np.ndarray) -> float | None:
    """Return the mean of levels weighted by how long each held; None without any time."""
    total = float(durations.sum())
    return float((levels * durations).sum()) / total if total > 0 else None


def quantile(samples: Samples, share: float, start: float, end: float) -> float | None:
    """Return the level that the series did not exceed for a share of the time; None without any sample."""
    return quantile_of(*held(samples, start, end), share)


def quantile_of(levels: np.ndarray, durations: np.ndarray, share: float) -> float | None:
    """Return the level that is not exceeded for a share of the time; None without any time.

    Args:
        levels: in any order.
        durations: for how long each level held, s.
        share: of the time, 0..1.
    """
    total = float(durations.sum())
    if total <= 0:
        return None
    order = np.argsort(levels, kind="stable")
    reached = np.cumsum(durations[order]) >= share * total - 1e-9
    return float(levels[order][int(reached.argmax())])


def start_of_run(flags: Sequence[tuple[float, bool]]) -> float | None:
    """Return the stamp at which the last run of true flags began; None where the last flag is false."""
    began = None
    for stamp, flag in reversed(flags):
        if not flag:
            break
        began = stamp
    return began


def periods_missed(stamps: Sequence[float], rate: float) -> float | None:
    """Return the share of a controller's periods (rate in Hz) without a command; None with fewer than two commands."""
    if len(stamps) < 2:
        return None
    lag, missed, periods = 0.0, 0.0, np.diff(np.asarray(stamps)) * rate
    for period in periods:
        lag = max(lag + float(period) - 1.0, 0.0)  # an early command gives no credit for later ones
        missed += math.floor(lag + _ROUNDING)
        lag -= math.floor(lag + _ROUNDING)
    return missed / max(float(periods.sum()), 1.0)
