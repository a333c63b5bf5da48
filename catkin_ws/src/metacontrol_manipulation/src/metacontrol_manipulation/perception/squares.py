"""Squares in a plane seen from above: where the tops of cubes may be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import cv2
import numpy as np

from metacontrol_manipulation.perception.scene import TABLE_HALF
from metacontrol_manipulation.pick_place.pyramid import SIDE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from metacontrol_manipulation.perception.scene import DepthView

RESOLUTION = 0.0025
"""m, edge of a cell of the plane; a pixel of the mast camera shows 3 mm."""
TOLERANCE = 0.012
"""m between a plane and what is seen on it: four standard deviations of the depth's noise."""
YAWS = tuple(math.radians(7.5 * step) for step in range(12))
LEAST_SCORE = 0.4
"""Of a square, as a share of its area: a top that is hidden by more than half is not looked for."""
STEEPEST = 0.2
"""Slope beyond which a surface is not the top of a block; the noise of depth makes one of 0.02."""
FARTHEST = 0.006
"""m between the plane and a surface, in its middle, beyond which it is not in the plane."""
_OPENING = 7
"""Cells: a strip that is narrower is the side of something, where it passes the plane."""
_RING = 2
"""Cells around a square that ought to be free of it: this places squares at the end of a row, not astride."""
_CELLS = SIDE / RESOLUTION


@dataclass(frozen=True, eq=False)
class Plane:
    """A level plane seen from above, in cells: rows along x, columns along y of the cell frame.

    Attributes:
        above: m by which what the camera sees there is above the plane, not a number where it sees nothing.
        there: whether something lies in the plane.
        free: whether the camera looks through the plane; where neither holds, something hides it.
    """

    above: NDArray[np.float32]
    there: NDArray[np.bool_]
    free: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Square:
    """A square with the edge of a block: centre in m, yaw in rad."""

    x: float
    y: float
    yaw: float


def plane_at(view: DepthView, height: float) -> Plane:
    """Return what a depth image shows of the level plane at a height in m, over the table."""
    counts = [round(2.0 * half / RESOLUTION) for half in TABLE_HALF]
    xs, ys = ((np.arange(count) + 0.5) * RESOLUTION - half for count, half in zip(counts, TABLE_HALF, strict=True))
    # In the optical frame, a point of the plane is a sum: a part from x, a part from y, and the corner.
    to_optical = view.camera.pose[:3, :3].T @ view.cell.matrix()[:3, :3]
    along_x, along_y, _ = to_optical.T.astype(np.float32)
    corner = -to_optical @ (view.origin - (0.0, 0.0, height))
    of_x = (along_x * xs[:, None].astype(np.float32) + corner.astype(np.float32)).T[..., None]
    of_y = (along_y * ys[:, None].astype(np.float32)).T[:, None]
    expected = of_x[2] + of_y[2]
    camera = view.camera
    columns = (of_x[0] + of_y[0]) / expected * np.float32(camera.fx) + np.float32(camera.cx)
    rows = (of_x[1] + of_y[1]) / expected * np.float32(camera.fy) + np.float32(camera.cy)
    seen = cv2.remap(
        *(view.depth.astype(np.float32), columns, rows, cv2.INTER_NEAREST),
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=math.nan,
    )
    # A ray that has gone the share s of its way to the plane is (1 - s) times the camera's height above it.
    above = (1.0 - seen / expected) * np.float32(view.origin[2] - height)
    return Plane(above, np.abs(above) < TOLERANCE, above <= -TOLERANCE)


