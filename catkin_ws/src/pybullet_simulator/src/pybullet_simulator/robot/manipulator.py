"""The mobile manipulator: the base of `robot.robot` with two arms and an RGB-D camera on a mast. Frames are REP 103."""

from __future__ import annotations

import math
from dataclasses import dataclass

from robot_formulas.geometry import Pose

from pybullet_simulator.robot.robot import Robot

BASE = Robot(max_speed=0.3, max_turn_rate=0.5, max_acceleration=0.5, max_turn_acceleration=1.0)
"""The base drives slowly and softly, because of its arms: it would tip or shake with what they hold."""
HOME = Pose(-0.95, 0.0, 0.0)
"""Where the base stands at the start: 7 cm in front of the table (map frame)."""
ARM_MASS = 18.0
"""kg of an arm with its hand (Franka's data sheet)."""
MAX_WIDTH = 0.08
"""Opening of a gripper, m."""


@dataclass(frozen=True)
class ArmMount:
    """Where an arm's link0 stands in base_link, upright and facing forward: m.

    Attributes:
        home: Franka's ready position, turned aside at the shoulder: straight ahead, an arm would hide a tag from the
            camera. rad.
    """

    name: str
    x: float
    y: float
    z: float
    home: tuple[float, ...]


ARMS = (
    ArmMount("left", 0.25, 0.30, 0.30, (1.2, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)),
    ArmMount("right", 0.25, -0.30, 0.30, (-1.2, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)),
)


@dataclass(frozen=True)
class MastCamera:
    """An RGB-D camera that looks ahead and down; m, rad.

    Attributes:
        x: of the lens in base_link.
        y: of the lens in base_link.
        z: of the lens above the floor.
        pitch: by which it looks down.
        field_of_view: vertical.
        range_min: closest depth that it measures.
        range_max: farthest depth that it measures.
    """

    x: float = 0.05
    y: float = 0.0
    z: float = 1.5
    pitch: float = math.radians(50.0)
    width: int = 640
    height: int = 480
    field_of_view: float = math.radians(60.0)
    range_min: float = 0.3
    range_max: float = 3.0

    @property
    def focal_length(self) -> float:
        """Focal length in pixels, the same along both axes."""
        return self.height / 2.0 / math.tan(self.field_of_view / 2.0)

    @property
    def principal_point(self) -> tuple[float, float]:
        """Where the optical axis meets the image; the centre of the first pixel is (0, 0).

        PyBullet's TinyRenderer has it half a pixel right of and above the middle (measured by tags at known places).
        """
        return self.width / 2.0, self.height / 2.0 - 1.0


MAST_CAMERA = MastCamera()
