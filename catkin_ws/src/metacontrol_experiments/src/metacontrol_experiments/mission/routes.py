"""Routes of a world: named pairs of a start pose and a goal pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from node_kit.one_line import OneLineError
from robot_formulas.geometry import Pose


class RouteError(OneLineError, ValueError):
    """A route that does not exist or is not well-formed."""


@dataclass(frozen=True)
class Route:
    """Where a mission starts and where it goes."""

    name: str
    start: Pose
    goal: Pose


def parse_route(content: Any, name: str, where: str) -> Route:
    """Return one route.

    Args:
        content: of a YAML file of routes.
        name: of the route.
        where: the file, for messages.

    Raises:
        RouteError: there is no such route, or it lacks a valid start or goal.
    """
    routes = _entries(content)
    if name not in routes:
        raise RouteError(f"{where}: no route {name!r}; there are {', '.join(map(str, routes)) or 'none'}")
    entry = routes[name]
    if not isinstance(entry, dict):
        raise RouteError(f"{where}: route {name!r} needs a start and a goal")
    return Route(name, *(_pose(entry.get(end), f"{where}: route {name!r}, {end}") for end in ("start", "goal")))


def parse_route_names(content: Any) -> list[str]:
    """Return the names of the routes of a YAML file's content, in its order."""
    return [str(name) for name in _entries(content)]


def _entries(content: Any) -> dict[str, Any]:
    routes = content.get("routes", content) if isinstance(content, dict) else {}
    return routes if isinstance(routes, dict) else {}


def _pose(value: Any, where: str) -> Pose:
    """Return a pose given as [x, y], [x, y, yaw] or {x:, y:, yaw:}."""
    if isinstance(value, dict):
        value = [value.get("x"), value.get("y"), value.get("yaw", 0.0)]
    numbers = value if isinstance(value, list) and len(value) in (2, 3) else []
    if not numbers or not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
        raise RouteError(f"{where}: expected [x, y, yaw] in m, m, rad, found {value!r}")
    return Pose(*map(float, numbers))
