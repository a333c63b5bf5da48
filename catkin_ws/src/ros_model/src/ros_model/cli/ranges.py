"""Numbers as options and answers: within a range, and finite."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from click import Context, Parameter


class FiniteRange(click.FloatRange):
    """A range that refuses NaN, too, which is neither below nor above any limit, and what is infinite."""

    def convert(self, value: Any, param: Parameter | None, ctx: Context | None) -> float:
        """Return the number that a text is."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number", param, ctx)
        return number
