"""A pinhole camera: from pixels with depth to points and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

_TOWARDS = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Axes of an optical frame (x right, y down, z ahead) in a frame whose x is ahead and z up (REP 103)."""


class CameraError(ValueError):
    """Numbers that are no pinhole camera's."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera without distortion: its images are rectified.

    A pixel (u, v) has its centre at whole numbers, as in OpenCV and sensor_msgs/CameraInfo. Depth is measured along the
    optical axis, as in depth images of ROS.

    Attributes:
        width: pixels.
        height: pixels.
        fx: focal length along a row, pixels.
        fy: focal length along a column, pixels.
        cx: principal point, pixels from the centre of the first column.
        cy: principal point, pixels from the centre of the first row.
        pose: transform (4, 4) of the optical frame (x right, y down, z ahead) in base_link.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    pose: NDArray[np.float64]

    @classmethod
    def from_info(cls, width: int, height: int, k: Sequence[float], pose: NDArray[np.float64]) -> Camera:
        """Return the camera of a sensor_msgs/CameraInfo.

        Args:
            width: pixels.
            height: pixels.
            k: the nine numbers of its matrix K, row by row.
            pose: transform (4, 4) of the optical frame in base_link.

        Raises:
            CameraError: a number is missing, not finite or not positive.
        """
        if len(k) != 9 or not np.isfinite(k).all() or min(width, height, k[0], k[4]) <= 0:
            raise CameraError(
                f"size {width} x {height} and K {list(k)} are no camera's: its driver has to publish a calibrated "
                "camera_info"
            )
        return cls(width, height, k[0], k[4], k[2], k[5], pose)

    @classmethod
    def with_field_of_view(cls, width: int, height: int, vertical: float, pose: NDArray[np.float64]) -> Camera:
        """Return the camera with square pixels that has a vertical field of view in rad."""
        focal = height / 2.0 / math.tan(vertical / 2.0)
        return cls(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0, pose)

    @cached_property
    def rays(self) -> NDArray[np.float64]:
        """The directions (height, width, 3) of all pixels in base_link, each 1 m long along the optical axis."""
        columns = (np.arange(self.width) - self.cx) / self.fx
        rows = (np.arange(self.height) - self.cy) / self.fy
        optical = np.ones((self.height, self.width, 3))
        optical[..., 0] = columns
        optical[..., 1] = rows[:, None]
        return optical @ self.pose[:3, :3].T

    @property
    def position(self) -> NDArray[np.float64]:
        """The optical centre (3,) in base_link."""
        return self.pose[:3, 3]

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the pixels (..., 2) of points (..., 3) of base_link, not a number for those behind the camera."""
        optical = (np.asarray(points, dtype=float) - self.position) @ self.pose[:3, :3]
        ahead = optical[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = optical[..., :2] / ahead[..., None] * (self.fx, self.fy) + (self.cx, self.cy)
        return np.where(ahead[..., None] > 0.0, pixels, np.nan)

    def back_project(self, pixels: ArrayLike, depth: ArrayLike) -> NDArray[np.float64]:
        """Return the points (..., 3) of base_link that pixels (..., 2) show at a depth (...) in m."""
        normed = (np.asarray(pixels, dtype=float) - (self.cx, self.cy)) / (self.fx, self.fy)
        optical = np.concatenate([normed, np.ones_like(normed[..., :1])], axis=-1) * np.asarray(depth)[..., None]
        return optical @ self.pose[:3, :3].T + self.position


def mounted(x: float, y: float, z: float, down: float) -> NDArray[np.float64]:
    """Return the pose (4, 4) of the optical frame of a camera at (x, y, z), m, that looks ahead and `down`, rad."""
    cos, sin = math.cos(down), math.sin(down)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]) @ _TOWARDS
    pose[:3, 3] = (x, y, z)
    return pose


MAST_CAMERA = Camera.with_field_of_view(640, 480, math.radians(60.0), mounted(0.05, 0.0, 1.5, math.radians(50.0)))
"""The camera of D1 on its mast, for what runs without a camera_info."""
