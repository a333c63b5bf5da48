"""The if-then rules that an engineer would write by hand for D2, from the table of its variants.

- The sensor of the running variant has failed, or the surroundings do not suit it (a camera in the dark): take a
  variant with another sensor, no faster than the running one where there is one.
- Safety violates its limit: slow down by one step; at the lowest velocity, keep a greater distance.
- Energy violates its limit: lower the frequency of control by one step; at the lowest, slow down.

The other columns of the table stay as near to the running variant as the table allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from metacontrol_experiments.managers.reactive import Choose, Trouble


class RuleError(ValueError):
    """The table of variants is not that of D2; the message names the column."""


@dataclass(frozen=True)
class Variant:
    """A row of the table.

    Attributes:
        frequency: of control, Hz.
        velocity: the greatest, m/s.
        radius: around obstacles that is kept free, m.
        sensor: which messages navigation takes.
    """

    frequency: float
    velocity: float
    radius: float
    sensor: str


_NUMBERS = ("controller_frequency_hz", "max_vel_mps", "inflation_radius_m")
_SENSOR = "observation_source"
"""Columns of the table."""


def variants_of(rows: Mapping[str, Mapping[str, object]], where: str) -> dict[str, Variant]:
    """Return the variants of a table, by name.

    Args:
        rows: name -> column -> value.
        where: the file, for messages.

    Raises:
        RuleError: a column is missing, or has a wrong value.
    """
    found = {}
    for name, row in rows.items():
        numbers = []
        for column in _NUMBERS:
            cell = row.get(column)
            if isinstance(cell, bool) or not isinstance(cell, int | float):
                raise RuleError(f"{where}: {name}: {column} is {cell!r}; the manager rules needs a number")
            numbers.append(float(cell))
        frequency, velocity, radius = numbers
        found[name] = Variant(frequency, velocity, radius, str(row.get(_SENSOR)))
    return found


def by_rules(variants: Mapping[str, Variant]) -> Choose:
    """Return the choice of the rules."""

    def choose(trouble: Trouble, running: str, others: tuple[str, ...]) -> str | None:
        now = variants[running]
        there = {name: variants[name] for name in others if name in variants}
        if trouble.component or trouble.surroundings:
            return _nearest(now, there, lambda other: other.sensor != now.sensor)
        slower = _step_down(now, there, "velocity")
        if trouble.quality == "safety":
            return slower or _nearest(
                now, there, lambda other: other.velocity == now.velocity and other.radius > now.radius
            )
        if trouble.quality == "energy":
            return _step_down(now, there, "frequency") or slower
        return None

    return choose


def _step_down(now: Variant, there: Mapping[str, Variant], column: str) -> str | None:
    """Return the variant with the next lower value of a column, which is as fast as the running one or slower."""
    lower = [getattr(other, column) for other in there.values() if getattr(other, column) < getattr(now, column)]
    if not lower:
        return None
    return _nearest(
        now, there, lambda other: getattr(other, column) == max(lower) and other.velocity <= now.velocity, column
    )


def _nearest(now: Variant, there: Mapping[str, Variant], fits: Callable[[Variant], bool], but: str = "") -> str | None:
    """Return the variant that fits and is nearest: sensor, then velocity (slower rather than faster), then the rest."""

    def distance(name: str) -> tuple[object, ...]:
        other = there[name]
        return (
            other.sensor != now.sensor,
            other.velocity > now.velocity,
            abs(other.velocity - now.velocity) if but != "velocity" else 0.0,
            abs(other.frequency - now.frequency) if but != "frequency" else 0.0,
            abs(other.radius - now.radius),
            name,
        )

    return min((name for name, other in there.items() if fits(other)), key=distance, default=None)
