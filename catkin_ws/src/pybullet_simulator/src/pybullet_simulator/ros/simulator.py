"""Node simulator: steps the simulation, is the source of /clock, and offers the robot's topics and the ground truth."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rospy
from geometry_msgs.msg import Twist
from node_kit.io.inbox import Inbox
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from robot_formulas.geometry import Pose
from robot_formulas.power import PowerError
from simulator_msgs.srv import (
    DeleteObstacle,
    DeleteObstacleRequest,
    DeleteObstacleResponse,
    SetLight,
    SetLightRequest,
    SetLightResponse,
    SpawnObstacle,
    SpawnObstacleRequest,
    SpawnObstacleResponse,
)
from std_msgs.msg import Float32

from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.physics.pacing import Pacer
from pybullet_simulator.physics.simulation import STEP, Settings, Simulation, SimulationError
from pybullet_simulator.robot.motion_sensors import REAL, Errors
from pybullet_simulator.ros.output import Output
from pybullet_simulator.ros.window import PERIOD_STEPS, WindowView
from pybullet_simulator.world.obstacles import CLUTTER_MASS, CLUTTER_SIZE, ObstacleError
from pybullet_simulator.world.walking import SPEED, Walker
from pybullet_simulator.world.world import Box, WorldError

if TYPE_CHECKING:
    from collections.abc import Callable

ORIGIN = Pose(0.0, 0.0, 0.0)
_SERVICE_S = 10.0
"""Wall seconds that a service call waits for the loop."""


class SimulatorNode:
    """Owns the simulation; callbacks only leave their input for the loop, which runs in the main thread."""

    def __init__(self, default_world: Path | None = None, default_pose: Pose = ORIGIN) -> None:
        """Read the parameters, build the world and connect.

        Args:
            default_world: world file where parameter `~world` is empty or not set.
            default_pose: where parameters `~initial_pose_x` and so on are not set, map frame.

        Raises:
            ParameterError: a parameter cannot be used.
            WorldError: the world file is missing or wrong.
            SimulationError: the initial pose is not free, or PyBullet cannot start.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        factor = parameters.number("real_time_factor", 1.0, low=0.0, high=1000.0)
        world = read_world(_world_path(parameters, default_world))
        laser_steps, camera_steps = (_steps(parameters, name) for name in ("laser_rate", "camera_rate"))
        self._simulation = Simulation(world, _settings(parameters, default_pose))
        self._pacer = Pacer(STEP / factor if factor > 0.0 else 0.0)
        self._inbox = Inbox()
        self._output = Output(self._simulation, world, laser_steps, camera_steps)
        self._view = WindowView(self._simulation) if self._simulation.settings.gui else None
        self._inputs = (
            rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=10, tcp_nodelay=True),
            rospy.Subscriber("power_load", Float32, self._on_load, queue_size=1),
            rospy.Subscriber("power_consumption_factor", Float32, self._on_factor, queue_size=1),
        )
        self._services = (
            rospy.Service("~spawn_obstacle", SpawnObstacle, self._on_spawn),
            rospy.Service("~delete_obstacle", DeleteObstacle, self._on_delete),
            rospy.Service("~set_light", SetLight, self._on_set_light),
        )

    def run(self) -> None:
        """Step until the node is shut down."""
        step = 0
        while not rospy.is_shutdown():
            pause = self._pacer.wait(time.monotonic())
            # A pause of 0 lets the threads that receive and send have the interpreter when no pace is kept.
            time.sleep(pause)
            self._inbox.drain()
            self._simulation.step()
            step += 1
            self._output.publish(step)
            if self._view is not None and step % PERIOD_STEPS == 0:
                self._view.draw()

    def close(self) -> None:
        """Free the simulation."""
        self._simulation.close()

    # Input: called in rospy's threads, done in the loop's

    def _on_command(self, twist: Twist) -> None:
        values = (twist.linear.x, twist.linear.y, twist.angular.z)
        self._inbox.put(lambda: self._offer("cmd_vel", lambda: self._simulation.command(*values)))

    def _on_load(self, message: Float32) -> None:
        self._inbox.put(lambda: self._offer("power_load", lambda: self._simulation.set_power_load(message.data)))

    def _on_factor(self, message: Float32) -> None:
        topic, factor = "power_consumption_factor", message.data
        self._inbox.put(lambda: self._offer(topic, lambda: self._simulation.set_consumption_factor(factor)))

    def _offer(self, topic: str, take: Callable[[], None]) -> None:
        try:
            take()
        except (SimulationError, PowerError) as error:
            rospy.logwarn_throttle(10.0, f"{topic} ignored: {error}")

    def _on_spawn(self, request: SpawnObstacleRequest) -> SpawnObstacleResponse:
        if request.waypoints:
            walker = Walker(request.name, tuple((p.x, p.y) for p in request.waypoints), request.speed or SPEED)
            name, problem = self._in_loop(lambda: self._simulation.spawn_walker(walker))
        else:
            asked = (request.length, request.width, request.height)
            length, width, height = (given or usual for given, usual in zip(asked, CLUTTER_SIZE, strict=True))
            box = Box(request.name, "clutter", request.x, request.y, length, width, height, request.yaw)
            mass = max(request.mass or CLUTTER_MASS, 0.0)
            name, problem = self._in_loop(lambda: self._simulation.spawn(box, mass))
        if not problem:
            rospy.loginfo(f"spawned {name}")
        return SpawnObstacleResponse(not problem, name or "", problem)

    def _on_delete(self, request: DeleteObstacleRequest) -> DeleteObstacleResponse:
        _, problem = self._in_loop(lambda: self._simulation.obstacles.delete(request.name))
        return DeleteObstacleResponse(not problem, problem)

    def _on_set_light(self, request: SetLightRequest) -> SetLightResponse:
        _, problem = self._in_loop(lambda: self._simulation.set_light(request.light))
        if not problem:
            self._output.tell_light()
        return SetLightResponse(not problem, problem)

    def _in_loop(self, do: Callable[[], Any]) -> tuple[Any, str]:
        """Have something done between two steps; return its result and, where it was refused, why."""
        try:
            return self._inbox.call(do, _SERVICE_S), ""
        except (ObstacleError, SimulationError) as error:
            return None, str(error)
        except TimeoutError:
            return None, f"the simulation did not answer within {_SERVICE_S:g} s"


