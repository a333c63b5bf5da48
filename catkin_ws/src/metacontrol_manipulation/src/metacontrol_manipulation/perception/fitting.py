"""Cubes fitted to a depth image: those whose image is most like what the camera saw."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
from scipy.optimize import minimize

from metacontrol_manipulation.perception.scene import Cube, cube_depth
from metacontrol_manipulation.pick_place.pyramid import SIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from metacontrol_manipulation.perception.scene import DepthView

DIFFERENCE = 0.015
"""m between seen and expected depth beyond which a pixel shows something else."""
_NEAR = 2.0 * SIDE
"""m between cubes that share pixels, or may."""
_STEP = (0.004, 0.004, math.radians(4.0))
"""First step of the search along x and y in m and of yaw in rad."""
_AROUND = 2
"""Pixels around a cube in which it must not go on."""
_MARGIN = 4
"""Pixels around a cube that count: they tell where it ends."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What the pixels say on which a cube should be seen.

    Attributes:
        expected: pixels that should show it.
        shown: those that do, to the depth.
        through: those that show something behind it.
        before: those that show something before it.
        around: pixels just outside of it that should show something behind it.
        crowded: those of them that show something as near as the cube.
    """

    expected: int
    shown: int
    through: int
    before: int
    around: int
    crowded: int

    @property
    def agreement(self) -> float:
        """The share of the pixels with nothing before the cube that show it."""
        return self.shown / max(self.shown + self.through, 1)

    @property
    def visibility(self) -> float:
        """The share of its pixels with nothing before it."""
        return (self.shown + self.through) / max(self.expected, 1)

    @property
    def continuation(self) -> float:
        """The share of the pixels around that show the same as the cube: it is a part of something larger."""
        return self.crowded / max(self.around, 1)


def fitted(cubes: Sequence[Cube], view: DepthView, sweeps: int = 2) -> list[Cube]:
    """Return the cubes, each moved and turned on its level until the expected image is most like the one that was seen.

    Args:
        cubes: where they are, about.
        view: what was seen.
        sweeps: how often each is fitted again, with its neighbours where they were found by then.
    """
    found = list(cubes)
    for sweep in range(sweeps):
        for number, cube in enumerate(found):
            others = _neighbours(cube, found)
            if sweep == 0 or others:
                found[number] = _fit(cube, others, view)
    return found


def evidence_for(cube: Cube, others: Sequence[Cube], view: DepthView) -> Evidence:
    """Return what speaks for a cube among others."""
    window = view.window(cube, _AROUND + 1)
    seen = view.depth[window]
    expected = cube_depth(cube, view.origin, view.rays[window])
    behind = _expected_depth(_neighbours(cube, others), view, window)
    there = np.isfinite(expected) & (expected <= behind)
    difference = (seen - expected)[there]
    kernel = np.ones((2 * _AROUND + 1, 2 * _AROUND + 1), np.uint8)
    # Beside the cube, as near as the nearest of its pixels that is next to it.
    near = cv2.erode(np.where(there, expected, np.inf), kernel, borderType=cv2.BORDER_REPLICATE)
    far = cv2.dilate(np.where(there, expected, -np.inf), kernel, borderType=cv2.BORDER_REPLICATE)
    beside = ~np.isfinite(expected) & np.isfinite(near) & (behind > far + DIFFERENCE) & np.isfinite(seen)
    same = beside & (seen > near - DIFFERENCE) & (seen < far + DIFFERENCE)
    return Evidence(
        int(there.sum()),
        int((np.abs(difference) <= DIFFERENCE).sum()),
        int((difference > DIFFERENCE).sum()),
        int((difference < -DIFFERENCE).sum()),
        int(beside.sum()),
        int(same.sum()),
    )


def _fit(cube: Cube, others: Sequence[Cube], view: DepthView) -> Cube:
    window = view.window(cube, _MARGIN)
    seen = view.depth[window].ravel()
    known = np.isfinite(seen)
    if not known.any():
        return cube
    seen, rays = seen[known], view.rays[window].reshape(-1, 3)[known]
    rest = _expected_depth(others, view, window).ravel()[known]

    def unlikeness(change: NDArray[np.float64]) -> float:
        expected = np.minimum(rest, cube_depth(_moved(cube, change), view.origin, rays))
        with np.errstate(invalid="ignore"):
            share = (seen - expected) / DIFFERENCE
        return float(np.minimum(share * share, 1.0).sum())

    start = np.zeros(3)
    simplex = np.vstack([start, np.diag(_STEP)]) - np.array(_STEP) / 3.0
    options = {"initial_simplex": simplex, "xatol": 2e-4, "fatol": 0.1, "maxfev": 80}
    return _moved(cube, minimize(unlikeness, start, method="Nelder-Mead", options=options).x)


def _moved(cube: Cube, change: NDArray[np.float64]) -> Cube:
    x, y, yaw = (float(value) for value in change)
    return replace(cube, x=cube.x + x, y=cube.y + y, yaw=cube.yaw + yaw)


def _neighbours(cube: Cube, cubes: Sequence[Cube]) -> list[Cube]:
    """Return the other cubes that may stand before or behind a cube."""
    return [
        other
        for other in cubes
        if other is not cube and math.hypot(other.x - cube.x, other.y - cube.y) < _NEAR and other != cube
    ]


def _expected_depth(cubes: Sequence[Cube], view: DepthView, window: tuple[slice, slice]) -> NDArray[np.float64]:
    """Return the depth of the table with cubes on it in a part of the image."""
    depth = view.table[window]
    for cube in cubes:
        depth = np.minimum(depth, cube_depth(cube, view.origin, view.rays[window]))
    return depth
