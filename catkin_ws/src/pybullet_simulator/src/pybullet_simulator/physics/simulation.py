"""The simulation: a world and a robot in PyBullet, stepped at 100 Hz, with the robot's sensors and the ground truth.

One seed gives one run: every source of chance is a generator seeded from it (see `robot.random_errors`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from robot_formulas.geometry import ORIGIN, Pose
from robot_formulas.power import BACKING_SPEED, Battery, PowerMeter, check_factor, energy_level
from robot_formulas.safety import braking_distance, closest_in_direction, safety_risk

from pybullet_simulator.io.robot_file import RobotFileError
from pybullet_simulator.physics.connection import PhysicsError
from pybullet_simulator.physics.physics import Physics
from pybullet_simulator.robot.drive import Drive, turned
from pybullet_simulator.robot.light_sensor import LightSensor
from pybullet_simulator.robot.motion_sensors import PERFECT, Errors, Imu, Localisation, Odometry, Slip
from pybullet_simulator.robot.robot import Robot
from pybullet_simulator.world.obstacles import Obstacles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pybullet_simulator.robot.robot import DepthCamera, Laser
    from pybullet_simulator.world.walking import Walker
    from pybullet_simulator.world.world import Box, World

STEP_NS = 10_000_000
"""ns of simulated time per step: 100 Hz."""
STEP = STEP_NS / 1e9
"""s of simulated time per step."""
START_NS = 1_000_000_000
"""ns of simulated time before the first step; 0 would mean "no clock yet" to rospy."""
MOTION_STEPS = 2
LOCALISATION_STEPS = 20
SAFETY_STEPS = 10
ENERGY_STEPS = 100
LIGHT_STEPS = 20
"""Steps between two updates: IMU, odometry and slip at 50 Hz, localisation and light sensor at 5 Hz, ground truth of
safety at 10 Hz and of energy at 1 Hz."""
SAFETY_MIN_SPEED = 0.01
"""m/s; below it the robot counts as at rest, where nothing is a risk."""
CONTACT_PAUSE_STEPS = 50
"""Steps without touching (0.5 s) after which the next touch of the same body is a contact episode of its own."""

_TRUTH_RAY_HEIGHT = 0.06
_TRUTH_ANGLES = np.radians(np.linspace(-90.0, 90.0, 181))


class SimulationError(RuntimeError):
    """The simulation cannot start, or was given a value it refuses."""


@dataclass(frozen=True)
class Settings:
    """How a simulation starts and how good its sensors are.

    Attributes:
        initial_pose: of base_link in the map frame.
        seed: of every random number.
        errors: of the sensors of motion; perfect ones by default.
        charge: of the battery at the start, 0..1.
        gui: show PyBullet's window.
    """

    initial_pose: Pose = ORIGIN
    seed: int = 0
    errors: Errors = PERFECT
    charge: float = 1.0
    gui: bool = False


class Simulation:
    """A robot in a world. Every attribute without an underscore is the state after the last step.

    Attributes:
        time_ns: simulated time in ns.
        pose: true pose of base_link in the map frame.
        velocity: true (forward, left, turn rate) in base_link, m/s, m/s, rad/s.
        acceleration: (forward, left) of the IMU in base_link, vibration included, m/s2.
        smooth_acceleration: true forward acceleration in base_link, without vibration, m/s2.
        odometry: what the wheels and the IMU's turn rate tell of the motion since the start.
        localised: pose in the map frame as the localisation has it.
        map_to_odom: pose of the odom frame in the map frame, as the localisation has it.
        contacts: contact episodes of the robot with anything but the floor, since the start.
        safety: ground truth of the safety risk, 0..1.
        energy: ground truth of the energy level, 0..1.
        battery: state of charge.
        obstacles: what no map shows.
        light: brightness, 1 is a well-lit hall, 0 the dark.
        illuminance: what the light sensor measures of it, lx.
    """

    def __init__(self, world: World, settings: Settings | None = None, robot: Robot | None = None) -> None:
        """Build the world.

        Raises:
            SimulationError: the initial pose is off the floor or within an obstacle, or PyBullet cannot start.
        """
        self.robot = robot or Robot()
        self.settings = settings or Settings()
        start, seed, errors = self.settings.initial_pose, self.settings.seed, self.settings.errors
        _check_initial_pose(world, start, self.robot)
        try:
            self.physics = Physics(world, self.robot, start, STEP, self.settings.gui)
        except (PhysicsError, RobotFileError) as error:
            raise SimulationError(str(error)) from error
        self._names = dict.fromkeys(self.physics.map_bodies, "map")
        self._names |= {self.physics.add_box(box): box.name for box in world.boxes if not box.mapped}
        self.obstacles = Obstacles(self.physics, world, self.robot)

        self.time_ns = START_NS
        self.pose = start
        self.velocity = (0.0, 0.0, 0.0)
        self.acceleration = (0.0, 0.0)
        self.smooth_acceleration = 0.0
        self.odometry = Odometry(errors, seed)
        self.localised = start
        self.map_to_odom = start
        self.contacts = 0
        self.safety = 0.0
        self.energy = 0.0
        self.battery = Battery(self.settings.charge)
        self.light = 1.0
        self._light_sensor = LightSensor(seed)
        self.illuminance = self._light_sensor.measure(self.light)

        self._steps = 0
        self._base = Drive(self.robot)
        self._world_velocity = (0.0, 0.0)
        self._measured = (start, (0.0, 0.0))  # pose and velocity (map frame) at the last sample of IMU and odometry
        self._last_touch: dict[int, int] = {}
        self._meter = PowerMeter(self.time)
        self._true_load = 0.0
        self._heard_load: float | None = None
        self._slip = Slip(errors.slip, seed)
        self._imu = Imu(errors.imu, seed)
        self._localisation = Localisation(errors.localisation, seed)
        self._rays = {
            laser.mount.frame: _ray_angles(laser) for laser in (self.robot.front_laser, self.robot.rear_laser)
        }

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
        self._base.command(forward, left, turn, self.time_ns)
        self._meter.add_command()

    def set_consumption_factor(self, factor: float) -> None:
        """Multiply the true power load from now on.

        Raises:
            PowerError: the factor is negative, not finite or far too large.
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

    def set_light(self, light: float) -> None:
        """Set the brightness.

        Raises:
            SimulationError: it is not within 0 and 1.
        """
        if not (math.isfinite(light) and 0.0 <= light <= 1.0):
            raise SimulationError(f"light {light} refused: it must be a number from 0 (dark) to 1 (well lit)")
        self.light = light

    def spawn(self, box: Box, mass: float = 0.0) -> str:
        """Put a box on the floor and return its name.

        Raises:
            ObstacleError: it cannot stand there.
        """
        return self.obstacles.spawn(box, mass, self.pose)

    def spawn_walker(self, walker: Walker) -> str:
        """Put a person on their way and return their name.

        Raises:
            ObstacleError: the way makes no sense.
        """
        return self.obstacles.spawn_walker(walker, self.pose)

    def step(self) -> None:
        """Advance by 10 ms of simulated time."""
        self._drive()
        if self.obstacles.walking:
            self.obstacles.advance(self.pose, STEP)
        self.physics.step()
        self.time_ns += STEP_NS
        self._steps += 1
        self._read_motion()
        self._count_contacts()
        if self._steps % MOTION_STEPS == 0:
            self._measure_motion()
        if self._steps % LOCALISATION_STEPS == 0:
            self._localise()
        if self._steps % LIGHT_STEPS == 0:
            self.illuminance = self._light_sensor.measure(self.light)
        if self._steps % SAFETY_STEPS == 0:
            self.safety = self._safety_risk()
        if self._steps % ENERGY_STEPS == 0:
            self._true_load = self._meter.tick(self.time) or 0.0
            self.energy = energy_level(self._true_load)
            self.battery.drain(self.load, ENERGY_STEPS * STEP)

    def scan(self, laser: Laser) -> NDArray[np.float32]:
        """Return the true ranges of one of the robot's lasers: (rays,) in m, inf where nothing is hit."""
        mount = self.pose @ laser.mount.pose
        distances = self.physics.sweep(mount, laser.mount.z, self._rays[laser.mount.frame] + mount.yaw, laser.range_max)
        return distances.astype(np.float32)

    def depth_image(self, camera: DepthCamera | None = None) -> NDArray[np.float32]:
        """Return the camera's image: (height, width), m along the optical axis, inf beyond the camera's range."""
        return self.physics.depth_image(camera or self.robot.camera, self.pose)

    def touching(self) -> tuple[str, ...]:
        """Return the sorted names of the bodies that the robot touched in the last step."""
        bodies = (body for body, last in self._last_touch.items() if last == self._steps)
        return tuple(sorted(self._names.get(body) or self.obstacles.name_of(body) or "something" for body in bodies))

    def close(self) -> None:
        """Free PyBullet's world; the simulation cannot be used any more."""
        self.physics.close()

    def _drive(self) -> None:
        """Give the motors the velocity of the wheels, changed by their slip."""
        wheels, grip = self._base.advance(self.time_ns, STEP), self._slip.factors
        forward, left = wheels[0] * grip[0], wheels[1] * grip[1]
        self.physics.base.drive(*turned(forward, left, self.pose.yaw), wheels[2] * grip[2])

    def _read_motion(self) -> None:
        """Take over pose and velocity."""
        self.pose, (velocity_x, velocity_y, turn) = self.physics.base.motion()
        self._world_velocity = (velocity_x, velocity_y)
        self.velocity = (*turned(velocity_x, velocity_y, -self.pose.yaw), turn)
        self._meter.add_speed(self.velocity[0])

    def _measure_motion(self) -> None:
        """Let IMU and odometry take their sample."""
        duration = MOTION_STEPS * STEP
        last_pose, (last_x, last_y) = self._measured
        velocity_x, velocity_y = self._world_velocity
        self._measured = (self.pose, self._world_velocity)
        change = turned(velocity_x - last_x, velocity_y - last_y, -self.pose.yaw)
        self.smooth_acceleration = change[0] / duration
        self.acceleration = self._imu.measure(change, math.hypot(velocity_x, velocity_y), duration)
        self._meter.add_acceleration(self.acceleration[0])
        self.odometry.advance(last_pose.inverse() @ self.pose, self.velocity, self._slip.factors, duration)
        self._slip.advance(duration)

    def _count_contacts(self) -> None:
        """Count the bodies that press on the robot now and have not done so for a while."""
        now = self._steps
        for body in self.physics.pressing():
            if now - self._last_touch.get(body, -CONTACT_PAUSE_STEPS - 1) > CONTACT_PAUSE_STEPS:
                self.contacts += 1
            self._last_touch[body] = now

    def _localise(self) -> None:
        """Let the localisation find the pose, with its error, and correct the odom frame by it."""
        self._localisation.advance(LOCALISATION_STEPS * STEP)
        self.localised = self._localisation.locate(self.pose)
        self.map_to_odom = self.localised @ self.odometry.filtered.inverse()

    def _safety_risk(self) -> float:
        """Return the risk from the closest obstacle within 90 deg of the motion, seen from the laser on its side.

        A robot that only backs off (`BACKING_SPEED`) is seen from the front laser, as the published observer sees it.
        """
        velocity_x, velocity_y = self._world_velocity
        speed = math.hypot(velocity_x, velocity_y)
        if speed <= SAFETY_MIN_SPEED:
            return 0.0
        d_break = braking_distance(speed)
        backwards = self.velocity[0] < -BACKING_SPEED
        mount = (self.robot.rear_laser if backwards else self.robot.front_laser).mount
        sensor = self.pose @ Pose(mount.x, mount.y, 0.0)
        if self.physics.is_empty(sensor, _TRUTH_RAY_HEIGHT, d_break):
            return 0.0
        angles = _TRUTH_ANGLES + math.atan2(velocity_y, velocity_x)
        distances = self.physics.sweep(sensor, _TRUTH_RAY_HEIGHT, angles, d_break)
        hit = np.isfinite(distances)
        x, y = distances[hit] * np.cos(_TRUTH_ANGLES[hit]), distances[hit] * np.sin(_TRUTH_ANGLES[hit])
        return safety_risk(closest_in_direction(x, y, 0.0), d_break)


def _ray_angles(laser: Laser) -> NDArray[np.float64]:
    """Return the directions of a laser's rays, seen from its mount, rad."""
    return np.linspace(laser.angle_min, -laser.angle_min, laser.rays)


def _check_initial_pose(world: World, pose: Pose, robot: Robot) -> None:
    """Raise SimulationError where the robot would stand in an obstacle or off the floor."""
    where = f"initial pose ({pose.x:g}, {pose.y:g})"
    if not world.contains(pose.x, pose.y):
        raise SimulationError(
            f"{where} is off the floor of world {world.name!r} "
            f"({world.x_min:g}..{world.x_max:g}, {world.y_min:g}..{world.y_max:g}); choose one on it"
        )
    if box := world.under(robot.body(pose)):
        raise SimulationError(f"{where} puts the robot into {box.name!r}; choose a free place")
