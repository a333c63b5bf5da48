"""A robot's base in PyBullet: a body on two sliding joints and a turning one, driven by their velocity motors."""

from __future__ import annotations

import tempfile
from typing import TYPE_CHECKING

import pybullet
from robot_formulas.geometry import Pose, wrap

from pybullet_simulator.io.robot_file import JOINTS

if TYPE_CHECKING:
    from collections.abc import Mapping


def load_urdf(text: str, flags: int, client: int) -> int:
    """Return the body of a URDF, fixed to the world by its root."""
    with tempfile.NamedTemporaryFile("w", suffix=".urdf", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        return int(pybullet.loadURDF(file.name, useFixedBase=True, flags=flags, physicsClientId=client))


def links_of(body: int, client: int) -> Mapping[str, int]:
    """Return the numbers of a body's joints by their names; a joint and the link behind it have the same number."""
    links = range(pybullet.getNumJoints(body, physicsClientId=client))
    return {pybullet.getJointInfo(body, link, physicsClientId=client)[1].decode(): link for link in links}


class SlidingBase:
    """The planar joints of a body that `robot_file.put_on_planar_joints` made; poses are in the map frame."""

    def __init__(self, body: int, start: Pose, forces: tuple[float, float, float], client: int) -> None:
        """Put the base at its start.

        Args:
            body: PyBullet's number.
            start: pose of base_link.
            forces: of the motors, N, N, Nm.
            client: PyBullet's.
        """
        self._body = body
        self._forces = forces
        self._client = client
        links = links_of(body, client)
        self._joints = tuple(links[name] for name in JOINTS)
        for joint, value in zip(self._joints, (start.x, start.y, start.yaw), strict=True):
            pybullet.resetJointState(body, joint, value, physicsClientId=client)

    def drive(self, velocity_x: float, velocity_y: float, turn: float) -> None:
        """Let the motors aim at a velocity (map frame, m/s and rad/s)."""
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(velocity_x, velocity_y, turn),
            forces=self._forces,
            physicsClientId=self._client,
        )

    def motion(self) -> tuple[Pose, tuple[float, float, float]]:
        """Return pose and velocity (map frame, m/s and rad/s)."""
        slide_x, slide_y, turn = pybullet.getJointStates(self._body, self._joints, physicsClientId=self._client)
        return Pose(slide_x[0], slide_y[0], wrap(turn[0])), (slide_x[1], slide_y[1], turn[1])
