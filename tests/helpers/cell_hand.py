"""Scripted motions of the arms of a work cell: they know the true poses, and plan nothing."""

import math

import numpy as np
import pybullet
import pybullet_data
from pybullet_simulator.physics.cell_simulation import STEP
from pybullet_simulator.robot.manipulator import ARMS

MOUNTS = {mount.name: mount for mount in ARMS}
READY = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
ACROSS = math.pi / 2.0
"""Yaw of a hand whose fingers close along x."""
_TCP = 11
_EVERY = 4  # steps between two targets of a straight motion


class Kinematics:
    """A Panda of its own that shows which joints reach a pose, the hand pointing down."""

    def __init__(self):
        self.client = pybullet.connect(pybullet.DIRECT)
        path = pybullet_data.getDataPath() + "/franka_panda/panda.urdf"
        self.body = pybullet.loadURDF(path, useFixedBase=True, physicsClientId=self.client)

    def inverse(self, position, yaw, near):
        down = pybullet.getQuaternionFromEuler((math.pi, 0.0, yaw))
        joints = near
        for _ in range(20):
            for joint, angle in enumerate(joints):
                pybullet.resetJointState(self.body, joint, angle, physicsClientId=self.client)
            state = pybullet.getLinkState(self.body, _TCP, computeForwardKinematics=1, physicsClientId=self.client)
            if math.dist(state[4], position) < 2e-4 and abs(np.dot(state[5], down)) > 1.0 - 1e-6:
                return np.array(joints)
            joints = pybullet.calculateInverseKinematics(
                self.body, _TCP, position, down, maxNumIterations=100, residualThreshold=1e-6,
                physicsClientId=self.client,
            )[:7]  # fmt: skip
        raise AssertionError(f"no joints for {position}, {yaw}")

    def close(self):
        pybullet.disconnect(self.client)


class Hand:
    """One arm, moved step by step together with the cell.

    Attributes:
        forces: contact force after each step.
    """

    def __init__(self, cell, side, kinematics):
        self.cell, self.arm, self.kinematics = cell, cell.arms[side], kinematics
        self.mount = MOUNTS[side]
        self.forces = []
        self._joints = self.arm.positions.copy()
        self._place = None

    def wait(self, seconds):
        for _ in range(round(seconds / STEP)):
            self._step()

    def move_joints(self, joints, speed=1.2):
        start, joints = self._joints, np.array(joints)
        for share in _shares(np.abs(joints - start).max(), speed):
            self.arm.command(start + share * (joints - start))
            self._step()
        self._joints = joints

    def move_over(self, position, yaw):
        self.move_joints(self._inverse(position, yaw, READY))
        self._place = (np.array(position), yaw)

    def move_straight(self, position, speed=0.2):
        start, yaw = self._place
        for number, share in enumerate(_shares(math.dist(start, position), speed), start=1):
            if number % _EVERY == 0 or share == 1.0:
                self._joints = self._inverse(start + share * (position - start), yaw, self._joints)
                self.arm.command(self._joints)
            self._step()
        self._place = (np.array(position), yaw)

    def grip(self, width, force=15.0):
        self.arm.command_gripper(width, force)
        self.wait(0.4)

    def pick(self, name):
        position, (_, _, z, w) = self.cell.blocks[name]
        yaw = math.remainder(2.0 * math.atan2(z, w), math.pi / 2.0)
        self.grip(0.08)
        above = np.add(position, (0.0, 0.0, 0.12))
        self.move_over(above, yaw)
        self.move_straight(np.array(position))
        self.grip(0.0)
        self.move_straight(above)

    def put(self, position):
        above = np.add(position, (0.0, 0.0, 0.08))
        self.move_over(above, ACROSS)
        self.move_straight(np.add(position, (0.0, 0.0, 0.002)))
        self.wait(0.2)
        self.grip(0.08)
        self.move_straight(above)

    def _step(self):
        self.cell.step()
        self.forces.append(self.arm.contact_force)

    def _inverse(self, position, yaw, near):
        """Return the joints for a pose of the hand in the map frame, seen from where the base stands now."""
        x, y, turn = self.cell.base_pose
        cos, sin = math.cos(turn), math.sin(turn)
        ahead, left = position[0] - x, position[1] - y
        local = (
            cos * ahead + sin * left - self.mount.x,
            cos * left - sin * ahead - self.mount.y,
            position[2] - self.mount.z,
        )
        return self.kinematics.inverse(local, yaw - turn, near)


def _shares(way, speed):
    """Yield the shares of a way, step by step, that begins and ends softly; the mean speed is two thirds of the top."""
    steps = max(1, round(1.5 * way / speed / STEP))
    for number in range(1, steps + 1):
        share = number / steps
        yield share * share * (3.0 - 2.0 * share)
