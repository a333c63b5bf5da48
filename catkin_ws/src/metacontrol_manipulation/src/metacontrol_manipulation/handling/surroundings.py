"""What is around an arm, in its own frame: the table, the robot's body, blocks and the other arm."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from arm_motion.scene import Box

from metacontrol_manipulation.pick_place.pyramid import SIDE, TABLE_HEIGHT

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pybullet_simulator.robot.manipulator import ArmMount
    from robot_formulas.geometry import Pose

TABLE_SIZE = (0.8, 1.6, TABLE_HEIGHT)
"""m; its centre is the origin of the cell frame."""
MAST = (0.06, 0.06, 1.5)
"""m; the mast of the camera stands on the middle of the base."""
_PLATE = (0.96, 0.80, 0.28)
_SLACK = 0.002
"""m by which blocks are taken to be smaller, so that one that touches its neighbour can be moved."""


@dataclass(frozen=True)
class BlockPose:
    """Where a block is or shall be, in the cell frame: m, its centre; rad."""

    x: float
    y: float
    z: float
    yaw: float = 0.0


class Surroundings:
    """What is around an arm when the robot stands at a known place."""

    def __init__(self, mount: ArmMount, cell: Pose) -> None:
        """Know where the arm is.

        Args:
            mount: where the arm stands on the robot.
            cell: pose of the cell frame in base_link.
        """
        self._mount, self._cell = mount, cell

    @property
    def along(self) -> float:
        """Direction of the cell's x axis in the arm's frame, rad: neighbours in the pyramid stand across it."""
        return self._cell.yaw

    def in_arm(self, place: BlockPose) -> tuple[tuple[float, float, float], float]:
        """Return position and yaw of a place in the arm's frame."""
        cos, sin = math.cos(self._cell.yaw), math.sin(self._cell.yaw)
        x = self._cell.x + cos * place.x - sin * place.y - self._mount.x
        y = self._cell.y + sin * place.x + cos * place.y - self._mount.y
        return (x, y, place.z - self._mount.z), self._cell.yaw + place.yaw

    def boxes(self, blocks: Iterable[BlockPose] = ()) -> list[Box]:
        """Return table, body of the robot, and blocks."""
        table = self._box(BlockPose(0.0, 0.0, TABLE_SIZE[2] / 2.0), TABLE_SIZE)
        body = self._in_base((0.0, 0.0, _PLATE[2] / 2.0), _PLATE)
        mast = self._in_base((0.0, 0.0, self._mount.z + MAST[2] / 2.0), MAST)
        return [table, body, mast, *(self._box(block, (SIDE - _SLACK,) * 3) for block in blocks)]

    def other_arm(self, other: ArmMount, joints: Sequence[float]) -> tuple[tuple[float, float, float], Sequence[float]]:
        """Return where the other arm stands, and its joints, as a scene takes them."""
        return (other.x - self._mount.x, other.y - self._mount.y, other.z - self._mount.z), joints

    def of_other(self, other: ArmMount, boxes: Iterable[Box]) -> list[Box]:
        """Return boxes of the other arm's frame in this arm's: both arms have the same orientation."""
        dx, dy, dz = self.other_arm(other, ())[0]
        return [
            replace(box, position=(box.position[0] + dx, box.position[1] + dy, box.position[2] + dz)) for box in boxes
        ]

    def _box(self, place: BlockPose, size: tuple[float, ...]) -> Box:
        position, yaw = self.in_arm(place)
        return Box(position, (size[0], size[1], size[2]), (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)))

    def _in_base(self, position: tuple[float, float, float], size: tuple[float, float, float]) -> Box:
        mount = self._mount
        return Box((position[0] - mount.x, position[1] - mount.y, position[2] - mount.z), size)
