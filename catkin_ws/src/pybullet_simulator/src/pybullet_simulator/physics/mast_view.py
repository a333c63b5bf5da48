"""What the mast camera sees: linear light and depth, rendered by PyBullet's software renderer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pybullet
from robot_formulas.geometry import Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pybullet_simulator.robot.manipulator import MastCamera

_NEAR, _FAR = 0.1, 6.0
"""m; what is nearer or farther is not drawn."""
_EMPTY = 0.99 * _FAR
"""m; where nothing is, PyBullet's depth is a little less than _FAR."""
_AMBIENT, _DIFFUSE = 0.6, 0.4
"""Shares of light from everywhere and from the lamp; together 1, so that white in full light is 1."""
_LAMP = (-1.0, 0.5, 3.0)
"""Direction to the lamp: above the cell, on the robot's side."""


def _linear(code: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light of sRGB's code, 0 to 1 (IEC 61966-2-1)."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


_LINEAR = _linear(np.arange(256) / 255.0).astype(np.float32)
_FLOOR = np.array((0.16, 0.18, 0.16), dtype=np.float32)
"""Linear light of the floor, grey concrete."""


class MastView:
    """The view of a camera from a base that stands on the floor.

    PyBullet draws everything but the floor, because it takes half a microsecond for each pixel. From a mast of fixed
    height, the floor looks the same everywhere.
    """

    def __init__(self, camera: MastCamera, client: int) -> None:
        """Prepare for a camera."""
        self._camera, self._client = camera, client
        self._shape = (camera.height, camera.width)
        self._projection = pybullet.computeProjectionMatrixFOV(
            math.degrees(camera.field_of_view), camera.width / camera.height, _NEAR, _FAR
        )
        down = (np.arange(camera.height) - (camera.height - 1) / 2.0) / camera.focal_length
        drop = math.sin(camera.pitch) + math.cos(camera.pitch) * down  # of a ray, per m along the optical axis
        with np.errstate(divide="ignore"):
            rows = np.where(drop > 0.0, camera.z / drop, np.inf)
        self._floor = np.repeat(rows.astype(np.float32)[:, np.newaxis], camera.width, axis=1)

    def render(self, base: Pose) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what the camera sees from a pose of base_link.

        Returns:
            Linear light at full brightness, (height, width, 3) with 1 for white paper, and depth along the optical
            axis, (height, width) in m.
        """
        camera = self._camera
        eye = base @ Pose(camera.x, camera.y)
        cos, sin = math.cos(base.yaw), math.sin(base.yaw)
        ahead, down = math.cos(camera.pitch), math.sin(camera.pitch)
        _, _, colours, buffer, _ = pybullet.getCameraImage(
            camera.width,
            camera.height,
            pybullet.computeViewMatrix(
                (eye.x, eye.y, camera.z), (eye.x + cos * ahead, eye.y + sin * ahead, camera.z - down), (0.0, 0.0, 1.0)
            ),
            self._projection,
            lightDirection=_LAMP,
            lightAmbientCoeff=_AMBIENT,
            lightDiffuseCoeff=_DIFFUSE,
            lightSpecularCoeff=0.0,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
        )
        light = _LINEAR[np.asarray(colours, dtype=np.uint8).reshape(*self._shape, 4)[..., :3]]
        buffer = np.asarray(buffer, dtype=np.float32).reshape(self._shape)
        depth = _FAR * _NEAR / (_FAR - (_FAR - _NEAR) * buffer)
        empty = depth > _EMPTY
        light[empty] = _FLOOR
        return light, np.where(empty, self._floor, depth)
