"""Grasps of cubes from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from arm_motion import kinematics
from arm_motion.panda import HOME
from arm_motion.planning import NoPathError, line

if TYPE_CHECKING:
    from collections.abc import Sequence

    from arm_motion.scene import Box, Scene
    from arm_motion.vectors import Array, Vector

APPROACH = 0.10
"""m; how far above a grasp its way down begins."""

_ALONG = np.radians(46.0)
_DIFFERENT = 0.4  # rad, the norm of the difference


@dataclass(frozen=True, slots=True)
class Grasp:
    """A way to take or put a cube from above.

    Attributes:
        yaw: direction in which the fingers close, rad.
        position: of the TCP.
        quaternion: of the TCP.
        down: path from the posture above to the grasp; backwards it is the way up.
    """

    yaw: float
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    down: tuple[Array, ...]

    @property
    def above(self) -> Array:
        """Return the posture above the cube."""
        return self.down[0]

    @property
    def joints(self) -> Array:
        """Return the posture at the cube."""
        return self.down[-1]


def top_down(yaw: float) -> tuple[float, float, float, float]:
    """Return the orientation of a TCP that points down and whose fingers close in the direction of a yaw."""
    half = (yaw + np.pi / 2.0) / 2.0  # half a turn about an axis mirrors the fingers' direction, y, in that axis
    return float(np.cos(half)), float(np.sin(half)), 0.0, 0.0


def yaws(yaw: float, along: float | None = None) -> list[float]:
    """Return the four directions in which fingers can close on a cube, or those two that are near a direction.

    Args:
        yaw: of the cube.
        along: a direction; the fingers close within 45 degrees of it or of its opposite.
    """
    four = [float(np.remainder(yaw + turn * np.pi / 2.0 + np.pi, 2.0 * np.pi) - np.pi) for turn in range(4)]
    if along is None:
        return four
    return [one for one in four if abs(np.cos(one - along)) >= np.cos(_ALONG)]


def grasp(
    scene: Scene,
    position: Sequence[float],
    yaw: float,
    near: Vector,
    *,
    along: float | None = None,
    held: Box | None = None,
    approach: float = APPROACH,
) -> Grasp | None:
    """Return the free grasp of a cube from above that is nearest to a posture, or None.

    Args:
        scene: what is in the way. The cube may be part of it unless it is held.
        position: of the cube's centre.
        yaw: of the cube.
        near: the present posture.
        along: direction in which the fingers have to close, see `yaws`.
        held: the cube, if it is put there.
        approach: m, length of the way down.
    """
    x, y, z = position
    near = np.asarray(near, float)
    found = [
        (float(np.linalg.norm(above - near)), number, direction, above)
        for number, direction in enumerate(yaws(yaw, along))
        if scene.free_inverse((x, y, z), top_down(direction), near, held) is not None
        for above in _distinct(kinematics.inverse((x, y, z + approach), top_down(direction), near))
    ]
    for _, _, direction, above in sorted(found, key=lambda one: one[:2]):
        if scene.is_free(above, held):
            try:
                down = line(scene, above, (x, y, z), top_down(direction), held)
            except NoPathError:
                continue
            return Grasp(direction, (x, y, z), top_down(direction), tuple(down))
    return None


def reachable(scene: Scene, x: float, y: float, z: float, near: Vector = HOME) -> bool:
    """Say whether the arm can take a cube there from above, in one of eight directions of the fingers."""
    return any(grasp(scene, (x, y, z), yaw, near) is not None for yaw in (0.0, np.pi / 4.0))


def _distinct(postures: Array) -> list[Array]:
    """Return postures that differ from those before."""
    kept: list[Array] = []
    for posture in postures:
        if not kept or np.linalg.norm(np.array(kept) - posture, axis=1).min() >= _DIFFERENT:
            kept.append(posture)
    return kept
