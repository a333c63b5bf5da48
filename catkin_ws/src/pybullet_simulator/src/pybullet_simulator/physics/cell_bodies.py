"""The things of the work cell in PyBullet: floor, table, tag boards, blocks, obstacles."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import pybullet

from pybullet_simulator.world.cell import (
    BLOCK_MASS,
    BLOCK_SIZE,
    BOARD_SIZE,
    BOARD_THICKNESS,
    FLOOR_SIZE,
    TABLE_SIZE,
    TAGS,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pybullet_simulator.world.cell import BodyPose, Quaternion, Tag, Vector3

OBSTACLE_MASS = 200.0
"""kg; more than an arm can push aside."""
_UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
_FLOOR = (0.45, 0.47, 0.45, 1.0)
_TABLE = (0.62, 0.64, 0.66, 1.0)
_BLOCK = (0.80, 0.62, 0.40, 1.0)
_OBSTACLE = (0.75, 0.15, 0.15, 1.0)
_BOARD = (0.30, 0.30, 0.30, 1.0)
_SPECK = 1e-4
_FRICTION = 0.7
"""Of every thing; two of them have a coefficient of 0.5, wood on wood."""
_SPINNING_FRICTION = 0.001


class CellBodies:
    """What is in the cell beside the robot. Bodies are PyBullet's numbers."""

    def __init__(self, blocks: Mapping[str, BodyPose], client: int, *, see_floor: bool) -> None:
        """Build blocks, tag boards, table and floor: what an earlier body hides is not shaded.

        Args:
            blocks: where they lie.
            client: PyBullet's.
            see_floor: draw the floor; it takes time in each image.
        """
        self._client = client
        self.blocks = {
            name: self._add(BLOCK_SIZE, position, quaternion, _BLOCK, BLOCK_MASS)
            for name, (position, quaternion) in blocks.items()
        }
        for tag in TAGS:
            self._add_tag(tag)
        self._add(TABLE_SIZE, (0.0, 0.0, TABLE_SIZE[2] / 2.0), _UPRIGHT, _TABLE)
        self._add(FLOOR_SIZE, (0.0, 0.0, -FLOOR_SIZE[2] / 2.0), _UPRIGHT, _FLOOR if see_floor else None)
        self.obstacles: dict[str, int] = {}

    def pose(self, body: int) -> BodyPose:
        """Return where a body is."""
        position, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        return position, quaternion

    def spawn(self, name: str, position: Vector3, size: Vector3) -> None:
        """Put an obstacle into the cell."""
        self.obstacles[name] = self._add(size, position, _UPRIGHT, _OBSTACLE, OBSTACLE_MASS)

    def delete(self, name: str) -> None:
        """Take an obstacle away."""
        pybullet.removeBody(self.obstacles.pop(name), physicsClientId=self._client)

    def _add(
        self,
        size: Vector3,
        position: Vector3,
        quaternion: Quaternion,
        colour: tuple[float, float, float, float] | None,
        mass: float = 0.0,
    ) -> int:
        """Add a box; without a colour it cannot be seen."""
        half = [edge / 2.0 for edge in size]
        client = self._client
        seen = half if colour else [_SPECK] * 3  # without a visual shape, PyBullet draws the other one
        body = pybullet.createMultiBody(
            mass,
            pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client),
            pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=seen, rgbaColor=colour, physicsClientId=client),
            position,
            quaternion,
            physicsClientId=client,
        )
        # Without anchors, the solver's small errors let a pyramid creep by 2 mm in a minute.
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=_FRICTION,
            spinningFriction=_SPINNING_FRICTION,
            frictionAnchor=1,
            physicsClientId=client,
        )
        return int(body)

    def _add_tag(self, tag: Tag) -> None:
        """Put a board up, and its picture on the board's face."""
        client = self._client
        half, depth = BOARD_SIZE / 2.0, BOARD_THICKNESS
        collision = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=(depth / 2.0, half, half),
            collisionFramePosition=(depth / 2.0, 0.0, 0.0),
            physicsClientId=client,
        )
        corners = ((half, half), (-half, half), (-half, -half), (half, -half))  # y, z of the face, from the upper left
        front = [(0.0, y, z) for y, z in corners]
        back = [(depth, y, z) for y, z in corners]
        face = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=front + back,
            indices=[0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7],
            uvs=[(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0), *[(0.01, 0.01)] * 4],  # the back is blank paper
            normals=[(-1.0, 0.0, 0.0)] * 4 + [(1.0, 0.0, 0.0)] * 4,
            rgbaColor=(1.0, 1.0, 1.0, 1.0),
            physicsClientId=client,
        )
        body = pybullet.createMultiBody(0.0, collision, face, tag.centre, tag.quaternion, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"tag_{tag.number}.png"
            cv2.imwrite(str(path), tag.picture())
            texture = pybullet.loadTexture(str(path), physicsClientId=client)
        pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)
