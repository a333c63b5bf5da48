"""What a depth camera sees of a table with cubes on it, by casting a ray through each pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from metacontrol_manipulation.pick_place.pyramid import SIDE, TABLE_HEIGHT

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from metacontrol_manipulation.perception.camera import Camera

TABLE_HALF = (0.4, 0.8)
"""m, half the table along x and y of the cell frame; its centre is the frame's origin."""


@dataclass(frozen=True, slots=True)
class Cube:
    """A cube that lies flat, in the cell frame.

    Attributes:
        x: m, its centre.
        y: m.
        z: m.
        yaw: rad; quarter turns look the same.
    """

    x: float
    y: float
    z: float
    yaw: float

    def footprint(self, half: float = SIDE / 2.0) -> NDArray[np.float64]:
        """Return the corners (4, 2) of the square with the half edge in m around its centre."""
        cos, sin = math.cos(self.yaw) * half, math.sin(self.yaw) * half
        corners = ((cos - sin, sin + cos), (-cos - sin, cos - sin), (sin - cos, -sin - cos), (cos + sin, sin - cos))
        return np.array(corners) + np.array((self.x, self.y))

    def corners(self) -> NDArray[np.float64]:
        """Return its corners (8, 3)."""
        square = self.footprint()
        return np.concatenate([np.column_stack((square, np.full(4, self.z + side * SIDE / 2.0))) for side in (-1, 1)])


@dataclass(frozen=True, eq=False)
class DepthView:
    """A depth image with the rays of its pixels in the cell frame.

    Attributes:
        depth: (height, width), m along the optical axis; not a number where nothing was measured.
        origin: the optical centre (3,).
        rays: (height, width, 3), each 1 m long along the optical axis.
        table: (height, width), the depth at which the ray meets the table, infinite where it misses it.
        camera: that took it.
        cell: pose of the cell frame in base_link.
    """

    depth: NDArray[np.float64]
    origin: NDArray[np.float64]
    rays: NDArray[np.float64]
    table: NDArray[np.float64]
    camera: Camera
    cell: Pose

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels (..., 2) of points (..., 3) of the cell frame."""
        flat = points.reshape(-1, 3)
        in_base = np.column_stack((self.cell.apply(flat[:, :2]), flat[:, 2]))
        return self.camera.project(in_base).reshape(*points.shape[:-1], 2)

    def window(self, cube: Cube, margin: int) -> tuple[slice, slice]:
        """Return the part of the image that shows a cube with so many pixels around; empty where it is out of sight."""
        pixels = self.project(cube.corners())
        if not np.isfinite(pixels).all():
            return slice(0, 0), slice(0, 0)
        height, width = self.depth.shape
        left, top = np.floor(pixels.min(axis=0)).astype(int) - margin
        right, bottom = np.ceil(pixels.max(axis=0)).astype(int) + 1 + margin
        return (
            slice(min(max(top, 0), height), min(max(bottom, 0), height)),
            slice(min(max(left, 0), width), min(max(right, 0), width)),
        )


def depth_view(depth: NDArray[np.float32], camera: Camera, cell: Pose) -> DepthView:
    """Return a depth image (m, 0 or not a number where nothing was measured) with its rays in the cell frame."""
    base = cell.inverse()
    turn = base.matrix()[:3, :3]
    origin = turn @ camera.position + (base.x, base.y, 0.0)
    rays = camera.rays @ turn.T
    measured = np.where(np.isfinite(depth) & (depth > 0.0), depth, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (TABLE_HEIGHT - origin[2]) / rays[..., 2]
        inside = np.abs(origin[0] + along * rays[..., 0]) <= TABLE_HALF[0]
        inside &= np.abs(origin[1] + along * rays[..., 1]) <= TABLE_HALF[1]
    return DepthView(measured, origin, rays, np.where(inside & (along > 0.0), along, np.inf), camera, cell)


def cube_depth(cube: Cube, origin: NDArray[np.float64], rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the depth (...) at which rays (..., 3) meet a cube, infinite for those that miss it."""
    half = SIDE / 2.0
    cos, sin = math.cos(cube.yaw), math.sin(cube.yaw)
    x, y, z = origin[0] - cube.x, origin[1] - cube.y, origin[2] - cube.z
    enter, leave = np.array(-np.inf), np.array(np.inf)
    axes = (
        (cos * x + sin * y, cos * rays[..., 0] + sin * rays[..., 1]),
        (cos * y - sin * x, cos * rays[..., 1] - sin * rays[..., 0]),
        (z, rays[..., 2]),
    )
    for start, along in axes:
        steep = np.where(np.abs(along) < 1e-9, 1e-9, along)
        middle, reach = -start / steep, half / np.abs(steep)
        enter = np.maximum(enter, middle - reach)
        leave = np.minimum(leave, middle + reach)
    return np.where((enter < leave) & (leave > 0.0), enter, np.inf)
