"""World files: a list of boxes and people in YAML, or a map of map_server, which is extruded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from node_kit.io.input_files import InputFileError, read_yaml

from pybullet_simulator.io.map_file import MapError, read_map
from pybullet_simulator.world.grid import GridError
from pybullet_simulator.world.walking import MAX_PEOPLE, MAX_WAY, SPEED, Walker
from pybullet_simulator.world.world import KINDS, MAX_BOXES, Box, World, WorldError, extrude, way_problem

if TYPE_CHECKING:
    from pathlib import Path

MAX_SIZE = 80_000
"""Bytes of the largest file: those of MAX_BOXES boxes and more; YAML of twice the size can take 2 s."""


def read_world(path: Path) -> World:
    """Read and check a world file: a file with the key `image` is a map, any other a list of boxes.

    Raises:
        WorldError: the file is missing, not YAML, or one of its entries is wrong; names the file and the entry.
    """
    try:
        content = read_yaml(path, MAX_SIZE)
    except InputFileError as error:
        raise WorldError(str(error)) from error
    if not isinstance(content, dict):
        raise WorldError(
            f"{path}: holds no world; it needs the keys floor and any of {', '.join(KINDS)}, or those of a map"
        )
    if "image" in content or "resolution" in content:
        try:
            return extrude(read_map(content, path), path.stem)
        except MapError as error:
            raise WorldError(str(error)) from error
        except GridError as error:
            raise WorldError(f"{path}: image: {error}") from error
    known = {"name", "floor", "people", *KINDS}
    for key in content:
        if key not in known:
            raise WorldError(f"{path}: {key}: unknown key; known are {', '.join(sorted(known))}")
    x_min, x_max, y_min, y_max = _floor(content.get("floor"), path)
    boxes: list[Box] = []
    for section, kind in KINDS.items():
        entries = content.get(section) or []
        if not isinstance(entries, list):
            raise WorldError(f"{path}: {section}: must be a list of boxes")
        if len(boxes) + len(entries) > MAX_BOXES:
            raise WorldError(f"{path}: {section}: more than {MAX_BOXES} boxes in all; leave some out, or use a map")
        boxes.extend(_box(entry, kind, f"{path}: {section}[{index}]") for index, entry in enumerate(entries))
    people = content.get("people") or []
    if not isinstance(people, list):
        raise WorldError(f"{path}: people: must be a list of people")
    if len(people) > MAX_PEOPLE:
        raise WorldError(f"{path}: people: are {len(people)}; give at most {MAX_PEOPLE}")
    walkers = tuple(_walker(entry, f"{path}: people[{index}]") for index, entry in enumerate(people))
    world = World(str(content.get("name", path.stem)), x_min, x_max, y_min, y_max, tuple(boxes), walkers)
    _check(world, path)
    return world


def _floor(value: Any, path: Path) -> tuple[float, float, float, float]:
    """Return x_min, x_max, y_min, y_max of the entry `floor`."""
    if not isinstance(value, dict) or set(value) != {"x", "y"}:
        raise WorldError(f"{path}: floor: must be {{x: [min, max], y: [min, max]}} in m")
    x_min, x_max = _numbers(value["x"], 2, f"{path}: floor: x")
    y_min, y_max = _numbers(value["y"], 2, f"{path}: floor: y")
    if x_max <= x_min or y_max <= y_min:
        raise WorldError(f"{path}: floor: each max must be larger than its min")
    if max(x_max - x_min, y_max - y_min) > 200.0:
        raise WorldError(f"{path}: floor: larger than 200 m; is it in metres?")
    return x_min, x_max, y_min, y_max


def _box(entry: Any, kind: str, where: str) -> Box:
    """Return one checked box; `where` names the file and the entry."""
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
        raise WorldError(f"{where}: must be a box with a name")
    where = f"{where} {entry['name']!r}"
    required, optional = {"name", "position", "size", "height"}, {"yaw"}
    if missing := sorted(required - set(entry)):
        raise WorldError(f"{where}: lacks {', '.join(missing)}")
    if unknown := sorted(map(str, set(entry) - required - optional)):
        raise WorldError(f"{where}: unknown key {', '.join(unknown)}")
    x, y = _numbers(entry["position"], 2, f"{where}: position")
    length, width = _numbers(entry["size"], 2, f"{where}: size")
    (height,) = _numbers([entry["height"]], 1, f"{where}: height")
    (yaw,) = _numbers([entry.get("yaw", 0.0)], 1, f"{where}: yaw")
    if min(length, width, height) <= 0.0:
        raise WorldError(f"{where}: size and height must be positive (m)")
    return Box(entry["name"], kind, x, y, length, width, height, yaw)


def _walker(entry: Any, where: str) -> Walker:
    """Return one checked person; `where` names the file and the entry."""
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
        raise WorldError(f"{where}: must be a person with a name")
    where = f"{where} {entry['name']!r}"
    if unknown := sorted(map(str, set(entry) - {"name", "waypoints", "speed"})):
        raise WorldError(f"{where}: unknown key {', '.join(unknown)}")
    points = entry.get("waypoints")
    if not isinstance(points, list):
        raise WorldError(f"{where}: waypoints: must be two or more [x, y]")
    waypoints = tuple((x, y) for x, y in (_numbers(point, 2, f"{where}: waypoints") for point in points))
    (speed,) = _numbers([entry.get("speed", SPEED)], 1, f"{where}: speed")
    return Walker(entry["name"], waypoints, speed)


def _check(world: World, path: Path) -> None:
    """Check boxes and people against each other."""
    seen: set[str] = set()
    for name in (*(box.name for box in world.boxes), *(walker.name for walker in world.walkers)):
        if name in seen:
            raise WorldError(f"{path}: {name!r}: the name stands twice; rename one of them")
        seen.add(name)
    way = 0.0
    for walker in world.walkers:
        if problem := way_problem(world, walker):
            raise WorldError(f"{path}: {walker.name!r}: {problem}")
        way += walker.length
        if way > MAX_WAY:
            raise WorldError(f"{path}: people: their ways are longer than {MAX_WAY:g} m in all; leave some out")
    for box in world.boxes:
        if box.kind != "wall" and not world.contains(box.x, box.y):
            raise WorldError(f"{path}: {box.name!r}: position ({box.x}, {box.y}) is off the floor")


def _numbers(value: Any, count: int, where: str) -> list[float]:
    """Return `count` finite numbers or raise WorldError."""
    numbers = value if isinstance(value, list) else []
    good = all(isinstance(n, int | float) and not isinstance(n, bool) and math.isfinite(n) for n in numbers)
    if len(numbers) != count or not good:
        raise WorldError(f"{where}: must be {count} finite number{'s' * (count > 1)}, found {value!r}")
    return [float(number) for number in numbers]
