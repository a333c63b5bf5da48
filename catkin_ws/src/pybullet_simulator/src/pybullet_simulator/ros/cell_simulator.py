"""Node simulator of the work cell: steps the simulation, is the source of /clock, offers the robot's raw data."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

import rospy
from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry
from node_kit.io.inbox import Inbox
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from robot_formulas.geometry import Pose
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Illuminance, Image
from simulator_msgs.msg import ArmCommand, ArmState
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
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from pybullet_simulator.io.robot_file import RobotFileError
from pybullet_simulator.messages import cell as messages
from pybullet_simulator.messages import state
from pybullet_simulator.physics.arm import ArmError
from pybullet_simulator.physics.cell_simulation import STEP, CellError, CellSimulation
from pybullet_simulator.physics.connection import PhysicsError
from pybullet_simulator.physics.pacing import Pacer
from pybullet_simulator.robot.light_sensor import LightSensor
from pybullet_simulator.robot.motion_sensors import REAL
from pybullet_simulator.world.cell import TABLE_SIZE

if TYPE_CHECKING:
    from collections.abc import Callable

    from pybullet_simulator.world.cell import Vector3

_CLOCK_STEPS, _STATE_STEPS, _SLOW_STEPS = 2, 4, 40
"""Steps between two messages: 100 Hz, 50 Hz and 5 Hz."""
_SERVICE_S = 10.0
"""Wall seconds that a service call waits for the loop."""
_OBSTACLE_SIZE = (0.06, 0.06, 0.5)
"""m, of an obstacle that is put into the cell without a size: a post that stops an arm."""


class CellSimulatorNode:
    """Owns the simulation; callbacks only leave their input for the loop, which runs in the main thread."""

    def __init__(self) -> None:
        """Read the parameters, build the cell and connect.

        Raises:
            ParameterError: a parameter cannot be used.
            PhysicsError: PyBullet cannot start.
            RobotFileError: the robot's URDF cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        factor = parameters.number("real_time_factor", 1.0, low=0.0, high=1000.0)
        rate = parameters.number("camera_rate", 5.0, low=1.0, high=30.0)
        seed = parameters.whole("seed", 0, low=0)
        light = parameters.number("light", 1.0, low=0.0, high=1.0)
        self._simulation = CellSimulation(seed, gui=parameters.flag("gui", False))
        self._simulation.light = light
        self._light_sensor = LightSensor(seed)
        self._pacer = Pacer(STEP / factor if factor > 0.0 else 0.0)
        self._camera_steps = round(1.0 / STEP / rate)
        self._obstacles: dict[str, tuple[Vector3, Vector3]] = {}
        self._inbox = Inbox()
        self._advertise()
        self._inputs = [
            rospy.Subscriber("cmd_vel", Twist, self._on_drive, queue_size=10, tcp_nodelay=True),
            *(
                rospy.Subscriber(
                    f"simulator/{name}_arm/command", ArmCommand, self._on_arm, name, queue_size=1, tcp_nodelay=True
                )
                for name in self._simulation.arms
            ),
        ]
        self._services = (
            rospy.Service("~spawn_obstacle", SpawnObstacle, self._on_spawn),
            rospy.Service("~delete_obstacle", DeleteObstacle, self._on_delete),
            rospy.Service("~set_light", SetLight, self._on_set_light),
        )
        self._light.publish(light)

    def run(self) -> None:
        """Step until the node is shut down."""
        step = 0
        while not rospy.is_shutdown():
            # A pause of 0 lets the threads that receive and send have the interpreter when no pace is kept.
            time.sleep(self._pacer.wait(time.monotonic()))
            self._inbox.drain()
            self._simulation.step()
            step += 1
            self._publish(step)

    def close(self) -> None:
        """Free the simulation."""
        self._simulation.close()

    # Output

    def _advertise(self) -> None:
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10, tcp_nodelay=True)
        self._odom = rospy.Publisher("odom", Odometry, queue_size=10, tcp_nodelay=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=20, tcp_nodelay=True)
        self._state = rospy.Publisher("ground_truth/state", Odometry, queue_size=10)
        self._blocks = rospy.Publisher("ground_truth/blocks", PoseArray, queue_size=10)
        self._markers = rospy.Publisher("ground_truth/cell", MarkerArray, queue_size=2, latch=True)
        self._illuminance = rospy.Publisher("illuminance", Illuminance, queue_size=1)
        self._light = rospy.Publisher("simulator/light", Float32, queue_size=1, latch=True)
        self._image = rospy.Publisher("simulator/image", Image, queue_size=1, tcp_nodelay=True)
        self._depth = rospy.Publisher("simulator/depth", Image, queue_size=1, tcp_nodelay=True)
        self._arms = {
            name: rospy.Publisher(f"simulator/{name}_arm/state", ArmState, queue_size=2, tcp_nodelay=True)
            for name in self._simulation.arms
        }
        self._odometry_writer = state.OdometryWriter(state.ODOM, REAL.slip)
        self._state_writer = state.OdometryWriter(state.MAP)
        self._transform_writer = state.TransformWriter()

    def _publish(self, step: int) -> None:
        """Publish what is due after a step, /clock first."""
        simulation = self._simulation
        now = state.stamp(simulation.time_ns)
        if step % _CLOCK_STEPS == 0:
            self._clock.publish(now)
        if step % _STATE_STEPS == 0:
            for name, arm in simulation.arms.items():
                self._arms[name].publish(messages.arm_state(arm, now))
            odometry, true = Pose(*simulation.odometry), Pose(*simulation.base_pose)
            self._odom.publish(self._odometry_writer.write(now, odometry, simulation.base_velocity))
            # The robot does not know where odom is on the map. Views need it, so the true place is shown.
            self._tf.publish(self._transform_writer.write(now, true @ odometry.inverse(), odometry))
            self._state.publish(self._state_writer.write(now, true, simulation.base_velocity))
        if step % _SLOW_STEPS == 0:
            self._illuminance.publish(state.illuminance(self._light_sensor.measure(simulation.light), now))
            blocks = simulation.blocks
            self._blocks.publish(messages.block_poses(blocks, now))
            shown = [(name, *box) for name, box in sorted(self._obstacles.items())]
            self._markers.publish(messages.cell_markers(blocks, shown, now))
        if step % self._camera_steps == 0 and self._image.get_num_connections() + self._depth.get_num_connections():
            light, depth = simulation.look()
            self._image.publish(messages.float_image(light, now))
            self._depth.publish(messages.float_image(depth, now))

    # Input: called in rospy's threads, done in the loop's

    def _on_drive(self, twist: Twist) -> None:
        values = (twist.linear.x, twist.linear.y, twist.angular.z)
        self._inbox.put(lambda: self._offer("cmd_vel", lambda: self._simulation.drive(*values)))

    def _on_arm(self, command: ArmCommand, name: str) -> None:
        def take() -> None:
            arm = self._simulation.arms[name]
            arm.command(command.positions)
            arm.command_gripper(command.gripper_width, command.gripper_force)

        self._inbox.put(lambda: self._offer(f"command of the {name} arm", take))

    def _offer(self, what: str, take: Callable[[], None]) -> None:
        try:
            take()
        except (CellError, ArmError) as error:
            rospy.logwarn_throttle(10.0, f"{what} ignored: {error}")

    def _on_spawn(self, request: SpawnObstacleRequest) -> SpawnObstacleResponse:
        if request.waypoints:
            return SpawnObstacleResponse(False, "", "nobody walks in a work cell: leave out the waypoints")
        usual = _OBSTACLE_SIZE
        size = request.length or usual[0], request.width or usual[1], request.height or usual[2]
        name = request.name or f"obstacle_{len(self._obstacles) + 1}"
        is_on_table = abs(request.x) <= TABLE_SIZE[0] / 2.0 and abs(request.y) <= TABLE_SIZE[1] / 2.0
        centre = (request.x, request.y, size[2] / 2.0 + (TABLE_SIZE[2] if is_on_table else 0.0))

        def spawn() -> None:
            self._simulation.spawn(name, centre, size)
            self._obstacles[name] = centre, size

        problem = self._in_loop(spawn)
        return SpawnObstacleResponse(not problem, "" if problem else name, problem)

    def _on_delete(self, request: DeleteObstacleRequest) -> DeleteObstacleResponse:
        def delete() -> None:
            for name in [request.name] if request.name else list(self._obstacles):
                self._simulation.delete(name)
                del self._obstacles[name]

        problem = self._in_loop(delete)
        return DeleteObstacleResponse(not problem, problem)

    def _on_set_light(self, request: SetLightRequest) -> SetLightResponse:
        def set_light() -> None:
            self._simulation.light = request.light

        problem = self._in_loop(set_light)
        if not problem:
            self._light.publish(request.light)
        return SetLightResponse(not problem, problem)

    def _in_loop(self, do: Callable[[], Any]) -> str:
        """Have something done between two steps; return why it was refused, or an empty text."""
        try:
            self._inbox.call(do, _SERVICE_S)
        except CellError as error:
            return str(error)
        except TimeoutError:
            return f"the simulation did not answer within {_SERVICE_S:g} s"
        return ""


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used or the cell cannot be built."""
    # The loop computes without a pause at real-time factor 0: threads that talk to other nodes get their turn sooner.
    sys.setswitchinterval(0.001)
    with Lifetime("simulator", ParameterError, PhysicsError, RobotFileError) as life:
        life.start()
        node = CellSimulatorNode()
        try:
            node.run()
        finally:
            node.close()
