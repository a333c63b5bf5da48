"""Contingencies: what goes wrong in a mission, and when. Written as YAML or as `KIND:WHAT@WHEN` on a command line.

Nothing here knows ROS or a clock: how far the mission is, is handed in.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:
    from pathlib import Path

DEFAULT_SHARE = 0.6
"""Share of the way done when a contingency strikes (published tool: (d0 - d) / d0 > 0.6)."""
PLACE_RADIUS = 1.0
"""m around a place within which the robot has reached it."""
MAX_CLUTTER = 100

_SPECIFICATION = re.compile(r"(?P<kind>[a-z]+):(?P<what>[^@]+)(@(?P<when>[a-z]+):(?P<value>[^@]+))?")


class ContingencyError(ValueError):
    """A contingency that makes no sense; the message names where it stands and what is expected."""


class StrikeError(RuntimeError):
    """A contingency that could not happen; the message says why."""


class Kind(Enum):
    """What goes wrong: what happens to a component's node, to the power load, to the floor, or to the light."""

    KILL = "kill"
    STOP = "stop"
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
        return self in (Kind.KILL, Kind.STOP, Kind.FREEZE)

    @property
    def spoils_data(self) -> bool:
        """Whether the component's node runs on with something wrong in its data."""
        return self in (Kind.REPEAT, Kind.JUMP)


_OF_COMPONENTS = (Kind.KILL, Kind.STOP, Kind.FREEZE, Kind.THAW, Kind.REPEAT, Kind.JUMP)


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
        """Tell whether it has come, for a mission that is so far (share, s, position in m)."""
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


def strikes_due(
    contingencies: tuple[Contingency, ...], struck: frozenset[int], share: float, elapsed: float, x: float, y: float
) -> tuple[int, ...]:
    """Return the indices of those that have not struck and whose moment has come."""
    return tuple(
        index
        for index, contingency in enumerate(contingencies)
        if index not in struck and contingency.when.has_come(share, elapsed, x, y)
    )


def make(kind: str, what: Any, when: Moment | None, where: str) -> Contingency:
    """Return a checked contingency.

    Args:
        kind: the name of a Kind.
        what: component, number, or list of places, as the kind has it.
        when: None for the kind's usual moment: clutter lies there from the start, all else strikes on the way.
        where: it stands, for messages.

    Raises:
        ContingencyError: kind and what do not fit.
    """
    names = [known.value for known in Kind]
    if kind not in names:
        raise ContingencyError(f"{where}: no kind {kind!r}; there are {', '.join(names)}")
    found = Kind(kind)
    moment = when or (AT_START if found is Kind.CLUTTER else Moment(share=DEFAULT_SHARE))
    where = f"{where}: {kind}"
    if found.hits_component:
        if not isinstance(what, str) or not what:
            raise ContingencyError(f"{where}: is {what!r}; give a component or node")
        return Contingency(found, moment, target=what)
    if found is Kind.CLUTTER:
        return _clutter(what, moment, where)
    value = _number(what, where)
    if value < 0.0 or (found is Kind.LIGHT and value > 1.0):
        limits = "from 0 (dark) to 1" if found is Kind.LIGHT else "0 or more"
        raise ContingencyError(f"{where}: is {value:g}; give a number {limits}")
    return Contingency(found, moment, value=value)


def parse_contingency(text: str) -> Contingency:
    """Return the contingency of a text `KIND:WHAT` or `KIND:WHAT@WHEN`.

    Examples are `kill:front_laser@share:0.4`, `clutter:7`, `power:1.6@time:20`, `light:0@place:1.5,-2`.

    Raises:
        ContingencyError: it is written otherwise, or makes no sense.
    """
    match = _SPECIFICATION.fullmatch(text.strip())
    if match is None:
        raise ContingencyError(
            f"{text!r}: expected KIND:WHAT or KIND:WHAT@WHEN, for instance kill:front_laser@share:0.6, clutter:7, "
            "power:1.6@time:20 or light:0@place:1.5,-2"
        )
    when = None
    if match["when"]:
        values = match["value"].split(",")
        when = _moment({match["when"]: values if len(values) > 1 else values[0]}, text)
    return make(match["kind"], match["what"], when, text)


