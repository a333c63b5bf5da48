"""What the mast camera sees: linear light and depth, rendered by PyBullet's software renderer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pybullet

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from pybullet_simulator.robot.manipulator import MastCamera

_NEAR, _FAR = 0.1, 6.0
"""m; what is nearer or farther is not drawn."""
_AMBIENT, _DIFFUSE = 0.6, 0.4
"""Shares of light from everywhere and from the lamp; together 1, so that white in full light is 1."""
_LAMP = (-1.0, 0.5, 3.0)
"""Direction to the lamp: above the cell, on the robot's side."""


def _linear(code: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light of sRGB's code, 0 to 1 (IEC 61966-2-1)."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


_LINEAR = _linear(np.arange(256) / 255.0).astype(np.float32)


def render(camera: MastCamera, base: Pose, client: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the camera's view from a pose of base_link.

    Returns:
        Linear light at full brightness, (height, width, 3) with 1 for white paper, and depth along the optical axis,
        (height, width) in m, inf where nothing is.
    """
    cos, sin = math.cos(base.yaw), math.sin(base.yaw)
    eye = (base.x + cos * camera.x - sin * camera.y, base.y + sin * camera.x + cos * camera.y, camera.z)
    ahead, down = math.cos(camera.pitch), math.sin(camera.pitch)
    target = (eye[0] + cos * ahead, eye[1] + sin * ahead, eye[2] - down)
    _, _, colours, buffer, _ = pybullet.getCameraImage(
        camera.width,
        camera.height,
        pybullet.computeViewMatrix(eye, target, (0.0, 0.0, 1.0)),
        pybullet.computeProjectionMatrixFOV(
            math.degrees(camera.field_of_view), camera.width / camera.height, _NEAR, _FAR
        ),
        lightDirection=_LAMP,
        lightAmbientCoeff=_AMBIENT,
        lightDiffuseCoeff=_DIFFUSE,
        lightSpecularCoeff=0.0,
        shadow=0,
        renderer=pybullet.ER_TINY_RENDERER,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        physicsClientId=client,
    )
    shape = (camera.height, camera.width)
    light = _LINEAR[np.asarray(colours, dtype=np.uint8).reshape(*shape, 4)[..., :3]]
    buffer = np.asarray(buffer, dtype=np.float32).reshape(shape)
    depth = _FAR * _NEAR / (_FAR - (_FAR - _NEAR) * buffer)
    return light, np.where(buffer < 1.0, depth, np.float32(np.inf)).astype(np.float32)