def _settings(parameters: ParameterTree, pose: Pose) -> Settings:
    """Return the simulation's settings from the node's parameters.

    Raises:
        ParameterError: one of them cannot be used.
    """
    errors = Errors(
        slip=parameters.number("slip", REAL.slip, low=0.0, high=0.1),
        odometry_drift=parameters.number("odometry_drift", REAL.odometry_drift, low=-0.5, high=0.5),
        imu=parameters.number("imu_noise", REAL.imu, low=0.0, high=10.0),
        gyro=parameters.number("gyro_noise", REAL.gyro, low=0.0, high=1.0),
        localisation=parameters.number("localisation_noise", REAL.localisation, low=0.0, high=10.0),
    )
    return Settings(
        Pose(
            parameters.number("initial_pose_x", pose.x),
            parameters.number("initial_pose_y", pose.y),
            parameters.number("initial_pose_a", pose.yaw),
        ),
        parameters.whole("seed", 0, low=0),
        errors,
        parameters.number("battery_charge", 1.0, low=0.0, high=1.0),
        parameters.flag("gui", False),
    )


def _steps(parameters: ParameterTree, name: str) -> int:
    """Return the steps between two messages of a device whose rate (Hz) is a parameter."""
    return round(1.0 / STEP / parameters.number(name, 10.0, low=1.0, high=50.0))


def _world_path(parameters: ParameterTree, default: Path | None) -> Path:
    """Return the path of the world file; empty stands for the default."""
    if default is not None and parameters.value("world", "") == "":
        return default
    return parameters.path("world")


def main(default_world: Path | None = None, default_pose: Pose = ORIGIN) -> None:
    """Run the node; exit status 2 when a parameter or the world cannot be used.

    Args:
        default_world: world file where parameter `~world` is empty or not set.
        default_pose: where parameters `~initial_pose_x` and so on are not set, map frame.
    """
    # The loop computes without a pause at real-time factor 0: threads that talk to other nodes get their turn sooner.
    sys.setswitchinterval(0.001)
    with Lifetime("simulator", ParameterError, WorldError, SimulationError) as life:
        life.start()
        node = SimulatorNode(default_world, default_pose)
        try:
            node.run()
        finally:
            node.close()
