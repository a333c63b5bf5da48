"""Rank designs by the hours that a battery lasts with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mros1_reasoner.knowledge.model import Design, Quality
from mros1_reasoner.planning.utility import UtilityError


def battery_life(parameters: Any, qualities: Mapping[str, Quality]) -> Callable[[Design], float]:
    """Return the utility of a design: capacity divided by power, h; 0 where the power is not known.

    Args:
        parameters: `capacity` in Wh, and `power`, the name of the quality that is a power in W.
        qualities: those of the model.

    Raises:
        UtilityError: one of the parameters is missing, or is not what it should be.
    """
    try:
        capacity, power = float(parameters["capacity"]), parameters["power"]
    except (TypeError, KeyError, ValueError) as error:
        raise UtilityError("utility battery_life: expected {capacity: Wh, power: QUALITY}") from error
    if power not in qualities:
        raise UtilityError(f"utility battery_life: {power!r} is none of the qualities: {', '.join(sorted(qualities))}")

    def hours(design: Design) -> float:
        watts = design.expected.get(power, 0.0)
        return capacity / watts if watts > 0.0 else 0.0

    return hours
