"""Figures as text, and tables in Markdown."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from metacontrol_bags.side_by_side import UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from metacontrol_experiments.report.statistics import Estimate

TIE = "\u00a0"
"""A space at which no line is broken."""

_LEAST_P = 0.001
_FIGURE = re.compile(r"[+-]?\d|-$")
_MARKED = re.compile(r"([\\`*_\[\]<>~#&])")


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as a Markdown table; columns of figures are flushed right.

    Args:
        rows: of texts in Markdown, the first one being the head.
    """
    cells = [[text.replace("|", "\\|") for text in row] for row in rows]
    columns = [[row[number] for row in cells[1:]] for number in range(len(cells[0]))]
    marks = ["---:" if all(map(_FIGURE.match, column)) else "---" for column in columns]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    return "\n".join([lines[0], f"|{'|'.join(marks)}|", *lines[1:]])


def percent(figure: Estimate | float | None, *, signed: bool = False) -> str:
    """Return a share (0..1) in per cent or points, with its interval."""
    return with_interval(figure, 100.0, 2, signed=signed)


def seconds(figure: Estimate | float | None, *, signed: bool = False) -> str:
    """Return a time in s, with its interval."""
    return with_interval(figure, 1.0, 2, signed=signed)


def number(figure: Estimate | float | None) -> str:
    """Return a number, with its interval."""
    return with_interval(figure, 1.0, 2)


def with_interval(figure: Estimate | float | None, scale: float, digits: int, *, signed: bool = False) -> str:
    """Return a figure times a scale, with its interval where it has one."""
    if figure is None:
        return UNKNOWN
    if isinstance(figure, float):
        return _rounded(figure * scale, digits, signed=signed)
    told = _rounded(figure.value * scale, digits, signed=signed)
    if figure.low is None or figure.high is None:
        return told
    ends = (_rounded(end * scale, digits, signed=signed) for end in (figure.low, figure.high))
    return f"{told} ({f'{TIE}to{TIE}'.join(ends)})"


def probability(p: float) -> str:
    """Return a p-value."""
    return f"p{TIE}<{TIE}{_LEAST_P:g}" if p < _LEAST_P else f"p{TIE}={TIE}{p:.3f}"


def plain(text: str) -> str:
    """Return a text from elsewhere so that Markdown shows it as it is, on one line."""
    return _MARKED.sub(r"\\\1", " ".join(text.split()))


def code(name: str) -> str:
    """Return a name as code."""
    return f"`{' '.join(name.replace('`', '').split())}`"


def counts(numbers: Sequence[int]) -> str:
    """Return numbers of several columns: one where they are equal."""
    return " / ".join(f"{number:,}" for number in (numbers[:1] if len(set(numbers)) == 1 else numbers))


def count(things: int, singular: str) -> str:
    """Return a number of things, e.g. `1 mission` or `2,000 missions`."""
    return f"{things:,} {singular}{'' if things == 1 else 's'}"


def _rounded(value: float, digits: int, *, signed: bool) -> str:
    if math.isinf(value):
        return "unbounded"
    told = f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"
    zero = f"{0.0:.{digits}f}"
    return zero if told in (f"-{zero}", f"+{zero}") else told
