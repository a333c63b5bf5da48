"""Numbers as options and answers: within a range, and finite; the option of a patience."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    from click import Context, Parameter


_LONGEST = 3600.0  # s


class FiniteRange(click.FloatRange):
    """A range that refuses NaN, too, which is neither below nor above any limit, and what is infinite."""

    def convert(self, value: Any, param: Parameter | None, ctx: Context | None) -> float:
        """Return the number that a text is."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number", param, ctx)
        return number


def timeout_option(told: str) -> Callable[[Any], Any]:
    """Return the option `--timeout` of a command that asks a master; `told` is its help."""
    kind = FiniteRange(min=0, min_open=True, max=_LONGEST)
    return click.option("--timeout", type=kind, default=2.0, show_default=True, metavar="S", help=told)
