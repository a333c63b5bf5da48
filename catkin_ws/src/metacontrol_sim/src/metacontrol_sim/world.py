"""Worlds: a floor with boxes on it, read from a YAML file and drawn as an occupancy grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

KINDS = {"walls": "wall", "racks": "rack", "pillars": "pillar", "pallets": "pallet", "boxes": "box"}
"""Sections of a world file and the kind of what they list."""
FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Cell values of nav_msgs/OccupancyGrid."""


class WorldError(ValueError):
    """A world file that cannot be read, or an entry in it that makes no sense."""


@dataclass(frozen=True)
class Box:
    """A box that stands on the floor.

    Attributes:
        name: unique within the world.
        kind: wall, rack, pillar, pallet or box.
        x: centre in the map frame, m.
        y: centre in the map frame, m.
        length: extent along its own x axis, m.
        width: extent along its own y axis, m.
        height: m above the floor.
        yaw: rad.
    """

    name: str
    kind: str
    x: float
    y: float
    length: float
    width: float
    height: float
    yaw: float = 0.0

    def distance(self, x: Any, y: Any) -> Any:
        """Return the distance in m of points (floats or arrays, map frame) to the box's outline, 0 inside."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        along, across = np.subtract(x, self.x), np.subtract(y, self.y)
        outside_x = np.maximum(np.abs(cos * along + sin * across) - self.length / 2.0, 0.0)
        outside_y = np.maximum(np.abs(cos * across - sin * along) - self.width / 2.0, 0.0)
        return np.hypot(outside_x, outside_y)


@dataclass(frozen=True)
class World:
    """A rectangular floor (map frame, m) and the boxes on it."""

    name: str
    x_min: float
    x_max: float
    y_min: float
    y_max: float
    boxes: tuple[Box, ...]

    def nearest(self, x: float, y: float) -> tuple[Box | None, float]:
        """Return the closest box and its distance in m (0 inside it); (None, inf) on an empty floor."""
        found = ((box, float(box.distance(x, y))) for box in self.boxes)
        return min(found, key=lambda item: item[1], default=(None, math.inf))

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point of the map frame lies on the floor."""
        return self.x_min <= x <= self.x_max and self.y_min <= y <= self.y_max


@dataclass(frozen=True)
class Grid:
    """An occupancy grid of the map frame.

    Attributes:
        cells: (rows along y, columns along x) int8: FREE, OCCUPIED or UNKNOWN.
        resolution: m per cell.
        origin_x: outer corner of cell (0, 0), m.
        origin_y: outer corner of cell (0, 0), m.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float


def rasterise(world: World, resolution: float = 0.05, margin: float = 0.5) -> Grid:
    """Draw a world: what lies off the floor and within no box is unknown; a cell that a box touches is occupied.

    Args:
        world: the world to draw.
        resolution: m per cell.
        margin: border around the floor in m.
    """
    columns = math.ceil((world.x_max - world.x_min + 2.0 * margin) / resolution - 1e-9)
    rows = math.ceil((world.y_max - world.y_min + 2.0 * margin) / resolution - 1e-9)
    origin_x, origin_y = world.x_min - margin, world.y_min - margin
    x, y = np.meshgrid(
        origin_x + (np.arange(columns) + 0.5) * resolution, origin_y + (np.arange(rows) + 0.5) * resolution
    )
    on_floor = (x > world.x_min) & (x < world.x_max) & (y > world.y_min) & (y < world.y_max)
    cells = np.where(on_floor, FREE, UNKNOWN).astype(np.int8)
    for box in world.boxes:
        cells[box.distance(x, y) < resolution / 2.0 - 1e-6] = OCCUPIED
    return Grid(cells, resolution, origin_x, origin_y)


def read_world(path: Path) -> World:
    """Read and check a world file.

    Raises:
        WorldError: the file is missing, not YAML, or one of its entries is wrong; names the file and the entry.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WorldError(f"{path}: cannot be read ({error.strerror}); give the path of a world file") from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise WorldError(f"{path}: is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise WorldError(f"{path}: holds no world; it needs the keys floor and any of {', '.join(KINDS)}")
    known = {"name", "floor", *KINDS}
    for key in content:
        if key not in known:
            raise WorldError(f"{path}: {key}: unknown key; known are {', '.join(sorted(known))}")
    x_min, x_max, y_min, y_max = _floor(content.get("floor"), path)
    boxes: list[Box] = []
    for section, kind in KINDS.items():
        entries = content.get(section) or []
        if not isinstance(entries, list):
            raise WorldError(f"{path}: {section}: must be a list of boxes")
        boxes.extend(_box(entry, kind, f"{path}: {section}[{index}]") for index, entry in enumerate(entries))
    world = World(str(content.get("name", path.stem)), x_min, x_max, y_min, y_max, tuple(boxes))
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


def _check(world: World, path: Path) -> None:
    """Check what concerns the boxes together."""
    seen: set[str] = set()
    for box in world.boxes:
        if box.name in seen:
            raise WorldError(f"{path}: {box.name!r}: the name stands twice; rename one of them")
        seen.add(box.name)
        if box.kind != "wall" and not world.contains(box.x, box.y):
            raise WorldError(f"{path}: {box.name!r}: position ({box.x}, {box.y}) is off the floor")


def _numbers(value: Any, count: int, where: str) -> list[float]:
    """Return `count` finite numbers or raise WorldError."""
    numbers = value if isinstance(value, list) else []
    good = all(isinstance(n, int | float) and not isinstance(n, bool) and math.isfinite(n) for n in numbers)
    if len(numbers) != count or not good:
        raise WorldError(f"{where}: must be {count} finite number{'s' * (count > 1)}, found {value!r}")
    return [float(number) for number in numbers]
