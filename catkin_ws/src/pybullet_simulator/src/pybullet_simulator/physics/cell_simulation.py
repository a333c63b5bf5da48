"""The work cell's simulation: a mobile manipulator at a table with blocks in PyBullet, stepped at 200 Hz.

One seed gives one run: every source of chance is a generator seeded from it (see `robot.random_errors`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pybullet

from pybullet_simulator.io.manipulator_file import planar_manipulator_urdf
from pybullet_simulator.physics.arm import Arm, Contact
from pybullet_simulator.physics.cell_bodies import CellBodies
from pybullet_simulator.physics.connection import connect, disconnect, look_at
from pybullet_simulator.physics.mast_view import MastView
from pybullet_simulator.physics.physics import GRAVITY
from pybullet_simulator.physics.sliding_base import SlidingBase, links_of, load_urdf
from pybullet_simulator.robot.drive import Drive, turned
from pybullet_simulator.robot.laser_and_camera import DEPTH_NOISE, measure_depth
from pybullet_simulator.robot.manipulator import ARM_MASS, ARMS, BASE, HOME, MAST_CAMERA
from pybullet_simulator.robot.motion_sensors import REAL, Odometry, Slip
from pybullet_simulator.world.cell import scatter_blocks

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from pybullet_simulator.world.cell import BodyPose, Vector3

STEP_NS = 5_000_000
"""ns of simulated time per step: 200 Hz."""
STEP = STEP_NS / 1e9
"""s of simulated time per step."""
START_NS = 1_000_000_000
"""ns of simulated time before the first step; 0 would mean "no clock yet" to rospy."""
MOTION_STEPS = 4
"""Steps between two updates of odometry and slip: 50 Hz."""
_DEPTH_STREAM = 21
_WINDOW = (2.0, -50.0, -30.0, (-0.4, 0.0, 0.5))
"""From where the window shows the cell: from behind the robot and from its right."""
_GRIP = 0.5
"""Coefficient of friction of the wheels: with it they hold the base against its arms."""
_THINGS, _BASE, _FOOT, _LEFT, _RIGHT = 1 | 2, 4, 8, 16, 32
"""Groups: two links meet if the mask of each has the other's group. Things have PyBullet's own groups, 1 or 2."""


class CellError(ValueError):
    """The cell refuses a value."""


_CLEAR = 0.005
"""m between the robot and an obstacle that is put beside it."""


class CellSimulation:
    """A mobile manipulator in the work cell. Poses are in the map frame, which is the cell's.

    Attributes:
        time_ns: simulated time in ns.
        base_pose: true pose of base_link: x, y, yaw.
        base_velocity: true (forward, left, turn rate) in base_link, m/s, m/s, rad/s.
        odometry: pose by the wheels, with slip and drift; its frame begins where the robot started.
        arms: "left" and "right".
        light: brightness, 0 (dark) to 1 (well lit).
    """

    def __init__(self, seed: int = 0, *, gui: bool = False) -> None:
        """Build the cell; the seed draws where the blocks lie.

        Raises:
            PhysicsError: PyBullet cannot start.
            RobotFileError: the robot's URDF cannot be used.
        """
        self.client = connect(gui)
        client = self.client
        if gui:
            look_at(client, *_WINDOW)
        pybullet.setTimeStep(STEP, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, physicsClientId=client)
        self._robot = load_urdf(planar_manipulator_urdf(), pybullet.URDF_USE_SELF_COLLISION, client)
        self._bodies = CellBodies(scatter_blocks(seed), client, see_floor=gui)
        self._blocks = frozenset(self._bodies.blocks.values())
        self._view = MastView(MAST_CAMERA, client)
        links = links_of(self._robot, client)
        self._base = SlidingBase(self._robot, HOME, _base_forces(), client)
        self.arms: Mapping[str, Arm] = {mount.name: Arm(mount, self._robot, links, client) for mount in ARMS}
        self._separate(links)

        self.time_ns = START_NS
        self._steps = 0
        self._light = 1.0
        self._drive = Drive(BASE)
        self._slip = Slip(REAL.slip, seed)
        self._odometry = Odometry(REAL, seed)
        self._rng = np.random.default_rng([seed, _DEPTH_STREAM])
        self._pose = self._sampled = HOME
        self.base_velocity = (0.0, 0.0, 0.0)

    @property
    def time(self) -> float:
        """Simulated time in s."""
        return self.time_ns / 1e9

    @property
    def base_pose(self) -> tuple[float, float, float]:
        """True pose of base_link in the map frame: x, y, yaw in m, m, rad."""
        return self._pose.x, self._pose.y, self._pose.yaw

    @property
    def odometry(self) -> tuple[float, float, float]:
        """Pose of base_link by the wheels, in the frame where the robot started: x, y, yaw in m, m, rad."""
        wheels = self._odometry.wheels
        return wheels.x, wheels.y, wheels.yaw

    @property
    def blocks(self) -> Mapping[str, BodyPose]:
        """True poses of the blocks."""
        return {name: self._bodies.pose(body) for name, body in self._bodies.blocks.items()}

    @property
    def light(self) -> float:
        """Brightness, 0 (dark) to 1 (well lit)."""
        return self._light

    @light.setter
    def light(self, light: float) -> None:
        if not (math.isfinite(light) and 0.0 <= light <= 1.0):
            raise CellError(f"light {light} refused: it must be a number from 0 (dark) to 1 (well lit)")
        self._light = light

    def drive(self, forward: float, left: float, turn: float) -> None:
        """Take a velocity command in base_link (m/s, m/s, rad/s); after 0.5 s without one the base brakes.

        Raises:
            CellError: a component is not finite; the command is as if it had never come.
        """
        if not (math.isfinite(forward) and math.isfinite(left) and math.isfinite(turn)):
            raise CellError(f"velocity command ({forward}, {left}, {turn}) refused: it must be finite")
        self._drive.command(forward, left, turn, self.time_ns)

    def spawn(self, name: str, position: Vector3, size: Vector3) -> None:
        """Put an obstacle into the cell: a heavy box, by its centre and edges in m.

        Raises:
            CellError: the name is taken, a number makes no sense, or the robot is in its place.
        """
        if name in self._bodies.obstacles:
            raise CellError(f"obstacle {name!r} is there already; delete it, or choose another name")
        if not all(map(math.isfinite, (*position, *size))) or min(size) <= 0.0:
            raise CellError(f"obstacle {name!r} refused: it needs a finite position and a size above 0")
        self._bodies.spawn(name, position, size)
        body = self._bodies.obstacles[name]
        if pybullet.getClosestPoints(self._robot, body, _CLEAR, physicsClientId=self.client):
            self._bodies.delete(name)
            raise CellError(f"obstacle {name!r} refused: the robot is where it would be")

    def delete(self, name: str) -> None:
        """Take an obstacle away.

        Raises:
            CellError: there is none of that name.
        """
        if name not in self._bodies.obstacles:
            raise CellError(f"no obstacle {name!r}; there are {sorted(self._bodies.obstacles)}")
        self._bodies.delete(name)

    def step(self) -> None:
        """Advance by 5 ms of simulated time."""
        forward, left, turn = self._drive.advance(self.time_ns, STEP)
        grip = self._slip.factors
        self._base.drive(*turned(forward * grip[0], left * grip[1], self._pose.yaw), turn * grip[2])
        pybullet.stepSimulation(physicsClientId=self.client)
        self.time_ns += STEP_NS
        self._steps += 1
        self._pose, (velocity_x, velocity_y, turn) = self._base.motion()
        self.base_velocity = (*turned(velocity_x, velocity_y, -self._pose.yaw), turn)
        contacts = self._contacts()
        for arm in self.arms.values():
            arm.read(contacts, self._blocks)
        if self._steps % MOTION_STEPS == 0:
            moved = self._sampled.inverse() @ self._pose
            self._odometry.advance(moved, self.base_velocity, self._slip.factors, MOTION_STEPS * STEP)
            self._slip.advance(MOTION_STEPS * STEP)
            self._sampled = self._pose

    def look(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what the mast camera sees: light that falls on the sensor, and measured depth.

        The depth camera has an infrared lamp of its own: it needs no light.

        Returns:
            Linear light, (480, 640, 3) with 1 for white paper in full light, and depth along the optical axis,
            (480, 640) in m with noise, 0 where there is none.
        """
        light, depth = self._view.render(self._pose)
        within = (depth >= MAST_CAMERA.range_min) & (depth <= MAST_CAMERA.range_max)
        measured = measure_depth(np.where(within, depth, np.float32(0.0)), 1.0, DEPTH_NOISE, self._rng)
        return light * np.float32(self._light), np.where(within, measured, np.float32(0.0))

    def close(self) -> None:
        """Free PyBullet's world; the simulation cannot be used any more."""
        disconnect(self.client)

    def _contacts(self) -> list[Contact]:
        """Return where links of the robot press on something; a contact of two links counts for each."""
        contacts = []
        for point in pybullet.getContactPoints(self._robot, physicsClientId=self.client):
            body_a, body_b, link_a, link_b, force = point[1], point[2], point[3], point[4], point[9]
            if force > 0.0:
                contacts.append(Contact(link_a, body_b, link_b, force))
                if body_b == self._robot:
                    contacts.append(Contact(link_b, body_a, link_a, force))
        return contacts

    def _separate(self, links: Mapping[str, int]) -> None:
        """Let an arm meet things, the other arm and the base, but not itself: the limits of its joints prevent that.

        The feet of the arms, up to the elbow, touch the base always.
        """
        groups = dict.fromkeys((-1, *links.values()), (_BASE, _THINGS | _LEFT | _RIGHT))
        for own, other, arm in ((_LEFT, _RIGHT, self.arms["left"]), (_RIGHT, _LEFT, self.arms["right"])):
            arm.groups = (own, _THINGS | _BASE | _FOOT | other)
            groups |= dict.fromkeys(arm.links, arm.groups)
            groups |= dict.fromkeys(arm.feet, (_FOOT, _THINGS | other))
        for link, (group, mask) in groups.items():
            pybullet.setCollisionFilterGroupMask(self._robot, link, group, mask, physicsClientId=self.client)


def _base_forces() -> tuple[float, float, float]:
    """Return what the wheels can do before they slide: N, N, Nm."""
    push = _GRIP * (BASE.mass + len(ARMS) * ARM_MASS) * GRAVITY
    return push, push, push * math.hypot(BASE.length, BASE.width) / 2.0
