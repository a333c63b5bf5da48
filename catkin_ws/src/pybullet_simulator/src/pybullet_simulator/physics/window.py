"""Draws into PyBullet's window: scan, cloud, costmaps, plans, goal, and a text over the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pybullet
from robot_formulas.geometry import ORIGIN, Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

RED, BLUE, GREEN, SKY, PINK = (1.0, 0.1, 0.1), (0.3, 0.5, 1.0), (0.1, 0.9, 0.1), (0.0, 0.7, 1.0), (1.0, 0.1, 0.8)
WHITE = (1.0, 1.0, 1.0)
LOW, GLOBAL_HIGH, LOCAL_HIGH = (0.45, 0.35, 0.70), (0.75, 0.75, 0.95), (1.0, 0.45, 0.0)
"""Colours of low costs, and of the high ones of global and local costmap."""
_TEXT_HEIGHT = 2.5  # over racks
_LINE_SPACING = 0.7
_BESIDE, _BEHIND = 0.8, 0.5  # m from the robot's middle: white is hard to read on the robot's yellow
_MAX_POINTS = 4000
_CLOSE_POINT = 0.05


@dataclass(frozen=True)
class Points:
    """Points to draw.

    Attributes:
        xyz: (n, 3) m, in the frame of `frame`.
        colour: red, green, blue, or one per point: (n, 3).
        frame: pose of the points' frame on the map.
        size: pixels.
    """

    xyz: NDArray[np.float64]
    colour: tuple[float, float, float] | NDArray[np.float64]
    frame: Pose = ORIGIN
    size: int = 3


@dataclass
class Window:
    """Keeps what is drawn, to replace it."""

    client: int
    _items: dict[str, int] = field(default_factory=dict)

    def draw(self, name: str, points: Points) -> None:
        """Draw points in place of those drawn under this name before."""
        xyz = points.xyz[np.isfinite(points.xyz).all(axis=1)]
        colours = np.broadcast_to(np.asarray(points.colour, dtype=float), points.xyz.shape)
        colours = colours[np.isfinite(points.xyz).all(axis=1)]
        step = max(1, math.ceil(len(xyz) / _MAX_POINTS))
        xyz, colours = xyz[::step], colours[::step]
        if not len(xyz):
            self._remove(name)
            return
        cos, sin = math.cos(points.frame.yaw), math.sin(points.frame.yaw)
        placed = xyz @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        placed += (points.frame.x, points.frame.y, 0.0)
        item = pybullet.addUserDebugPoints(
            placed.tolist(),
            colours.tolist(),
            points.size,
            replaceItemUniqueId=self._items.get(name, -1),
            physicsClientId=self.client,
        )
        self._items[name] = item

    def write(self, lines: Sequence[str], place: Pose, alarm: bool) -> None:
        """Write lines over a place, red where there is an alarm."""
        for number in range(max(len(lines), sum(name.startswith("line") for name in self._items))):
            name = f"line{number}"
            if number >= len(lines):
                self._remove(name)
                continue
            up = _LINE_SPACING * (len(lines) - 1 - number)
            self._items[name] = pybullet.addUserDebugText(
                lines[number],
                (place.x + _BESIDE, place.y + _BEHIND + up, _TEXT_HEIGHT),  # the window looks down from the south
                textColorRGB=RED if alarm else WHITE,
                textSize=1.6,
                replaceItemUniqueId=self._items.get(name, -1),
                physicsClientId=self.client,
            )

    def _remove(self, name: str) -> None:
        """Remove all that was drawn under a name."""
        if name in self._items:
            pybullet.removeUserDebugItem(self._items.pop(name), physicsClientId=self.client)


def scan_points(ranges: NDArray[np.float64], angle_min: float, increment: float, height: float) -> NDArray[np.float64]:
    """Return the points of a scan in the laser's frame, at a height over the floor: (n, 3) m."""
    angles = angle_min + increment * np.arange(ranges.size)
    hit = np.isfinite(ranges)
    ranges, angles = ranges[hit], angles[hit]
    return np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles), np.full(ranges.size, height)))


def path_points(corners: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Return points close to each other along a path of (n, 2) m, at a height: (m, 3)."""
    corners = corners[np.isfinite(corners).all(axis=1)]
    if len(corners) < 2:
        return np.empty((0, 3))
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    places = np.linspace(0.0, along[-1], min(math.ceil(along[-1] / _CLOSE_POINT) + 1, _MAX_POINTS))
    x, y = (np.interp(places, along, corners[:, axis]) for axis in (0, 1))
    return np.column_stack((x, y, np.full(x.size, height)))


def cost_points(
    costs: NDArray[np.int8], resolution: float, height: float, high: tuple[float, float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points of a costmap's cells that cost something, and their colours: both (n, 3).

    If there are too many cells, each square of cells becomes one point with the highest of their costs.

    Args:
        costs: (rows, columns) as of an OccupancyGrid.
        resolution: m per cell.
        height: m over the floor.
        high: colour of the highest cost.
    """
    side = math.ceil(math.sqrt(max(1.0, np.count_nonzero(costs > 0) / _MAX_POINTS)))
    while np.count_nonzero((squares := _highest(costs, side)) > 0) > _MAX_POINTS:
        side += 1
    costs, resolution = squares, side * resolution
    rows, columns = np.nonzero(costs > 0)
    share = (costs[rows, columns] / 100.0)[:, np.newaxis]
    xyz = np.column_stack(((columns + 0.5) * resolution, (rows + 0.5) * resolution, np.full(rows.size, height)))
    return xyz, np.asarray(LOW) * (1.0 - share) + np.asarray(high) * share


def _highest(costs: NDArray[np.int8], side: int) -> NDArray[np.int8]:
    """Return the highest cost of each square of `side` x `side` cells; squares at the far edges may be incomplete."""
    rows, columns = costs.shape
    padded = np.pad(costs, ((0, -rows % side), (0, -columns % side)))
    squares: NDArray[np.int8] = padded.reshape(-(-rows // side), side, -(-columns // side), side).max(axis=(1, 3))
    return squares


def cross_points(x: float, y: float) -> NDArray[np.float64]:
    """Return the points of a mast with a cross at its foot, for a goal: (n, 3) m."""
    arm = np.linspace(-0.4, 0.4, 40)
    foot = np.concatenate((np.column_stack((arm, arm)), np.column_stack((arm, -arm))))
    flat = np.column_stack((x + foot[:, 0], y + foot[:, 1], np.full(len(foot), 0.05)))
    mast = np.column_stack((np.full(40, x), np.full(40, y), np.linspace(0.0, 1.2, 40)))
    return np.concatenate((flat, mast))
