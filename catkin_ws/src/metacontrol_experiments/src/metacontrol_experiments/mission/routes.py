"""Routes of a world: named pairs of a start pose and a goal pose, read from a YAML file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import yaml
from robot_formulas.geometry import Pose

if TYPE_CHECKING:
    from pathlib import Path


class RouteError(ValueError):
    """A route that does not exist or is not well-formed."""


@dataclass(frozen=True)
class Route:
    """Where a mission starts and where it goes."""

    name: str
    start: Pose
    goal: Pose


def read_route(path: Path, name: str) -> Route:
    """Reads one route.

    Raises:
        RouteError: the file cannot be read, has no such route, or the route lacks a valid start or goal.
    """
    routes = _read(path)
    if name not in routes:
        raise RouteError(f"{path}: no route {name!r}; there are {', '.join(map(str, routes)) or 'none'}")
    entry = routes[name]
    if not isinstance(entry, dict):
        raise RouteError(f"{path}: route {name!r} needs a start and a goal")
    return Route(name, *(_pose(entry.get(end), f"{path}: route {name!r}, {end}") for end in ("start", "goal")))


def route_names(path: Path) -> list[str]:
    """Names of the routes of a file, in its order.

    Raises:
        RouteError: the file cannot be read.
    """
    return [str(name) for name in _read(path)]


def _read(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise RouteError(f"{path}: cannot be read as YAML: {' '.join(str(error).split())}") from error
    routes = content.get("routes", content) if isinstance(content, dict) else {}
    return routes if isinstance(routes, dict) else {}


def _pose(value: Any, where: str) -> Pose:
    """A pose given as [x, y], [x, y, yaw] or {x:, y:, yaw:}."""
    if isinstance(value, dict):
        value = [value.get("x"), value.get("y"), value.get("yaw", 0.0)]
    numbers = value if isinstance(value, list) and len(value) in (2, 3) else []
    if not numbers or not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
        raise RouteError(f"{where}: expected [x, y, yaw] in m, m, rad, found {value!r}")
    return Pose(*map(float, numbers))
