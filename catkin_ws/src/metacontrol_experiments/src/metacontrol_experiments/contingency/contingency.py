"""Contingencies: what goes wrong in a mission, and when. The caller tells how far the mission is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

PLACE_RADIUS = 1.0
"""m around a place within which the robot has reached it."""


class InjectionError(RuntimeError):
    """A contingency could not happen; the message says why."""


class Kind(Enum):
    """What goes wrong: what happens to a component's node, to the power load, to the floor, or to the light."""

    KILL = "kill"
    STOP = "stop"
    UNPLUG = "unplug"
    FREEZE = "freeze"
    THAW = "thaw"
    REPEAT = "repeat"
    JUMP = "jump"
    POWER = "power"
    CLUTTER = "clutter"
    LIGHT = "light"

    @property
    def hits_component(self) -> bool:
        """Whether its target is a component."""
        return self in _OF_COMPONENTS

    @property
    def breaks_component(self) -> bool:
        """Whether the component's node does not run afterwards."""
        return self.ends_process or self is Kind.FREEZE

    @property
    def ends_process(self) -> bool:
        """Whether the process of the component's node ends; where it is unplugged, it ends again at each start."""
        return self in (Kind.KILL, Kind.STOP, Kind.UNPLUG)

    @property
    def spoils_data(self) -> bool:
        """Whether the component's node keeps running, with wrong data."""
        return self in (Kind.REPEAT, Kind.JUMP)


_OF_COMPONENTS = (Kind.KILL, Kind.STOP, Kind.UNPLUG, Kind.FREEZE, Kind.THAW, Kind.REPEAT, Kind.JUMP)


@dataclass(frozen=True)
class Moment:
    """When a contingency strikes: at a share of the way, at a time, or at a place.

    Attributes:
        share: of the way done, Euclidean, 0..1.
        time: simulated seconds since the goal was sent; 0 is before the goal.
        place: x and y, m in the map frame.
        within: m around the place.
    """

    share: float | None = None
    time: float | None = None
    place: tuple[float, float] | None = None
    within: float = PLACE_RADIUS

    @property
    def at_start(self) -> bool:
        """Whether it comes before the goal is sent."""
        return self.time == 0.0 or self.share == 0.0

    def has_come(self, share: float, elapsed: float, x: float, y: float) -> bool:
        """Tell whether the moment has come, given a mission's share of the way, time in s and position in m."""
        return (
            (self.share is not None and share >= self.share)
            or (self.time is not None and elapsed >= self.time)
            or (self.place is not None and math.dist(self.place, (x, y)) <= self.within)
        )

    def __str__(self) -> str:
        if self.share is not None:
            return f"share:{self.share:g}"
        if self.time is not None:
            return f"time:{self.time:g}"
        x, y = self.place or (0.0, 0.0)
        return f"place:{x:g},{y:g},{self.within:g}"


AT_START = Moment(time=0.0)


@dataclass(frozen=True)
class Contingency:
    """One thing that goes wrong once.

    Attributes:
        kind: what it is.
        when: at which moment of the mission.
        target: component or node, of the kinds that hit one.
        value: factor of the power load, or brightness from 0 (dark) to 1.
        count: of obstacles at random places.
        seed: of these places; the mission's where None.
        places: of listed obstacles, m in the map frame.
    """

    kind: Kind
    when: Moment = AT_START
    target: str = ""
    value: float = 1.0
    count: int = 0
    seed: int | None = None
    places: tuple[tuple[float, float], ...] = ()

    @property
    def event(self) -> str:
        """Its name in a PERTURBATION event: component:NAME is what a decision's trigger is called, too."""
        if self.kind.breaks_component:
            return f"component:{self.target}"
        return f"{self.kind.value}:{self._what}"

    @property
    def obstacles(self) -> int:
        """Number of obstacles that it puts on the floor."""
        return len(self.places) or self.count

    @property
    def _what(self) -> str:
        if self.kind.hits_component:
            return self.target
        return str(self.obstacles) if self.kind is Kind.CLUTTER else f"{self.value:g}"

    def __str__(self) -> str:
        return f"{self.kind.value}:{self._what}@{self.when}"


def contingencies_due(
    contingencies: tuple[Contingency, ...], injected: frozenset[int], share: float, elapsed: float, x: float, y: float
) -> tuple[int, ...]:
    """Return the indices of the contingencies that are not injected yet and whose moment has come."""
    return tuple(
        index
        for index, contingency in enumerate(contingencies)
        if index not in injected and contingency.when.has_come(share, elapsed, x, y)
    )


def with_seed(contingencies: tuple[Contingency, ...], seed: int) -> tuple[Contingency, ...]:
    """Return the contingencies, each with a seed: its own, else the given one."""
    return tuple(replace(entry, seed=seed) if entry.seed is None else entry for entry in contingencies)
