"""The simulated robot: a box-shaped, holonomic base in the manner of a Clearpath Ridgeback. Frames are REP 103."""

from __future__ import annotations

import math
from dataclasses import dataclass

from robot_formulas.geometry import Pose

from pybullet_simulator.world.world import Box


@dataclass(frozen=True)
class Mount:
    """Where a sensor sits, in base_link: m, m, m above the floor, rad."""

    frame: str
    x: float
    y: float
    z: float
    yaw: float = 0.0

    @property
    def pose(self) -> Pose:
        """Its pose in the plane of base_link."""
        return Pose(self.x, self.y, self.yaw)


@dataclass(frozen=True)
class Laser:
    """A planar laser scanner; the first ray points to -field_of_view / 2, seen from the mount.

    The defaults are those of a Hokuyo UST-10LX (270 deg, 0.06 to 10 m), thinned to 0.75 deg per ray.
    """

    mount: Mount
    field_of_view: float = math.radians(270.0)
    rays: int = 361
    range_min: float = 0.06
    range_max: float = 10.0

    @property
    def angle_min(self) -> float:
        """Direction of the first ray, rad."""
        return -self.field_of_view / 2.0

    @property
    def angle_increment(self) -> float:
        """Angle between two rays, rad."""
        return self.field_of_view / (self.rays - 1)


@dataclass(frozen=True)
class DepthCamera:
    """A depth camera that looks along its mount's x axis; horizontal field of view in rad, ranges in m.

    range_min is less than the distance from camera to bumper (0.06 m): what touches the bumper is still seen.
    """

    mount: Mount
    width: int = 160
    height: int = 120
    field_of_view: float = math.radians(60.0)
    range_min: float = 0.05
    range_max: float = 8.0

    @property
    def focal_length(self) -> float:
        """Focal length in pixels, the same along both axes."""
        return self.width / 2.0 / math.tan(self.field_of_view / 2.0)


@dataclass(frozen=True)
class Robot:
    """Dimensions, limits and sensors; m, kg, s, rad.

    The footprint and mass are the Ridgeback's, and so is the top speed (1.1 m/s, its data sheet). The acceleration
    limits are those that the published navigation assumes for it (acc_lim_x/y 6.0 m/s2, acc_lim_theta 20.0 rad/s2).
    The height of the lasers is that of the device (0.18 m).
    """

    length: float = 0.96
    width: float = 0.80
    ground_clearance: float = 0.05
    height: float = 0.30
    mass: float = 135.0
    max_speed: float = 1.1
    max_turn_rate: float = 2.0
    max_acceleration: float = 6.0
    max_turn_acceleration: float = 20.0
    command_timeout: float = 0.5
    front_laser: Laser = Laser(Mount("front_laser", 0.393, 0.0, 0.18))
    rear_laser: Laser = Laser(Mount("rear_laser", -0.393, 0.0, 0.18, math.pi))
    camera: DepthCamera = DepthCamera(Mount("camera_link", 0.42, 0.0, 0.50))

    def body(self, pose: Pose) -> Box:
        """Return the floor that it takes at a pose of base_link (map frame)."""
        return Box("robot", "robot", pose.x, pose.y, self.length, self.width, self.height, pose.yaw)
