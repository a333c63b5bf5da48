"""The simulation: a world and a robot in PyBullet, stepped at 100 Hz, with the robot's sensors and the ground truth.

One seed gives one run: the only sources of chance are two seeded generators (IMU vibration, localisation).
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pybullet
from rosgraph_monitor.quality import braking_distance, closest_in_direction, energy_level, safety_risk

from metacontrol_sim.geometry import ORIGIN, Pose, wrap
from metacontrol_sim.power import Battery, PowerMeter, check_factor
from metacontrol_sim.robot import Robot
from metacontrol_sim.world import MAPPED, box_mesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from metacontrol_sim.robot import Laser
    from metacontrol_sim.world import Box, World

STEP_NS = 10_000_000
"""ns of simulated time per step: 100 Hz."""
STEP = STEP_NS / 1e9
"""s of simulated time per step."""
START_NS = 1_000_000_000
"""ns of simulated time before the first step; 0 would mean "no clock yet" to rospy."""
LOCALISATION_STEPS = 20
SAFETY_STEPS = 10
ENERGY_STEPS = 100
"""Steps between two updates: localisation at 5 Hz, ground truth of safety at 10 Hz and of energy at 1 Hz."""
GRAVITY = 9.81
"""m/s2."""

VIBRATION = 10.8
"""Standard deviation of the IMU's forward acceleration in m/s2 per m/s of speed, at 100 Hz.

