"""The work cell: a table with two tag boards and six blocks. The map's origin is on the floor under its centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from robot_formulas.geometry import quaternion_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

Vector3 = tuple[float, float, float]
"""x, y, z in m."""
Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""
BodyPose = tuple[Vector3, Quaternion]

FLOOR_SIZE: Vector3 = (20.0, 20.0, 1.0)
TABLE_SIZE: Vector3 = (0.8, 1.6, 0.40)
"""m; an arm on the base reaches the near half of its top."""
TABLE_TOP = TABLE_SIZE[2]

BLOCK_SIZE: Vector3 = (0.05, 0.05, 0.05)
BLOCK_MASS = 0.09
"""kg: beech, 720 kg/m3."""
BLOCK_SPACING = 0.11
"""m between the centres of two blocks at least, so that the fingers fit between them at any yaw."""
_BLOCKS_X = (-0.32, -0.10)
_BLOCKS_Y = ((0.25, 0.60), (-0.60, -0.25))
_BLOCKS_A_SIDE = 3
_BLOCKS_STREAM = 20

TAG_SIZE = 0.14
"""Edge of a tag's black square, m."""
TAG_MODULES = 8
"""Modules along the edge of the black square: six of data within the black border."""
BOARD_SIZE = TAG_SIZE * (TAG_MODULES + 2) / TAG_MODULES
"""Edge of a tag's board, m: it leaves a white border of one module."""
BOARD_THICKNESS = 0.01
TAG_TILT = math.radians(45.0)
"""rad by which a board leans back from the vertical."""
_PIXELS = 16  # of the picture, per module
_INK, _PAPER = 75, 243
"""sRGB codes of the print: toner reflects 7 % of the light, paper 90 %."""


@dataclass(frozen=True)
class Tag:
    """An AprilTag 36h11 on a board that faces the robot.

    Attributes:
        number: its id.
        centre: of the black square, m.
        quaternion: of the board: x into the board, y to the left as one sees it, z up along it.
    """

    number: int
    centre: Vector3
    quaternion: Quaternion = (0.0, math.sin(TAG_TILT / 2.0), 0.0, math.cos(TAG_TILT / 2.0))

    def picture(self) -> NDArray[np.uint8]:
        """Return the board's picture in shades of grey (sRGB); its first row is the upper edge."""
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        tag = cv2.aruco.generateImageMarker(dictionary, self.number, TAG_MODULES * _PIXELS)
        return np.where(np.pad(tag, _PIXELS, constant_values=255) > 0, _PAPER, _INK).astype(np.uint8)


TAGS = (Tag(0, (0.15, 0.40, 0.47)), Tag(1, (0.15, -0.40, 0.47)))


def scatter_blocks(seed: int) -> Mapping[str, BodyPose]:
    """Return where the blocks lie on the table, drawn by a seed: the first three at the left, the rest at the right."""
    rng = np.random.default_rng([seed, _BLOCKS_STREAM])
    places: list[tuple[float, float]] = []
    for side in _BLOCKS_Y:
        first = len(places)
        while len(places) < first + _BLOCKS_A_SIDE:
            x, y = float(rng.uniform(*_BLOCKS_X)), float(rng.uniform(*side))
            if all(math.hypot(x - other_x, y - other_y) >= BLOCK_SPACING for other_x, other_y in places):
                places.append((x, y))
    z = TABLE_TOP + BLOCK_SIZE[2] / 2.0
    yaws = rng.uniform(-math.pi, math.pi, len(places))
    return {
        f"block_{number}": ((x, y, z), (0.0, 0.0, *quaternion_of(float(yaw))))
        for number, ((x, y), yaw) in enumerate(zip(places, yaws, strict=True), start=1)
    }
