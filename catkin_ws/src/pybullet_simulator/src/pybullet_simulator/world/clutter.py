"""Clutter: seeded random places for obstacles on a map, which leave the robot a way to its goal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import Pose

from pybullet_simulator.world.grid import FREE
from pybullet_simulator.world.obstacles import CLUTTER_SIZE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pybullet_simulator.world.grid import Grid

KEEP_OUT = 1.5
"""m around the ends of the way that stay free: an obstacle there would end a mission before it began."""
PASSAGE_RADIUS = 0.6
"""m; half the width of the passage that is left: the robot's half width, 0.4 m, with room to steer."""
MARGIN = 0.05
"""m between an obstacle and anything else."""
_TRIES = 200


class ClutterError(ValueError):
    """The map has no room for the clutter."""


def scatter(grid: Grid, start: Pose, goal: Pose, count: int, seed: int) -> tuple[Pose, ...]:
    """Return random places for obstacles, the same for the same arguments.

    The places keep clear of start, goal, walls and each other, and leave a passage from start to goal.

    Args:
        grid: the map.
        start: of the way, map frame.
        goal: of the way, map frame.
        count: of obstacles.
        seed: of chance.

    Raises:
        ClutterError: there is no room for so many.
    """
    rng = np.random.default_rng([seed, 9])
    reach = math.hypot(*CLUTTER_SIZE[:2]) / 2.0
    free = grid.cells == FREE
    allowed = (_clearance(free, grid.resolution) > reach + MARGIN) & _far_from(grid, (start, goal), KEEP_OUT)
    places: list[Pose] = []
    for _ in range(count * _TRIES):
        if len(places) == count:
            break
        candidates = np.flatnonzero(allowed)
        if candidates.size == 0:
            break
        row, column = divmod(int(candidates[rng.integers(candidates.size)]), free.shape[1])
        x, y = grid.to_map(*(np.array((column, row)) + rng.random(2)) * grid.resolution)
        place = Pose(float(x), float(y), float(rng.uniform(0.0, math.pi / 2.0)))
        left = free & _far_from(grid, (place,), reach)
        if _connected(left, grid, start, goal) or not _connected(free, grid, start, goal):
            free = left
            places.append(place)
            allowed &= _far_from(grid, (place,), 2.0 * reach + MARGIN)
        else:
            allowed[row, column] = False
    if len(places) < count:
        raise ClutterError(
            f"the map has room for {len(places)} obstacles that leave a way to the goal, not for {count}"
        )
    return tuple(places)


def _clearance(free: NDArray[np.bool_], resolution: float) -> NDArray[np.float32]:
    """Return each cell's distance to the next cell that is not free, m."""
    return cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * np.float32(resolution)


def _far_from(grid: Grid, places: tuple[Pose, ...], distance: float) -> NDArray[np.bool_]:
    """Tell which cells lie at least a distance (m) from all places."""
    rows, columns = grid.cells.shape
    along = (np.arange(columns) + 0.5) * grid.resolution
    across = (np.arange(rows) + 0.5) * grid.resolution
    far = np.ones((rows, columns), dtype=bool)
    for place in places:
        x, y = grid.from_map(place.x, place.y)
        far &= np.hypot(along[np.newaxis, :] - x, across[:, np.newaxis] - y) >= distance
    return far


def _connected(free: NDArray[np.bool_], grid: Grid, start: Pose, goal: Pose) -> bool:
    """Tell whether a passage leads from start to goal."""
    passage = _clearance(free, grid.resolution) > PASSAGE_RADIUS
    _, labels = cv2.connectedComponents(passage.astype(np.uint8))
    ends = []
    for place in (start, goal):
        x, y = grid.from_map(place.x, place.y)
        row, column = int(y / grid.resolution), int(x / grid.resolution)
        if not (0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]):
            return False
        ends.append(int(labels[row, column]))
    return ends[0] == ends[1] != 0
