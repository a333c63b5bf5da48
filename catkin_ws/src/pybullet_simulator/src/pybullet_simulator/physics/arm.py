"""One arm of the mobile manipulator in PyBullet: joint servos, gripper, and what its links feel."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pybullet

from pybullet_simulator.robot.manipulator import MAX_WIDTH

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from pybullet_simulator.robot.manipulator import ArmMount

JOINTS = 7
_STIFFNESS = 0.3
"""Share of a position error that a servo takes away in a step."""
_FORCE_STEPS = 4
"""Steps over which a force is averaged (20 ms): a single impulse of the solver is no measurement."""
_FINGER_FRICTION = 1.5
"""Of rubber pads; with a block's 0.7 a coefficient of about 1."""
_MIMIC_FORCE = 100.0
"""N by which the gripper's mechanics keep its two fingers symmetrical."""


class Contact(NamedTuple):
    """A point where one of the robot's links presses on something.

    Attributes:
        link: of the robot.
        body: the other, PyBullet's number.
        other_link: of the other body.
        force: N, along the normal.
    """

    link: int
    body: int
    other_link: int
    force: float


class _Limit(NamedTuple):
    lower: float
    upper: float
    effort: float
    velocity: float


class ArmError(ValueError):
    """A command makes no sense; the arm keeps the last one."""


