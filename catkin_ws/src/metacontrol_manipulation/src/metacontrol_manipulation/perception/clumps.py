"""Small things on the table that no level block explains: a block that leans on something, say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from metacontrol_manipulation.perception.fitting import DIFFERENCE
from metacontrol_manipulation.perception.scene import Cube, cube_depth
from metacontrol_manipulation.pick_place.pyramid import SIDE, TABLE_HEIGHT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from metacontrol_manipulation.perception.scene import DepthView

_LEAST_PIXELS = 120
"""A third of what a block shows."""
_WIDTHS = (0.025, 0.12)
"""m, smaller and larger side: not a finger of a gripper, at most two blocks side by side."""
_HEIGHTS = (0.03, 0.12)
"""m of its highest part above the table: not as high as a hand that holds a block."""
_TOP = 0.015
"""m of its height that make its highest part."""


@dataclass(frozen=True, slots=True)
class Clump:
    """Something as small as a block or two.

    Attributes:
        x: m, its highest part, in the cell frame.
        y: m.
        top: m, its height above the floor.
        yaw: rad.
    """

    x: float
    y: float
    top: float
    yaw: float


def clumps_in(view: DepthView, known: Sequence[Cube]) -> list[Clump]:
    """Return the small things that a depth image shows on the table beside the known cubes."""
    expected = view.table.copy()
    for cube in known:
        window = view.window(cube, 0)
        expected[window] = np.minimum(expected[window], cube_depth(cube, view.origin, view.rays[window]))
    with np.errstate(invalid="ignore"):
        more = np.isfinite(expected) & (view.depth < expected - DIFFERENCE)
    opened = cv2.morphologyEx(more.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=8)
    found = []
    for label in range(1, count):
        left, top, width, height, area = stats[label]
        if area < _LEAST_PIXELS:
            continue
        window = (slice(top, top + height), slice(left, left + width))
        inside = labels[window] == label
        clump = _clump(view.origin + view.rays[window][inside] * view.depth[window][inside][:, None])
        found += [clump] if clump is not None else []
    return found


def _clump(points: NDArray[np.float64]) -> Clump | None:
    """Return the small thing that points (N, 3) show, None where it is not one."""
    _, sides, turn = cv2.minAreaRect(points[:, :2].astype(np.float32))
    top = float(np.percentile(points[:, 2], 98.0))
    is_small = _WIDTHS[0] <= min(sides) and max(sides) <= _WIDTHS[1]
    if not is_small or not _HEIGHTS[0] <= top - TABLE_HEIGHT <= _HEIGHTS[1]:
        return None
    x, y = points[points[:, 2] > top - _TOP][:, :2].mean(axis=0)
    return Clump(float(x), float(y), max(top, TABLE_HEIGHT + SIDE), math.remainder(math.radians(turn), math.pi / 2.0))
