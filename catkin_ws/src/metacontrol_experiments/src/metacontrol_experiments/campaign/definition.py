"""The definition of expected levels: by how much a quality is kept over the time of one run, and from runs a level.

Calibration in simulation and from bags of real robots both use it.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from metacontrol_bags.metrics import MAX_SHARE
from metacontrol_bags.series import mean_of, quantile_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np

QUANTILES: Mapping[str, float] = {"safety": 1.0 - MAX_SHARE["safety"], "energy": 0.975}
"""Share of a run's time for which a quality keeps its level. A quality that is not listed has its mean over time.

The published expected levels are such quantiles (docs/yardstick.md). Means would say little: the risk is 0 wherever
nothing is near, and the energy is low but for jolts.
"""
MEAN = "mean"


class DefinitionError(ValueError):
    """A quantile makes no sense; the message says what to give."""


@dataclass(frozen=True)
class Definition:
    """What the level of each quality is.

    Attributes:
        quantiles: share of a run's time for which a quality keeps its level; the mean over time of any other quality.
    """

    quantiles: Mapping[str, float] = field(default_factory=lambda: dict(QUANTILES))

    def level(
        self, quality: str, levels: np.ndarray, durations: np.ndarray, *, higher_is_better: bool = False
    ) -> float | None:
        """Return the level of a quality over the time of one run; None without any time.

        Args:
            quality: its name.
            levels: that the quality had.
            durations: for how long it had each, s.
            higher_is_better: whether the level is kept from below.
        """
        share = self.quantiles.get(quality)
        if share is None:
            return mean_of(levels, durations)
        sign = -1.0 if higher_is_better else 1.0
        found = quantile_of(sign * levels, durations, share)
        return None if found is None else sign * found + 0.0  # no -0.0

    def describe(self, qualities: Iterable[str]) -> str:
        """Return the definition of some qualities in words: the same text for the same definition."""
        return " ".join(f"{name}:{self.quantiles.get(name, MEAN)}" for name in sorted(qualities))


@dataclass(frozen=True)
class Level:
    """A measured level.

    Attributes:
        value: mean over runs.
        spread: standard deviation over runs.
    """

    value: float
    spread: float


def over_runs(values: Sequence[float]) -> Level:
    """Return the level that follows from the levels of single runs."""
    return Level(statistics.fmean(values), statistics.stdev(values) if len(values) > 1 else 0.0)


def parse_definition(texts: Iterable[str]) -> Definition:
    """Return the definition that users write as QUALITY=SHARE or QUALITY=mean, over the default one.

    Raises:
        DefinitionError: one of the texts is none.
    """
    quantiles = dict(QUANTILES)
    for text in texts:
        quality, sign, share = text.partition("=")
        if not (quality and sign):
            raise DefinitionError(f"{text!r}: expected QUALITY=SHARE, such as energy=0.95, or QUALITY={MEAN}")
        if share == MEAN:
            quantiles.pop(quality, None)
        else:
            quantiles[quality] = _share(share, text)
    return Definition(quantiles)


def _share(text: str, whole: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = math.nan
    if not 0.0 < share <= 1.0:
        raise DefinitionError(f"{whole!r}: give a share of the time, more than 0 and at most 1, or {MEAN}")
    return share