def squares_in(plane: Plane, likely: Sequence[Square] = ()) -> Iterator[Square]:
    """Yield the squares that a plane may hold, the clearest of each patch first; they do not overlap.

    Args:
        plane: what is seen of it.
        likely: squares that come first if what is seen allows them: in a row that is hidden in part, many are possible.
    """
    there = cv2.morphologyEx(plane.there.astype(np.uint8), cv2.MORPH_OPEN, np.ones((_OPENING, _OPENING), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(there, connectivity=8)
    pad = round(0.3 * _CELLS)
    for left, top, width, height, area in stats[1:count]:
        if area < LEAST_SCORE * _CELLS**2:
            continue
        rows = slice(max(top - pad, 0), top + height + pad)
        columns = slice(max(left - pad, 0), left + width + pad)
        patch = Plane(plane.above[rows, columns], there[rows, columns] > 0, plane.free[rows, columns])
        corner = np.array((rows.start, columns.start))
        first = [(*(_cells(square) - corner), square.yaw) for square in likely]
        for row, column, yaw in _fitted(patch, first):
            if not _is_level(patch, row, column):
                continue
            x, y = (corner + np.array((row + 0.5, column + 0.5))) * RESOLUTION - TABLE_HALF
            yield Square(float(x), float(y), yaw)


def _cells(square: Square) -> NDArray[np.int64]:
    """Return row and column of the centre of a square."""
    return np.floor((np.array((square.x, square.y)) + TABLE_HALF) / RESOLUTION).astype(int)


def _is_level(patch: Plane, row: int, column: int) -> bool:
    """Return whether the middle of a square is level and in the plane, unlike links of an arm or boards of tags."""
    reach = round(0.35 * _CELLS)
    part = (slice(max(row - reach, 0), row + reach + 1), slice(max(column - reach, 0), column + reach + 1))
    rows, columns = np.nonzero(patch.there[part])
    if rows.size < reach**2:
        return False
    places = np.column_stack((rows, columns, np.ones(rows.size))) * (RESOLUTION, RESOLUTION, 1.0)
    slope = np.linalg.lstsq(places, patch.above[part][rows, columns], rcond=None)[0]
    offset = float(np.median(patch.above[part][rows, columns]))
    return math.hypot(slope[0], slope[1]) < STEEPEST and abs(offset) < FARTHEST


def _fitted(patch: Plane, first: Sequence[tuple[int, int, float]]) -> Iterator[tuple[int, int, float]]:
    """Yield centre (row, column) and yaw of the best square, then of the best that does not overlap it, and so on.

    Those that are asked for come first if they are good enough.
    """
    evidence = patch.there.astype(np.float32) - (patch.free & ~patch.there)
    height, width = evidence.shape
    for row, column, yaw in first:
        if 0 <= row < height and 0 <= column < width and _scores(evidence, yaw)[row, column] > LEAST_SCORE:
            yield int(row), int(column), yaw
            _take(evidence, row, column, yaw)
    while True:
        best, place = LEAST_SCORE, None
        for yaw in YAWS:
            score = _scores(evidence, yaw)
            _, highest, _, (column, row) = cv2.minMaxLoc(score)
            if highest > best:
                best, place = highest, (row, column, yaw)
        if place is None:
            return
        yield place
        _take(evidence, *place)


def _scores(evidence: NDArray[np.float32], yaw: float) -> NDArray[np.float32]:
    """Return how much speaks for a square of a yaw at each cell."""
    scores = cv2.filter2D(evidence, cv2.CV_32F, _kernel(yaw), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(scores, dtype=np.float32)


def _take(evidence: NDArray[np.float32], row: int, column: int, yaw: float) -> None:
    """Leave no room for a further square where one is."""
    corners = _corners(yaw, _CELLS / 2.0 - 1.0) + np.array((column, row))
    cv2.fillConvexPoly(evidence, np.round(corners).astype(np.int32), -1.0)


@lru_cache(maxsize=len(YAWS))
def _kernel(yaw: float) -> NDArray[np.float32]:
    """Return what cells count for a square at the origin: 1 in it, less than 0 around it, as shares of its area."""
    half = math.ceil((_CELLS / 2.0 + _RING) * math.sqrt(2.0))
    rows, columns = np.mgrid[-half : half + 1, -half : half + 1]
    cos, sin = math.cos(yaw), math.sin(yaw)
    reach = np.maximum(np.abs(cos * rows + sin * columns), np.abs(cos * columns - sin * rows))
    inside = reach <= _CELLS / 2.0
    ring = ~inside & (reach <= _CELLS / 2.0 + _RING)
    return ((inside - 0.5 * ring) / inside.sum()).astype(np.float32)


def _corners(yaw: float, half: float) -> NDArray[np.float64]:
    """Return the corners (column, row) of a square around the origin."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    along = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) * half  # x, y
    rows, columns = along[:, 0] * cos - along[:, 1] * sin, along[:, 0] * sin + along[:, 1] * cos
    return np.column_stack((columns, rows))
