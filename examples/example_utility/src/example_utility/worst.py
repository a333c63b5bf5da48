"""Rank designs by their worst quality: a design is as useful as the quality in which it is weakest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from mros1_reasoner.knowledge.model import Design, Quality
from mros1_reasoner.planning.utility import UtilityError


def worst(parameters: Any, qualities: Mapping[str, Quality]) -> Callable[[Design], float]:
    """Return the utility of a design: the least of its expected levels, each counted so that greater is better.

    Args:
        parameters: names of the qualities to look at.
        qualities: how the levels of each quality compare.

    Raises:
        UtilityError: the parameters are no list of known qualities.
    """
    if not isinstance(parameters, list) or not parameters or not all(name in qualities for name in parameters):
        known = ", ".join(sorted(qualities))
        raise UtilityError(f"utility worst: {parameters!r}: expected a list of qualities, of these: {known}")

    def utility(design: Design) -> float:
        # A direction's sign is 1 where lower is better. A level that nobody expects is the worst of all.
        return min(-qualities[name].direction.sign * design.expected.get(name, math.inf) for name in parameters)

    return utility
