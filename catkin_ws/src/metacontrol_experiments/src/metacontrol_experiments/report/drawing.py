"""How all figures of a report look: size, and a colour, a line and a mark for each manager.

Colours are those of Okabe and Ito (https://jfly.uni-koeln.de/color/), which colour-blind readers can tell apart; lines
and marks differ, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from metacontrol_experiments.report.missions import BASELINE, OURS

if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH_INCH = 9.0
"""At page width (900 pixels of a screen), texts of 10 points are as large as those of the page."""

Line = str | tuple[int, tuple[int, ...]]
"""A style of lines, as matplotlib takes it."""

OBSERVED = {"safety": "#0072B2", "energy": "#D55E00"}
"""Colours of levels."""
SHADE = "#999999"
CHANGE = "#F0E442"

_DASHES: tuple[Line, ...] = ("-.", ":", (0, (6, 1)), (0, (3, 1, 1, 1, 1, 1)))
_OTHERS = ("#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442", "#000000")
_MARKS = "^vPXD*"


@dataclass(frozen=True)
class Style:
    """How a manager is drawn."""

    colour: str
    line: Line
    mark: str


def styles(managers: Sequence[str]) -> dict[str, Style]:
    """Return how each manager is drawn; baseline and ours look the same in every report."""
    found = {BASELINE: Style("#D55E00", "--", "s"), OURS: Style("#0072B2", "-", "o")}
    others = [manager for manager in managers if manager not in found]
    for number, manager in enumerate(others):
        look = number % len(_OTHERS)
        found[manager] = Style(_OTHERS[look], _DASHES[number % len(_DASHES)], _MARKS[look])
    return {manager: found[manager] for manager in managers}


def new_figure(height_inch: float) -> Figure:
    """Return an empty figure of the page's width."""
    return Figure(figsize=(WIDTH_INCH, height_inch), layout="constrained")
