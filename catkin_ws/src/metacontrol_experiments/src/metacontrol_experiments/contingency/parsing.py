"""Contingencies as users write them: `KIND:WHAT@WHEN` on a command line, or YAML; and the nodes that they hit."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from node_kit.one_line import OneLineError

from metacontrol_experiments.contingency.contingency import AT_START, PLACE_RADIUS, Contingency, Kind, Moment

if TYPE_CHECKING:
    from collections.abc import Mapping

DEFAULT_SHARE = 0.6
"""Share of the way done when a contingency strikes (published tool: (d0 - d) / d0 > 0.6)."""
MAX_CLUTTER = 100

_SPECIFICATION = re.compile(r"(?P<kind>[a-z]+):(?P<what>[^@]+)(@(?P<when>[a-z]+):(?P<value>[^@]+))?")


class ContingencyError(OneLineError, ValueError):
    """A contingency that makes no sense; the message names where it stands and what is expected."""


class ComponentError(OneLineError, ValueError):
    """A component is unknown; the message names the known ones."""


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


def parse_contingencies(content: Any, where: str) -> tuple[Contingency, ...]:
    """Return the contingencies of a YAML file's content.

    Its key `contingencies` lists entries such as {at: {share: 0.6}, kill: front_laser}.

    Args:
        content: as the YAML reader returns it.
        where: the file, for messages.

    Raises:
        ContingencyError: there is no such list, or an entry makes no sense.
    """
    entries = content.get("contingencies") if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise ContingencyError(f"{where}: needs the key contingencies with a list of entries")
    return tuple(_entry(entry, f"{where}: contingencies[{index}]") for index, entry in enumerate(entries))


def parse_components(content: Any) -> dict[str, str]:
    """Return component name -> node, of the content of a project's metacontrol.yaml."""
    components = content.get("components") if isinstance(content, dict) else None
    return {
        str(name): str(entry["node"])
        for name, entry in (components.items() if isinstance(components, dict) else ())
        if isinstance(entry, dict) and "node" in entry
    }


def node_of(target: str, components: Mapping[str, str]) -> str:
    """Return the node of a component; a name that begins with / is a node already.

    Raises:
        ComponentError: there is no such component.
    """
    if target.startswith("/"):
        return target
    if target not in components:
        known = ", ".join(components) or "none"
        raise ComponentError(f"no component {target!r}; there are {known}; a node's name begins with /")
    return components[target]


def _entry(entry: Any, where: str) -> Contingency:
    if not isinstance(entry, dict):
        raise ContingencyError(f"{where}: is {entry!r}; give for instance {{at: {{share: 0.6}}, kill: front_laser}}")
    kinds = [key for key in entry if key != "at"]
    if len(kinds) != 1:
        raise ContingencyError(f"{where}: needs one kind beside `at`, has {', '.join(map(str, kinds)) or 'none'}")
    when = _moment(entry["at"], where) if "at" in entry else None
    return make(str(kinds[0]), entry[kinds[0]], when, where)


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