class Arm:
    """Joint servos that hold the last targets, and a gripper with two coupled fingers.

    Attributes:
        names: of the seven joints, in the URDF.
        links: all of the arm, PyBullet's numbers.
        feet: those of them that stand on the base.
        positions: rad.
        velocities: rad/s.
        efforts: Nm, of the servos.
        gripper_width: m between the fingers.
        contact_force: N, see below.
        groups: of its links, and with which they meet.
    """

    def __init__(self, mount: ArmMount, body: int, links: Mapping[str, int], client: int) -> None:
        """Put the arm into its home configuration, the gripper open.

        Args:
            mount: which arm it is; its name is the prefix of its links.
            body: PyBullet's number of the robot.
            links: of the body, by their joints' names.
            client: PyBullet's.
        """
        self._body, self._client = body, client
        side, home = mount.name, mount.home
        own = {name.removeprefix(f"{side}_panda_"): link for name, link in links.items() if name.startswith(side)}
        self.names = tuple(f"{side}_panda_joint{number}" for number in range(1, JOINTS + 1))
        self.links = frozenset(own.values()) | {links[f"{side}_panda_link0"]}
        self._joints = [own[f"joint{number}"] for number in range(1, JOINTS + 1)]
        self.feet = frozenset((links[f"{side}_panda_link0"], *self._joints[:2]))
        self.fingers = (own["finger_joint1"], own["finger_joint2"])
        self._limits = [self._limit(joint) for joint in (*self._joints, *self.fingers)]
        self._forces: deque[float] = deque([0.0] * _FORCE_STEPS, _FORCE_STEPS)
        self.held: int | None = None
        self.groups = (1, 1)
        self._gripper_command: tuple[float, float] | None = None
        self._couple_fingers()
        for joint, position in zip(self._joints, home, strict=True):
            pybullet.resetJointState(body, joint, position, physicsClientId=client)
        for finger in self.fingers:
            pybullet.resetJointState(body, finger, MAX_WIDTH / 2.0, physicsClientId=client)
        self.command(home)
        self.command_gripper(MAX_WIDTH, self._limits[-1].effort)
        self.read(())

    @property
    def is_holding(self) -> bool:
        """Whether both fingers touch the same block."""
        return self.held is not None

    @property
    def contact_force(self) -> float:
        """N by which anything else presses on the arm's links and on a held block, averaged over 20 ms."""
        return sum(self._forces) / len(self._forces)

    def command(self, positions: Sequence[float]) -> None:
        """Set the targets of the joint servos in rad, held until the next ones; they are clipped to the limits.

        Raises:
            ArmError: the number of positions is not seven, or one is not finite.
        """
        if len(positions) != JOINTS or not all(math.isfinite(position) for position in positions):
            raise ArmError(f"joint targets {list(positions)} refused: they must be {JOINTS} finite numbers")
        for joint, limit, position in zip(self._joints, self._limits[:JOINTS], positions, strict=True):
            self._aim(joint, limit, position, limit.effort)

    def command_gripper(self, width: float, force: float) -> None:
        """Let the fingers move to a distance in m, or press on what is between them by a force in N.

        Raises:
            ArmError: a number is not finite, or the force is negative.
        """
        if not math.isfinite(width) or not math.isfinite(force) or force < 0.0:
            raise ArmError(f"gripper command ({width}, {force}) refused: it must be a finite width and force")
        if (width, force) != self._gripper_command:
            self._gripper_command = width, force
            self._forget_contacts()
        for finger, limit in zip(self.fingers, self._limits[JOINTS:], strict=True):
            self._aim(finger, limit, width / 2.0, min(force, limit.effort))

    def read(self, contacts: Iterable[Contact], blocks: frozenset[int] = frozenset()) -> None:
        """Take over the state after a step.

        Args:
            contacts: of all links of the robot.
            blocks: bodies that can be held.
        """
        joints = (*self._joints, *self.fingers)
        states = pybullet.getJointStates(self._body, joints, physicsClientId=self._client)
        self.positions: NDArray[np.float64] = np.array([state[0] for state in states[:JOINTS]])
        self.velocities: NDArray[np.float64] = np.array([state[1] for state in states[:JOINTS]])
        self.efforts: NDArray[np.float64] = np.array([state[3] for state in states[:JOINTS]])
        self.gripper_width = float(states[JOINTS][0] + states[JOINTS + 1][0])
        own = [contact for contact in contacts if contact.link in self.links]
        touched = [{contact.body for contact in own if contact.link == finger} & blocks for finger in self.fingers]
        self.held = min(touched[0] & touched[1], default=None)
        self._forces.append(sum(contact.force for contact in own if contact.body != self.held) + self._on_held())

    def _forget_contacts(self) -> None:
        """Let PyBullet find the fingers' contacts anew: whoever changes its groups has none.

        They are anchored, or a held block would creep out of them. But an anchored contact keeps its normal, in the
        world's frame, as long as it sticks: when the hand has turned, a finger that opens would take its block along.
        """
        for finger in self.fingers:
            pybullet.setCollisionFilterGroupMask(self._body, finger, *self.groups, physicsClientId=self._client)

    def _on_held(self) -> float:
        """Return the forces on a held block from anything but this arm, N."""
        if self.held is None:
            return 0.0
        points = pybullet.getContactPoints(self.held, physicsClientId=self._client)
        return sum(point[9] for point in points if point[2] != self._body or point[4] not in self.links)

    def _aim(self, joint: int, limit: _Limit, position: float, effort: float) -> None:
        pybullet.setJointMotorControl2(
            self._body,
            joint,
            pybullet.POSITION_CONTROL,
            targetPosition=min(max(position, limit.lower), limit.upper),
            force=effort,
            maxVelocity=limit.velocity,
            positionGain=_STIFFNESS,
            velocityGain=1.0,
            physicsClientId=self._client,
        )

    def _limit(self, joint: int) -> _Limit:
        info = pybullet.getJointInfo(self._body, joint, physicsClientId=self._client)
        return _Limit(*info[8:12])

    def _couple_fingers(self) -> None:
        """Let the fingers move as one, and grip well."""
        body, client = self._body, self._client
        gear = pybullet.createConstraint(
            body, self.fingers[0], body, self.fingers[1], pybullet.JOINT_GEAR, (1, 0, 0), (0, 0, 0), (0, 0, 0),
            physicsClientId=client,
        )  # fmt: skip
        pybullet.changeConstraint(gear, gearRatio=-1, erp=0.2, maxForce=_MIMIC_FORCE, physicsClientId=client)
        for finger in self.fingers:
            pybullet.changeDynamics(
                body, finger, lateralFriction=_FINGER_FRICTION, spinningFriction=0.01, physicsClientId=client
            )
