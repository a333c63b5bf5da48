"""Images of the work cell of D1 by ray casting: depth of boxes, grey images of its tags, with noise. No physics."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from metacontrol_manipulation.perception.tags import corners_of
from robot_formulas.geometry import Pose
from scipy.spatial.transform import Rotation

HOME = Pose(0.95, 0.0, 0.0)
"""The cell in base_link while the base stands at home."""
TABLE_HEIGHT = 0.40
SIDE = 0.05


@dataclass(frozen=True)
class Box:
    """A box in the cell frame: centre and sizes in m, turn about the vertical and about its own axes in rad."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)

    @property
    def axes(self):
        return Rotation.from_euler("ZYX", (self.yaw, *self.tilt)).as_matrix()


def cube(x, y, yaw=0.0, layer=0):
    """A block on the table, or as many blocks higher."""
    return Box((x, y, TABLE_HEIGHT + SIDE * (layer + 0.5)), (SIDE, SIDE, SIDE), yaw)


TABLE = Box((0.0, 0.0, TABLE_HEIGHT / 2), (0.8, 1.6, TABLE_HEIGHT))
FLOOR = Box((0.0, 0.0, -0.05), (9.0, 9.0, 0.1))
BOARDS = tuple(Box((0.154, y, 0.466), (0.01, 0.2, 0.2), 0.0, (math.radians(45.0), 0.0)) for y in (0.6, -0.6))
CELL = (TABLE, FLOOR, *BOARDS)


def arm(shoulder, elbow, wrist, tip):
    """Return boxes that look like an arm: two links between points, a hand that hangs down, and two fingers."""
    above = (*tip[:2], tip[2] + 0.16)
    boxes = [_between(shoulder, elbow, 0.12), _between(elbow, wrist, 0.10), _between(wrist, above, 0.09)]
    x, y, z = tip
    hand = Box((x, y, z + 0.11), (0.06, 0.20, 0.07))
    fingers = [Box((x, y + side * 0.035, z + 0.035), (0.02, 0.012, 0.08)) for side in (1, -1)]
    return [*boxes, hand, *fingers]


def _between(start, end, thickness):
    start, end = np.array(start, dtype=float), np.array(end, dtype=float)
    along = end - start
    length = float(np.linalg.norm(along))
    yaw = math.atan2(along[1], along[0])
    pitch = -math.atan2(along[2], math.hypot(along[0], along[1]))
    return Box(tuple((start + end) / 2), (length, thickness, thickness), yaw, (pitch, 0.0))


def depth_image(camera, boxes, cell=HOME):
    """Return the depth (height, width) in m of boxes and the cell, 0 where nothing is within 3 m."""
    base = cell.matrix()
    origin, rays = camera.position, camera.rays
    depth = np.full((camera.height, camera.width), np.inf)
    for box in (*CELL, *boxes):
        axes = base[:3, :3] @ box.axes
        centre = base[:3, :3] @ box.centre + base[:3, 3]
        half = np.array(box.size) / 2
        corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half @ axes.T + centre
        pixels = camera.project(corners)
        low, high = np.array((0, 0)), np.array((camera.width, camera.height))
        if np.isfinite(pixels).all():
            low = np.clip(np.floor(pixels.min(0)).astype(int), 0, high)
            high = np.clip(np.ceil(pixels.max(0)).astype(int) + 1, 0, high)
        window = (slice(low[1], high[1]), slice(low[0], high[0]))
        start, directions = (origin - centre) @ axes, rays[window] @ axes
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (-half - start) / directions, (half - start) / directions
        enter, leave = np.minimum(first, second).max(-1), np.maximum(first, second).min(-1)
        hit = np.where((enter < leave) & (enter > 0), enter, np.inf)
        depth[window] = np.minimum(depth[window], hit)
    return np.where(depth < 3.0, depth, 0.0).astype(np.float32)


def noisy(depth, seed):
    """Return a depth image as a structured-light camera gives it: noise that grows with depth, mm steps, holes, and
    pixels between two surfaces at some edges."""
    rng = np.random.default_rng(seed)
    mean = cv2.blur(depth, (3, 3))
    edge = (np.abs(mean - depth) > 0.01) & (rng.random(depth.shape) < 0.25)
    mixed = np.where(edge, mean, depth)
    mixed = mixed + rng.normal(0.0, 0.001, depth.shape) + rng.normal(0.0, 0.001, depth.shape) * depth**2
    mixed = np.round(mixed, 3)
    holes = (rng.random(depth.shape) < 0.005) | (edge & (rng.random(depth.shape) < 0.2))
    return np.where((depth == 0) | holes, 0.0, mixed).astype(np.float32)


def tag_image(camera, cell=HOME, light=1.0, seed=0, tags=(0, 1), noise=3.0):
    """Return a grey 8-bit image of the tags on a grey floor, at a light of 0 to 1, with noise in steps of 1/255."""
    fine = 4
    image = np.full((camera.height * fine, camera.width * fine), 110, dtype=np.float32)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    for tag in tags:
        modules = 40
        picture = np.full((10 * modules, 10 * modules), 255, dtype=np.uint8)
        picture[modules:-modules, modules:-modules] = cv2.aruco.generateImageMarker(dictionary, tag, 8 * modules)
        square = corners_of(tag)
        outer = square.mean(0) + (square - square.mean(0)) * 10 / 8
        points = np.column_stack((cell.apply(outer[:, :2]), outer[:, 2]))
        pixels = (camera.project(points) + 0.5) * fine - 0.5
        size = 10 * modules
        texels = np.array([(0, 0), (size, 0), (size, size), (0, size)], dtype=np.float32) - 0.5
        to_image = cv2.getPerspectiveTransform(texels, pixels.astype(np.float32))
        shape = image.shape[::-1]
        painted = cv2.warpPerspective(picture, to_image, shape, flags=cv2.INTER_LINEAR).astype(np.float32)
        there = cv2.warpPerspective(np.ones_like(picture), to_image, shape, flags=cv2.INTER_NEAREST)
        image = np.where(there > 0, painted, image)
    small = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA) * light * 0.8
    small += np.random.default_rng(seed).normal(0.0, noise, small.shape)
    return np.clip(np.round(small), 0, 255).astype(np.uint8)
