"""A map unlike the factory, with routes of its own: turned, coarse, partly unknown."""

import math

import cv2
import numpy as np
import yaml
from robot_formulas.geometry import Pose

RESOLUTION = 0.1
ORIGIN = (-3.0, 12.0, 0.3)
ROWS, COLUMNS = 50, 90
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
"""Shades of map_server."""


def at(along, across, yaw=0.0):
    """The pose in the map frame that lies so many m along and across the map from its origin."""
    x, y, turn = ORIGIN
    cos, sin = math.cos(turn), math.sin(turn)
    return Pose(x + cos * along - sin * across, y + sin * along + cos * across, turn + yaw)


def write_office(folder):
    """Write office.yaml with office.pgm, a hall of 9 x 5 m, and tours.yaml; return the paths of the two YAML files.

    From its origin: a desk at 4.0 to 5.0 m along and 3.0 to 4.9 m across, nothing known beyond 7.5 m along and 3.5 m
    across. Route `aisle` leads along the middle of the free part; `desk`, `unknown` and `outside` end badly.
    """
    shades = np.full((ROWS, COLUMNS), FREE, dtype=np.uint8)
    shades[[0, -1], :] = shades[:, [0, -1]] = OCCUPIED
    shades[30:49, 40:50] = OCCUPIED
    shades[35:, 75:] = UNKNOWN
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / "office.pgm"), shades[::-1])
    world, routes = folder / "office.yaml", folder / "tours.yaml"
    about = {"image": "office.pgm", "resolution": RESOLUTION, "origin": list(ORIGIN), "negate": 0}
    world.write_text(yaml.safe_dump(about | {"occupied_thresh": 0.65, "free_thresh": 0.196}))
    ends = {"aisle": at(4.2, 1.5), "desk": at(4.5, 2.7), "unknown": at(7.9, 3.9), "outside": at(12.0, 1.0)}
    start = at(1.5, 1.5)
    tours = {name: {"start": _listed(start), "goal": _listed(goal)} for name, goal in ends.items()}
    routes.write_text(yaml.safe_dump({"routes": tours}))
    return world, routes


def _listed(pose):
    return [pose.x, pose.y, pose.yaw]
