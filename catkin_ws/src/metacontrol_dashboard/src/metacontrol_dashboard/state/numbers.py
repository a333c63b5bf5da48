"""Numbers that JSON does not have, NaN and the infinite ones: a page can't read a message with one of them. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def finite(value: Any) -> Any:
    """Return a value of mappings, lists and scalars with None in place of each number that is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return tuple(map(finite, value)) if isinstance(value, tuple) else value
