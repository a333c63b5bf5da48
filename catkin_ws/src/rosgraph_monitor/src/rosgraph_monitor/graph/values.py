"""Comparison of a parameter of the model with one of the parameter server."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ros_model.language.metamodel import Value

RELATIVE_TOLERANCE = 1e-6
ABSOLUTE_TOLERANCE = 1e-9
"""Numbers closer than this are the same: parameters pass through decimal text on their way."""


def same_value(expected: Value, actual: object) -> bool:
    """Compare a value of the model with one of the parameter server.

    Numbers are compared by tolerance, lists element by element, and of a struct only the members that the model gives.
    A text of the model that reads as a number or truth value equals that value, since roslaunch converts such text.
    """
    if isinstance(expected, list):
        return (
            isinstance(actual, list)
            and len(actual) == len(expected)
            and all(same_value(e, a) for e, a in zip(expected, actual, strict=True))
        )
    if isinstance(expected, dict):
        return isinstance(actual, dict) and all(k in actual and same_value(v, actual[k]) for k, v in expected.items())
    if isinstance(expected, str) and not isinstance(actual, str):
        return _same_scalar(_converted(expected), actual)
    return _same_scalar(expected, actual)


def _same_scalar(expected: object, actual: object) -> bool:
    if isinstance(expected, bool) or isinstance(actual, bool):
        return expected is actual
    if isinstance(expected, (int, float)) and isinstance(actual, (int, float)):
        if math.isnan(expected) or math.isnan(actual):
            return math.isnan(expected) and math.isnan(actual)
        return math.isclose(expected, actual, rel_tol=RELATIVE_TOLERANCE, abs_tol=ABSOLUTE_TOLERANCE)
    return expected == actual


def _converted(text: str) -> object:
    """Return the value to which roslaunch converts the text of a parameter without a type."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return float(text)
    except ValueError:
        return text
