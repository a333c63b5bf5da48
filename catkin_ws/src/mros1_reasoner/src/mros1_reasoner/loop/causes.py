"""Causes that report no error, but a chance to do better."""

from __future__ import annotations

from metacontrol_bags.decision import Cause

RECOVERY = "compRecov"
"""The rule by which the return of a component is a cause."""

OPERATOR = "operator"
"""Trigger of a cause that an operator gave."""


def is_chance(cause: Cause) -> bool:
    """Return whether nothing is wrong, but a better design may have become available."""
    return cause.rules == RECOVERY or cause.trigger == OPERATOR
