"""A picture of the work cell from outside, of a state that was recorded. No physics: bodies are put where they were."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pybullet

from pybullet_simulator.io.manipulator_file import planar_manipulator_urdf
from pybullet_simulator.io.robot_file import JOINTS
from pybullet_simulator.physics.cell_bodies import CellBodies
from pybullet_simulator.physics.connection import connect, disconnect
from pybullet_simulator.physics.sliding_base import links_of, load_urdf

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from pybullet_simulator.world.cell import BodyPose, Vector3

_EYE, _MIDDLE = (0.55, 1.15, 1.35), (-0.42, 0.05, 0.5)
"""m in the map frame: from behind the table and from the robot's left, so that tags do not hide the pyramid."""
_FIELD_OF_VIEW = 50.0
_LAMP = (0.5, 0.6, 2.0)


@dataclass(frozen=True)
class CellState:
    """Where everything in the cell is, in the map frame.

    Attributes:
        base: x, y, yaw of base_link, m, m, rad.
        joints: positions by name as in joint_states, rad, fingers in m.
        blocks: pose of each.
        obstacles: name -> centre and edges, m.
    """

    base: tuple[float, float, float]
    joints: Mapping[str, float] = field(default_factory=dict)
    blocks: Mapping[str, BodyPose] = field(default_factory=dict)
    obstacles: Mapping[str, tuple[Vector3, Vector3]] = field(default_factory=dict)


def draw_cell(state: CellState, width: int = 840, height: int = 720) -> NDArray[np.uint8]:
    """Return a picture of the cell in full light, (height, width, 3) in sRGB.

    Raises:
        PhysicsError: PyBullet cannot start.
        RobotFileError: the robot's URDF cannot be used.
    """
    client = connect(gui=False)
    try:
        robot = load_urdf(planar_manipulator_urdf(), 0, client)
        links = links_of(robot, client)
        planar = dict(zip(JOINTS, state.base, strict=True))
        for name, value in (planar | dict(state.joints)).items():
            if name in links:
                pybullet.resetJointState(robot, links[name], value, physicsClientId=client)
        bodies = CellBodies(state.blocks, client, see_floor=True)
        for name, (centre, size) in state.obstacles.items():
            bodies.spawn(name, centre, size)
        _, _, colours, _, _ = pybullet.getCameraImage(
            width,
            height,
            pybullet.computeViewMatrix(_EYE, _MIDDLE, (0.0, 0.0, 1.0)),
            pybullet.computeProjectionMatrixFOV(_FIELD_OF_VIEW, width / height, 0.1, 20.0),
            lightDirection=_LAMP,
            shadow=1,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=client,
        )
    finally:
        disconnect(client)
    return np.asarray(colours, dtype=np.uint8).reshape(height, width, 4)[..., :3]
