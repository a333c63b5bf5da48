"""The work cell, found by AprilTags: where it is in base_link."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import Pose, wrap
from scipy.optimize import least_squares

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from metacontrol_manipulation.perception.camera import Camera

SIDE = 0.14
"""m, the black square of a tag."""
TILT = math.radians(45.0)
"""rad by which a tag's board leans back from upright."""
TAGS = {0: (0.15, 0.40, 0.47), 1: (0.15, -0.40, 0.47)}
"""m, centres of the tags in the cell frame by id."""
WORST_ERROR = 3.0
"""pixels between seen and expected corners beyond which they are not those of the cell: a corner is found to 0.3 pixels
(measured in tests), the rest is left to a base that does not stand level."""

CORNER_ERROR = 0.4
"""Pixels, the error of a corner: what tests find is 0.3, and the errors of a tag's corners go together."""

_DETECTOR = cv2.aruco.DetectorParameters()
_DETECTOR.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
# A window of 3 pixels or 0.6 of a module around a corner, whichever is smaller: a larger one holds other corners, and
# with the usual 0.3 of a module a corner is found half as well (measured at 1.3 to 1.9 m).
_DETECTOR.cornerRefinementWinSize = 3
_DETECTOR.relativeCornerRefinmentWinSize = 0.6


@dataclass(frozen=True, slots=True)
class Expected:
    """Where the cell is expected before one looks.

    Attributes:
        cell: pose of the cell frame in base_link.
        deviation: m, the standard deviation of x and y.
        turn: rad, that of yaw.
    """

    cell: Pose
    deviation: float
    turn: float


@dataclass(frozen=True, slots=True)
class TagView:
    """The cell as its tags show it.

    Attributes:
        ids: of the tags that were found, in order.
        cell: pose of the cell frame in base_link.
        error: pixels, the root mean square between seen and expected corners.
        deviation: m, the standard deviation of the cell's x and y.
        turn: rad, that of its yaw.
        corners: pixels of the corners by id, clockwise from the upper left one.
    """

    ids: tuple[int, ...]
    cell: Pose
    error: float
    deviation: float
    turn: float
    corners: Mapping[int, tuple[tuple[float, float], ...]]


def find_cell(image: NDArray[np.uint8], camera: Camera, expected: Expected | None = None) -> TagView | None:
    """Return where the cell is, or None where no tag of the cell is found or those that are do not fit the cell.

    Args:
        image: (height, width, 3) or grey (height, width).
        camera: that took it.
        expected: where the cell is, as far as it is known; a single tag tells little of the yaw, for example.
    """
    found = find_tags(image)
    if not found:
        return None
    ids = tuple(sorted(found))
    seen = np.concatenate([found[tag] for tag in ids])
    places = np.concatenate([corners_of(tag) for tag in ids])
    cell, error, (deviation, turn) = _fit(seen, places, camera, expected)
    if error > WORST_ERROR:
        return None
    return TagView(
        ids, cell, error, deviation, turn, {tag: tuple((float(u), float(v)) for u, v in found[tag]) for tag in ids}
    )


def find_tags(image: NDArray[np.uint8]) -> dict[int, NDArray[np.float64]]:
    """Return the corners (4, 2) of the cell's tags in an image by id, clockwise from the upper left one of the tag."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, _DETECTOR).detectMarkers(grey)
    found = [] if ids is None else [int(tag) for tag in ids.flat]
    # A tag that is there twice is somewhere else, too: it tells nothing.
    return {
        tag: np.asarray(square, dtype=float).reshape(4, 2)
        for tag, square in zip(found, corners, strict=True)
        if tag in TAGS and found.count(tag) == 1
    }


def corners_of(tag: int) -> NDArray[np.float64]:
    """Return the corners (4, 3) of a tag's black square in the cell frame, in the detector's order."""
    left = np.array((0.0, SIDE / 2.0, 0.0))
    up = np.array((math.sin(TILT), 0.0, math.cos(TILT))) * SIDE / 2.0
    return np.array(TAGS[tag]) + np.array((left + up, up - left, -left - up, left - up))


def _fit(
    seen: NDArray[np.float64], places: NDArray[np.float64], camera: Camera, expected: Expected | None
) -> tuple[Pose, float, tuple[float, float]]:
    """Return the pose of the cell that fits best, the root mean square error in pixels, and the pose's deviations.

    The floor is flat, so the cell has three unknowns: x, y and yaw. With them, a single square has no second solution.
    """

    def misses(cell: NDArray[np.float64]) -> NDArray[np.float64]:
        points = np.column_stack((Pose(*cell).apply(places[:, :2]), places[:, 2]))
        return np.nan_to_num(camera.project(points) - seen, nan=1e3).ravel()

    def errors(cell: NDArray[np.float64]) -> NDArray[np.float64]:
        off = misses(cell) / CORNER_ERROR
        if expected is None:
            return off
        there, (deviation, turn) = expected.cell, (expected.deviation, expected.turn)
        yaw = wrap(cell[2] - there.yaw)
        return np.append(off, ((cell[0] - there.x) / deviation, (cell[1] - there.y) / deviation, yaw / turn))

    start = _start(seen, places, camera)
    if not np.isfinite(start).all():
        return Pose(0.0, 0.0), math.inf, (math.inf, math.inf)
    solution = least_squares(errors, start, method="lm")
    covariance = np.linalg.inv(solution.jac.T @ solution.jac)
    error = float(np.sqrt((misses(solution.x) ** 2).sum() / len(seen)))
    deviations = float(np.sqrt(max(covariance[0, 0], covariance[1, 1]))), float(np.sqrt(covariance[2, 2]))
    return Pose(*(float(value) for value in solution.x)), error, deviations


def _start(seen: NDArray[np.float64], places: NDArray[np.float64], camera: Camera) -> tuple[float, float, float]:
    """Return a first guess: each corner's height is known, so its ray leads to a place; the places are put together."""
    rays = camera.back_project(seen, np.ones(len(seen))) - camera.position
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (places[:, 2] - camera.position[2]) / rays[:, 2]
    there = camera.position[:2] + rays[:, :2] * along[:, None]
    centre, middle = places[:, :2].mean(axis=0), there.mean(axis=0)
    before, after = places[:, :2] - centre, there - middle
    yaw = math.atan2(
        (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]).sum(),
        (before * after).sum(),
    )
    cos, sin = math.cos(yaw), math.sin(yaw)
    return (
        float(middle[0] - cos * centre[0] + sin * centre[1]),
        float(middle[1] - sin * centre[0] - cos * centre[1]),
        yaw,
    )
