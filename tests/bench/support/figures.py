"""The figures that `./mros bench` shows and writes."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

LIMIT = "limit"  # as the peer of a figure: what was asked for
GAZEBO = "Gazebo", 1.0  # s/s: the published system runs in real time at best


def entry(
    name: str,
    value: float,
    unit: str,
    samples: int,
    peer: str | None = None,
    peer_value: float | None = None,
    *,
    higher_is_better: bool = False,
) -> dict[str, Any]:
    """Return one figure. Its ratio tells how many times better than the peer it is, None where either is 0."""
    ratio = None
    if peer_value and value:
        ratio = value / peer_value if higher_is_better else peer_value / value
    return {
        "name": name,
        "value": value,
        "unit": unit,
        "peer": peer,
        "peer_value": peer_value,
        "ratio": ratio,
        "samples": samples,
    }


KEYS = tuple(entry("", 0.0, "", 0))
"""Of every figure, in this order."""


def percentile(values: Sequence[float], share: float) -> float:
    """Return the least of the values that this share of them does not exceed."""
    return sorted(values)[math.ceil(share * len(values)) - 1]


def seconds(action: Callable[[], object]) -> float:
    """Return the wall time that an action takes, s."""
    began = time.perf_counter()
    action()
    return time.perf_counter() - began