Derived from the published energies of the thirty variants of D2: solved for the acceleration peak per second, they give
25 to 28 m/s2 per m/s at the variants' top speeds, about 27 once slower stretches of a mission are allowed for. The
expected maximum of the 100 normal samples of a second is 2.5 standard deviations: 27 / 2.5 = 10.8.
"""
SAFETY_MIN_SPEED = 0.01
"""m/s; below it the robot counts as at rest, where nothing is a risk."""
CONTACT_PAUSE_STEPS = 50
"""Steps without touching (0.5 s) after which the next touch of the same body is a contact episode of its own."""

_WORLD_GROUP, _ROBOT_GROUP, _FLOOR_GROUP = 1, 2, 4
_JOINTS = (0, 1, 2)
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
_TRUTH_RAY_HEIGHT = 0.06
_TRUTH_ANGLES = np.radians(np.linspace(-90.0, 90.0, 181))
_NOISE_BLOCK = 1000
_BOXES_PER_MESH = 4000  # PyBullet takes no more than 131,072 vertices at once
_COLOURS = {
    "wall": (0.75, 0.75, 0.72, 1.0),
    "rack": (0.20, 0.35, 0.60, 1.0),
    "pillar": (0.55, 0.55, 0.55, 1.0),
    "pallet": (0.70, 0.50, 0.25, 1.0),
    "box": (0.80, 0.45, 0.15, 1.0),
}


class SimulationError(RuntimeError):
    """The simulation cannot start, or was given a value it refuses."""


@dataclass(frozen=True)
class Settings:
    """How a simulation starts and how good its sensors are.

    Attributes:
        initial_pose: of base_link in the map frame.
        seed: of every random number.
        localisation_noise: standard deviation of the localised position in m; the heading's is a tenth of it in rad.
        odometry_drift: error per distance travelled: scale of the distance and, per metre, heading in rad.
        gui: show PyBullet's window.
    """

    initial_pose: Pose = ORIGIN
    seed: int = 0
    localisation_noise: float = 0.0
    odometry_drift: float = 0.0
    gui: bool = False


class Simulation:
    """A robot in a world. Every attribute without an underscore is the state after the last step.

    Attributes:
        time_ns: simulated time in ns.
        pose: true pose of base_link in the map frame.
        velocity: true (forward, left, turn rate) in base_link, m/s, m/s, rad/s.
        acceleration: (forward, left) of the IMU in base_link, vibration included, m/s2.
        odometry: pose in the odom frame, which is the initial pose unless the odometry drifts.
        localised: pose in the map frame as the localisation has it.
        map_to_odom: pose of the odom frame in the map frame, as the localisation has it.
        contacts: contact episodes of the robot with anything but the floor, since the start.
        safety: ground truth of the safety risk, 0..1.
        energy: ground truth of the energy level, 0..1.
        battery: state of charge.
    """

    def __init__(self, world: World, settings: Settings | None = None, robot: Robot | None = None) -> None:
        """Build the world.

        Raises:
            SimulationError: the initial pose is off the floor or within an obstacle, or the window cannot open.
        """
        self.robot = robot or Robot()
        self.settings = settings or Settings()
        _check_initial_pose(world, self.settings.initial_pose, self.robot)
        self._client = _connect(self.settings.gui)
        self._names: dict[int, str] = {}
        self._build(world)

        self.time_ns = START_NS
        self.pose = self.settings.initial_pose
        self.velocity = (0.0, 0.0, 0.0)
        self.acceleration = (0.0, 0.0)
        self.odometry = Pose(0.0, 0.0, 0.0)
        self.localised = self.pose
        self.map_to_odom = self.pose
        self.contacts = 0
        self.safety = 0.0
        self.energy = 0.0
        self.battery = Battery()

        self._steps = 0
        self._initial_inverse = self.pose.inverse()
        self._target = (0.0, 0.0, 0.0)
        self._setpoint = (0.0, 0.0, 0.0)
        self._command_ns = -1
        self._world_velocity = (0.0, 0.0)
        self._last_touch: dict[int, int] = {}
        self._meter = PowerMeter(self.time)
        self._true_load = 0.0
        self._heard_load: float | None = None
        self._vibration_rng = np.random.default_rng([self.settings.seed, 1])
        self._localisation_rng = np.random.default_rng([self.settings.seed, 2])
        self._noise: list[float] = []
        self._rays = {laser.mount.frame: self._laser_rays(laser) for laser in self._lasers}

    @property
    def time(self) -> float:
        """Simulated time in s."""
        return self.time_ns / 1e9

    @property
    def load(self) -> float:
        """Power load that drains the battery: the one set from outside, else the true one."""
        return self._true_load if self._heard_load is None else self._heard_load

    def command(self, forward: float, left: float, turn: float) -> None:
        """Take a velocity command in base_link (m/s, m/s, rad/s); it holds for the robot's command time-out.

        Raises:
            SimulationError: a component is not finite; the command is as if it had never come.
        """
        if not (math.isfinite(forward) and math.isfinite(left) and math.isfinite(turn)):
            raise SimulationError(f"velocity command ({forward}, {left}, {turn}) is not finite")
        scale = min(1.0, self.robot.max_speed / max(math.hypot(forward, left), 1e-9))
        turn = min(max(turn, -self.robot.max_turn_rate), self.robot.max_turn_rate)
        self._target = (forward * scale, left * scale, turn)
        self._command_ns = self.time_ns
        self._meter.add_command()

    def set_consumption_factor(self, factor: float) -> None:
        """Multiply the true power load from now on.

        Raises:
            PowerError: the factor is negative or not finite.
        """
        self._meter.factor = check_factor(factor)

    def set_power_load(self, load: float) -> None:
        """Let a load (model's scale) drain the battery from now on.

        Raises:
            SimulationError: the load is negative or not finite.
        """
        if not math.isfinite(load) or load < 0.0:
            raise SimulationError(f"power load {load} refused: it must be a finite number, 0 or more")
        self._heard_load = load

    def step(self) -> None:
        """Advance by 10 ms of simulated time."""
        self._drive()
        pybullet.stepSimulation(physicsClientId=self._client)
        self.time_ns += STEP_NS
        self._steps += 1
        self._read_motion()
        self._count_contacts()
        if self._steps % LOCALISATION_STEPS == 0:
            self._localise()
        if self._steps % SAFETY_STEPS == 0:
            self.safety = self._safety_risk()
        if self._steps % ENERGY_STEPS == 0:
            self._true_load = self._meter.tick(self.time) or 0.0
            self.energy = energy_level(self._true_load)
            self.battery.drain(self.load, ENERGY_STEPS * STEP)

    def scan(self, laser: Laser) -> NDArray[np.float32]:
        """Return the true ranges of one of the robot's lasers: (rays,) in m, inf where nothing is hit."""
        origins, ends = self._rays[laser.mount.frame]
        hits = pybullet.rayTestBatch(
            origins,
            ends,
            parentObjectUniqueId=self._body,
            parentLinkIndex=_JOINTS[-1],
            collisionFilterMask=_WORLD_GROUP,
            physicsClientId=self._client,
        )
        fractions = np.array([hit[2] for hit in hits], dtype=np.float32)
        return np.where(fractions < 1.0, fractions * np.float32(laser.range_max), np.float32(np.inf))

    def depth_image(self) -> NDArray[np.float32]:
        """Return the camera's image: (height, width), m along the optical axis, inf beyond the camera's range."""
        camera = self.robot.camera
        eye = self.pose @ Pose(camera.mount.x, camera.mount.y, camera.mount.yaw)
        ahead = (eye.x + math.cos(eye.yaw), eye.y + math.sin(eye.yaw), camera.mount.z)
        vertical = 2.0 * math.degrees(math.atan(camera.height / 2.0 / camera.focal_length))
        near, far = camera.range_min, camera.range_max
        _, _, _, buffer, _ = pybullet.getCameraImage(
            camera.width,
            camera.height,
            pybullet.computeViewMatrix((eye.x, eye.y, camera.mount.z), ahead, (0.0, 0.0, 1.0)),
            pybullet.computeProjectionMatrixFOV(vertical, camera.width / camera.height, near, far),
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
        )
        buffer = np.asarray(buffer, dtype=np.float32).reshape(camera.height, camera.width)
        depth = far * near / (far - (far - near) * buffer)
        return np.where(buffer < 1.0, depth, np.float32(np.inf)).astype(np.float32)

    def add_obstacle(self, box: Box, mass: float = 0.0) -> int:
        """Put a box on the floor and return its PyBullet body.

        Args:
            box: what and where, in the map frame.
            mass: kg; 0 cannot be moved.
        """
        half = (box.length / 2.0, box.width / 2.0, box.height / 2.0)
        body = pybullet.createMultiBody(
            mass,
            pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client),
            pybullet.createVisualShape(
                pybullet.GEOM_BOX,
                halfExtents=half,
                rgbaColor=_COLOURS.get(box.kind, _COLOURS["box"]),
                physicsClientId=self._client,
            ),
            (box.x, box.y, box.height / 2.0),
            (0.0, 0.0, math.sin(box.yaw / 2.0), math.cos(box.yaw / 2.0)),
            physicsClientId=self._client,
        )
        self._join_world(body, box.name)
        return int(body)

    def touching(self) -> tuple[str, ...]:
        """Return the names of what the robot touched in the last step, sorted."""
        now = self._steps
        return tuple(sorted(self._names[body] for body, last in self._last_touch.items() if last == now))

    def close(self) -> None:
        """Free PyBullet's world; the simulation cannot be used any more."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)

    @property
    def _lasers(self) -> tuple[Laser, Laser]:
        return self.robot.front_laser, self.robot.rear_laser

    def _build(self, world: World) -> None:
        """Create floor, boxes and robot."""
        client = self._client
        pybullet.setTimeStep(STEP, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, physicsClientId=client)
        half = ((world.x_max - world.x_min) / 2.0 + 2.0, (world.y_max - world.y_min) / 2.0 + 2.0, 0.5)
        floor = pybullet.createMultiBody(
            0.0,
            pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client),
            pybullet.createVisualShape(
                pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(0.4, 0.42, 0.4, 1.0), physicsClientId=client
            ),
            ((world.x_max + world.x_min) / 2.0, (world.y_max + world.y_min) / 2.0, -0.5),
            physicsClientId=client,
        )
        pybullet.setCollisionFilterGroupMask(floor, -1, _FLOOR_GROUP, _WORLD_GROUP, physicsClientId=client)
        self._add_map([box for box in world.boxes if box.kind == MAPPED])
        for box in world.boxes:
            if box.kind != MAPPED:
                self.add_obstacle(box)
        self._body = self._build_robot()

    def _add_map(self, boxes: list[Box]) -> None:
        """Put the boxes of a map on the floor, thousands of them to a body: each as a body would slow every step."""
        for first in range(0, len(boxes), _BOXES_PER_MESH):
            part = boxes[first : first + _BOXES_PER_MESH]
            vertices, indices = box_mesh(part)
            mesh = {"vertices": vertices, "indices": indices, "physicsClientId": self._client}
            flag = pybullet.GEOM_FORCE_CONCAVE_TRIMESH
            body = pybullet.createMultiBody(
                0.0,
                pybullet.createCollisionShape(pybullet.GEOM_MESH, flags=flag, **mesh),
                pybullet.createVisualShape(pybullet.GEOM_MESH, rgbaColor=_COLOURS["wall"], **mesh),
                physicsClientId=self._client,
            )
            self._join_world(body, part[0].name)

    def _join_world(self, body: int, name: str) -> None:
        """Let a body be seen by rays and stand in the way of everything."""
        everything = _WORLD_GROUP | _ROBOT_GROUP | _FLOOR_GROUP
        pybullet.setCollisionFilterGroupMask(body, -1, _WORLD_GROUP, everything, physicsClientId=self._client)
        self._names[body] = name

    def _build_robot(self) -> int:
        """Create the robot: a box on two sliding joints and a turning one, driven by their velocity motors."""
        client, robot = self._client, self.robot
        thickness = robot.height - robot.ground_clearance
        self._link_height = robot.ground_clearance + thickness / 2.0
        half = (robot.length / 2.0, robot.width / 2.0, thickness / 2.0)
        collision = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(0.9, 0.75, 0.1, 1.0), physicsClientId=client
        )
        origin = [(0.0, 0.0, 0.0)] * 3
        rotation = [_NO_ROTATION] * 3
        slide, turn = pybullet.JOINT_PRISMATIC, pybullet.JOINT_REVOLUTE
        body = pybullet.createMultiBody(
            0.0,
            -1,
            -1,
            (0.0, 0.0, self._link_height),
            _NO_ROTATION,
            linkMasses=[1.0, 1.0, robot.mass],
            linkCollisionShapeIndices=[-1, -1, collision],
            linkVisualShapeIndices=[-1, -1, visual],
            linkPositions=origin,
            linkOrientations=rotation,
            linkInertialFramePositions=origin,
            linkInertialFrameOrientations=rotation,
            linkParentIndices=[0, 1, 2],
            linkJointTypes=[slide, slide, turn],
            linkJointAxis=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)],
            physicsClientId=client,
        )
        pybullet.setCollisionFilterGroupMask(body, _JOINTS[-1], _ROBOT_GROUP, _WORLD_GROUP, physicsClientId=client)
        start = self.settings.initial_pose
        for joint, value in zip(_JOINTS, (start.x, start.y, start.yaw), strict=True):
            pybullet.changeDynamics(
                body, joint, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, physicsClientId=client
            )
            pybullet.resetJointState(body, joint, value, physicsClientId=client)
        # Twice what the acceleration limits need: the motors follow, but are too weak to push through an obstacle.
        inertia = robot.mass * (robot.length**2 + robot.width**2) / 12.0
        push = 2.0 * robot.mass * robot.max_acceleration
        self._forces = (push, push, 2.0 * inertia * robot.max_turn_acceleration)
        return int(body)

    def _laser_rays(self, laser: Laser) -> tuple[list[tuple[float, float, float]], list[tuple[float, float, float]]]:
        """Return starts and ends of a laser's rays in the frame of the robot's body."""
        mount = laser.mount
        height = mount.z - self._link_height
        ends = []
        for index in range(laser.rays):
            angle = mount.yaw + laser.angle_min + index * laser.angle_increment
            x, y = mount.x + laser.range_max * math.cos(angle), mount.y + laser.range_max * math.sin(angle)
            ends.append((x, y, height))
        return [(mount.x, mount.y, height)] * laser.rays, ends

    def _drive(self) -> None:
        """Move the set point towards the command within the acceleration limits, and hand it to the motors."""
        robot = self.robot
        expired = self.time_ns - self._command_ns > robot.command_timeout * 1e9 or self._command_ns < 0
        target = (0.0, 0.0, 0.0) if expired else self._target
        forward, left, turn = self._setpoint
        if (forward, left, turn) != target:
            change_x, change_y = target[0] - forward, target[1] - left
            change = math.hypot(change_x, change_y)
            share = min(1.0, robot.max_acceleration * STEP / change) if change > 0.0 else 1.0
            limit = robot.max_turn_acceleration * STEP
            change_turn = min(max(target[2] - turn, -limit), limit)
            self._setpoint = (forward + share * change_x, left + share * change_y, turn + change_turn)
            forward, left, turn = self._setpoint
        cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        pybullet.setJointMotorControlArray(
            self._body,
            _JOINTS,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(cos * forward - sin * left, sin * forward + cos * left, turn),
            forces=self._forces,
            physicsClientId=self._client,
        )

    def _read_motion(self) -> None:
        """Take over pose and velocity, and derive odometry and IMU from them."""
        slide_x, slide_y, turn = pybullet.getJointStates(self._body, _JOINTS, physicsClientId=self._client)
        last = self.pose
        pose = Pose(slide_x[0], slide_y[0], wrap(turn[0]))
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        velocity_x, velocity_y = slide_x[1], slide_y[1]
        change_x, change_y = velocity_x - self._world_velocity[0], velocity_y - self._world_velocity[1]
        self._world_velocity = (velocity_x, velocity_y)
        self.pose = pose
        self.velocity = (cos * velocity_x + sin * velocity_y, cos * velocity_y - sin * velocity_x, turn[1])
        vibration = VIBRATION * math.hypot(velocity_x, velocity_y) * self._normal()
        forward = (cos * change_x + sin * change_y) / STEP + vibration
        self.acceleration = (forward, (cos * change_y - sin * change_x) / STEP)
        self._meter.add_speed(self.velocity[0])
        self._meter.add_acceleration(forward)
        drift = self.settings.odometry_drift
        if drift == 0.0:
            self.odometry = self._initial_inverse @ pose
        else:
            moved = last.inverse() @ pose
            heading = moved.yaw + drift * math.hypot(moved.x, moved.y)
            self.odometry = self.odometry @ Pose(moved.x * (1.0 + drift), moved.y * (1.0 + drift), heading)

    def _count_contacts(self) -> None:
        """Count the bodies that press on the robot now and have not done so for a while."""
        now = self._steps
        for point in pybullet.getContactPoints(self._body, physicsClientId=self._client):
            other, force = point[2], point[9]
            if force > 0.0:
                if now - self._last_touch.get(other, -CONTACT_PAUSE_STEPS - 1) > CONTACT_PAUSE_STEPS:
                    self.contacts += 1
                self._last_touch[other] = now

    def _localise(self) -> None:
        """Let the localisation find the pose, with its noise, and correct the odom frame by it."""
        pose, noise = self.pose, self.settings.localisation_noise
        if noise > 0.0:
            error_x, error_y, error_yaw = self._localisation_rng.standard_normal(3).tolist()
            pose = Pose(pose.x + noise * error_x, pose.y + noise * error_y, wrap(pose.yaw + 0.1 * noise * error_yaw))
        self.localised = pose
        self.map_to_odom = pose @ self.odometry.inverse()

    def _safety_risk(self) -> float:
        """Return the risk by the closest thing, seen from the front laser, within 90 degrees of the way it moves."""
        velocity_x, velocity_y = self._world_velocity
        speed = math.hypot(velocity_x, velocity_y)
        if speed <= SAFETY_MIN_SPEED:
            return 0.0
        d_break = braking_distance(speed)
        mount = self.robot.front_laser.mount
        sensor = self.pose @ Pose(mount.x, mount.y, 0.0)
        angles = _TRUTH_ANGLES + math.atan2(velocity_y, velocity_x)
        origins = np.tile((sensor.x, sensor.y, _TRUTH_RAY_HEIGHT), (angles.size, 1))
        ends = origins.copy()
        ends[:, 0] += d_break * np.cos(angles)
        ends[:, 1] += d_break * np.sin(angles)
        hits = pybullet.rayTestBatch(origins, ends, collisionFilterMask=_WORLD_GROUP, physicsClientId=self._client)
        fractions = np.array([hit[2] for hit in hits])
        distances = np.where(fractions < 1.0, fractions * d_break, np.inf)
        hit = np.isfinite(distances)
        x, y = distances[hit] * np.cos(_TRUTH_ANGLES[hit]), distances[hit] * np.sin(_TRUTH_ANGLES[hit])
        return safety_risk(closest_in_direction(x, y, 0.0), d_break)

    def _normal(self) -> float:
        """Return the next normal random number of the vibration; drawn in blocks, for speed."""
        if not self._noise:
            self._noise = self._vibration_rng.standard_normal(_NOISE_BLOCK).tolist()
        return self._noise.pop()


def _check_initial_pose(world: World, pose: Pose, robot: Robot) -> None:
    """Raise SimulationError where the robot would stand in an obstacle or off the floor."""
    where = f"initial pose ({pose.x:g}, {pose.y:g})"
    if not world.contains(pose.x, pose.y):
        raise SimulationError(
            f"{where} is off the floor of world {world.name!r} "
            f"({world.x_min:g}..{world.x_max:g}, {world.y_min:g}..{world.y_max:g}); choose one on it"
        )
    for x, y in _outline(pose, robot):
        box, distance = world.nearest(x, y)
        if box is not None and distance <= 0.0:
            raise SimulationError(f"{where} puts the robot into {box.name!r}; choose a free place")


def _outline(pose: Pose, robot: Robot) -> list[tuple[float, float]]:
    """Return points of the footprint in the map frame, centre included, 0.1 m apart or less."""
    across = np.linspace(-robot.width / 2.0, robot.width / 2.0, 9)
    along = np.linspace(-robot.length / 2.0, robot.length / 2.0, 11)
    placed = (pose @ Pose(float(x), float(y), 0.0) for x in along for y in across)
    return [(point.x, point.y) for point in placed]


def _connect(gui: bool) -> int:
    """Return a PyBullet client, with a window or without."""
    if gui:
        _check_display()
    client = int(pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT))
    if client < 0:
        raise SimulationError("PyBullet does not start; run without its window (gui:=false)")
    if gui:
        pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=client)
        pybullet.resetDebugVisualizerCamera(16.0, 0.0, -65.0, (0.0, 0.0, 0.0), physicsClientId=client)
    return client


def _check_display() -> None:
    """Raise SimulationError where no X display answers; PyBullet itself would end the process."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError as error:
        raise SimulationError("PyBullet's window needs libX11: ./mros setup --gui, or gui:=false") from error
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if not display:
        raise SimulationError("PyBullet's window needs a display, and none answers: set DISPLAY, or use gui:=false")
    x11.XCloseDisplay(ctypes.c_void_p(display))