def read_contingencies(path: Path) -> tuple[Contingency, ...]:
    """Return the contingencies of a YAML file.

    Its key `contingencies` lists entries such as {at: {share: 0.6}, kill: front_laser}.

    Raises:
        ContingencyError: the file cannot be read, or an entry makes no sense.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ContingencyError(f"{path}: cannot be read as YAML: {' '.join(str(error).split())}") from error
    entries = content.get("contingencies") if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise ContingencyError(f"{path}: needs the key contingencies with a list of entries")
    return tuple(_entry(entry, f"{path}: contingencies[{index}]") for index, entry in enumerate(entries))


def with_seed(contingencies: tuple[Contingency, ...], seed: int) -> tuple[Contingency, ...]:
    """Return them with a seed for those that have none of their own."""
    return tuple(replace(entry, seed=seed) if entry.seed is None else entry for entry in contingencies)


def _entry(entry: Any, where: str) -> Contingency:
    if not isinstance(entry, dict):
        raise ContingencyError(f"{where}: is {entry!r}; give for instance {{at: {{share: 0.6}}, kill: front_laser}}")
    kinds = [str(key) for key in entry if key != "at"]
    if len(kinds) != 1:
        raise ContingencyError(f"{where}: needs one kind beside `at`, has {', '.join(kinds) or 'none'}")
    when = _moment(entry["at"], where) if "at" in entry else None
    return make(kinds[0], entry[kinds[0]], when, where)


def _moment(value: Any, where: str) -> Moment:
    """Return the moment of a mapping with the key share, time or place."""
    known = {"share", "time", "place"}
    given = set(value) & known if isinstance(value, dict) else set()
    if len(given) != 1 or set(value) - known - {"within"}:
        raise ContingencyError(f"{where}: at is {value!r}; give one of share, time (s) and place ([x, y] in m)")
    (key,) = given
    where = f"{where}: {key}"
    if key == "place":
        x, y, within = _place(value["place"], value.get("within", PLACE_RADIUS), where)
        return Moment(place=(x, y), within=within)
    number = _number(value[key], where)
    if number < 0.0 or (key == "share" and number > 1.0):
        raise ContingencyError(f"{where}: is {number:g}; give {'0 to 1' if key == 'share' else '0 or more seconds'}")
    return Moment(share=number) if key == "share" else Moment(time=number)


def _place(value: Any, within: Any, where: str) -> tuple[float, float, float]:
    """Return x, y and the radius; a third number of the value is the radius, too."""
    if not isinstance(value, list) or len(value) not in (2, 3):
        raise ContingencyError(f"{where}: is {value!r}; give x and y in m")
    x, y, radius = (_number(number, where) for number in (*value, within)[:3])
    if radius <= 0.0:
        raise ContingencyError(f"{where}: within is {radius:g}; give m, more than 0")
    return x, y, radius


def _clutter(what: Any, when: Moment, where: str) -> Contingency:
    """Return clutter from a number, a list of places, or a mapping with count and seed."""
    if isinstance(what, list):
        places = []
        for point in what:
            if not isinstance(point, list) or len(point) != 2:
                raise ContingencyError(f"{where}: {point!r} is no place; give [x, y] in m")
            places.append((_number(point[0], where), _number(point[1], where)))
        _whole(len(places), where, 1, MAX_CLUTTER)
        return Contingency(Kind.CLUTTER, when, places=tuple(places))
    seed = None
    if isinstance(what, dict):
        if set(what) - {"count", "seed"} or "count" not in what:
            raise ContingencyError(f"{where}: is {what!r}; give {{count: N, seed: N}}")
        seed = _whole(what["seed"], f"{where}: seed", 0, 2**63 - 1) if "seed" in what else None
        what = what["count"]
    return Contingency(Kind.CLUTTER, when, count=_whole(what, where, 0, MAX_CLUTTER), seed=seed)


def _whole(value: Any, where: str, least: int, most: int) -> int:
    number = _number(value, where)
    if number != int(number) or not least <= number <= most:
        raise ContingencyError(f"{where}: is {value!r}; give a whole number from {least} to {most}")
    return int(number)


def _number(value: Any, where: str) -> float:
    """Return a finite number, also of a command line's text."""
    try:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ContingencyError(f"{where}: is {value!r}; give a finite number")
    return number
