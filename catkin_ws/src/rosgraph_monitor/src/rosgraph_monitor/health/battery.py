"""Battery as a component: it has failed while its charge is below a limit. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BatterySpec:
    """A component that stands for a battery.

    Attributes:
        component: its name.
        topic: of sensor_msgs/BatteryState.
        below: charge, 0..1, below which the component has failed.
        above: charge, 0..1, above which it has recovered.
    """

    component: str
    topic: str
    below: float
    above: float


def charge_of(percentage: float, charge: float, capacity: float) -> float | None:
    """Return the charge, 0..1, from the fields of a BatteryState; None if they do not tell it.

    Args:
        percentage: 0..1, NaN where it is not measured.
        charge: Ah, NaN where it is not measured.
        capacity: last full capacity in Ah, NaN where it is not known.
    """
    if math.isfinite(percentage) and 0.0 <= percentage <= 1.0:
        return percentage
    if math.isfinite(charge) and math.isfinite(capacity) and capacity > 0.0:
        return min(max(charge / capacity, 0.0), 1.0)
    return None


def has_failed(spec: BatterySpec, charge: float, failed: bool) -> bool:
    """Return whether the component has failed, given whether it had before: between the limits it stays as it was."""
    return charge < spec.below or (failed and charge <= spec.above)
