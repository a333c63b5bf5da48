"""Node simulator: steps the simulation, is the source of /clock, and offers the robot's topics and the ground truth."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from typing import Any

import rospkg
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Image, Imu, LaserScan
from std_msgs.msg import Float32, Int32
from tf2_msgs.msg import TFMessage

from metacontrol_sim import messages, sensor_messages
from metacontrol_sim.geometry import Pose
from metacontrol_sim.pacing import Pacer
from metacontrol_sim.parameters import ParameterError, file_path, flag, number, seed
from metacontrol_sim.power import PowerError
from metacontrol_sim.simulation import (
    ENERGY_STEPS,
    LOCALISATION_STEPS,
    SAFETY_STEPS,
    STEP,
    Settings,
    Simulation,
    SimulationError,
)
from metacontrol_sim.world import World, WorldError, rasterise
from metacontrol_sim.world_file import read_world

MOTION_STEPS = 2
SENSOR_STEPS = 10
"""Steps between two messages: odometry, tf and true state at 50 Hz; rays and depth images at 10 Hz."""


class SimulatorNode:
    """Owns the simulation; callbacks only leave their input for the loop, which runs in the main thread."""

    def __init__(self) -> None:
        """Read the parameters, build the world and connect.

        Raises:
            ParameterError: a parameter cannot be used.
            WorldError: the world file is missing or wrong.
            SimulationError: the initial pose is not free, or the window cannot open.
        """
        factor = number(rospy.get_param("~real_time_factor", 1.0), "~real_time_factor", 0.0, 1000.0)
        settings = Settings(
            Pose(*(number(rospy.get_param(f"~initial_pose_{key}", 0.0), f"~initial_pose_{key}") for key in "xya")),
            seed(rospy.get_param("~seed", 0)),
            number(rospy.get_param("~localisation_noise", 0.0), "~localisation_noise", 0.0, 10.0),
            number(rospy.get_param("~odometry_drift", 0.0), "~odometry_drift", -0.5, 0.5),
            flag(rospy.get_param("~gui", False), "~gui"),
        )
        world = read_world(_world_path(rospy.get_param("~world", "")))
        self._simulation = Simulation(world, settings)
        self._pacer = Pacer(STEP / factor if factor > 0.0 else 0.0)
        self._contacts = -1
        self._lock = threading.Lock()
        self._command: list[tuple[float, float, float]] = []
        self._load: float | None = None
        self._factor: float | None = None
        self._advertise(world)
        self._inputs = (
            rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=10, tcp_nodelay=True),
            rospy.Subscriber("power_load", Float32, self._on_load, queue_size=1),
            rospy.Subscriber("power_consumption_factor", Float32, self._on_factor, queue_size=1),
        )

    def run(self) -> None:
        """Step until the node is shut down."""
        step = 0
        while not rospy.is_shutdown():
            pause = self._pacer.wait(time.monotonic())
            # A pause of 0 lets the threads that receive and send have the interpreter when no pace is kept.
            time.sleep(pause)
            self._take_input()
            self._simulation.step()
            step += 1
            self._publish(step)

    def close(self) -> None:
        """Free the simulation."""
        self._simulation.close()

    def _advertise(self, world: World) -> None:
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10, tcp_nodelay=True)
        self._odom = rospy.Publisher("odom", Odometry, queue_size=10, tcp_nodelay=True)
        self._filtered = rospy.Publisher("odometry/filtered", Odometry, queue_size=10, tcp_nodelay=True)
        self._imu = rospy.Publisher("imu/data", Imu, queue_size=20, tcp_nodelay=True)
        self._battery = rospy.Publisher("battery_state", BatteryState, queue_size=1)
        self._localised = rospy.Publisher("amcl_pose", PoseWithCovarianceStamped, queue_size=5, latch=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=20, tcp_nodelay=True)
        self._state = rospy.Publisher("ground_truth/state", Odometry, queue_size=10)
        self._safety = rospy.Publisher("ground_truth/safety", Float32, queue_size=10)
        self._energy = rospy.Publisher("ground_truth/energy", Float32, queue_size=10)
        self._contact_count = rospy.Publisher("ground_truth/contacts", Int32, queue_size=10, latch=True)
        self._front = rospy.Publisher("simulator/front_rays", LaserScan, queue_size=1, tcp_nodelay=True)
        self._rear = rospy.Publisher("simulator/rear_rays", LaserScan, queue_size=1, tcp_nodelay=True)
        self._depth = rospy.Publisher("simulator/depth", Image, queue_size=1, tcp_nodelay=True)
        self._odometry_writer = messages.OdometryWriter(messages.ODOM)
        self._state_writer = messages.OdometryWriter(messages.MAP)
        self._imu_writer = messages.ImuWriter()
        self._transform_writer = messages.TransformWriter()
        now = messages.stamp(self._simulation.time_ns)
        self._map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._map.publish(messages.occupancy_grid(rasterise(world), now))
        self._tf_static = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self._tf_static.publish(messages.static_transforms(self._simulation.robot, now))

    def _on_command(self, twist: Twist) -> None:
        with self._lock:
            self._command.append((twist.linear.x, twist.linear.y, twist.angular.z))

    def _on_load(self, message: Float32) -> None:
        with self._lock:
            self._load = message.data

    def _on_factor(self, message: Float32) -> None:
        with self._lock:
            self._factor = message.data

    def _take_input(self) -> None:
        """Hand what has come since the last step to the simulation, and warn of what it refuses."""
        with self._lock:
            commands, load, factor = self._command, self._load, self._factor
            self._command, self._load, self._factor = [], None, None
        for command in commands:
            self._offer("cmd_vel", self._simulation.command, *command)
        if load is not None:
            self._offer("power_load", self._simulation.set_power_load, load)
        if factor is not None:
            self._offer("power_consumption_factor", self._simulation.set_consumption_factor, factor)

    def _offer(self, topic: str, take: Any, *values: float) -> None:
        try:
            take(*values)
        except (SimulationError, PowerError) as error:
            rospy.logwarn_throttle(10.0, f"{topic} ignored: {error}")

    def _publish(self, step: int) -> None:
        """Publish what is due after a step, /clock first."""
        simulation = self._simulation
        now = messages.stamp(simulation.time_ns)
        self._clock.publish(now)
        self._imu.publish(self._imu_writer.write(now, simulation))
        if step % MOTION_STEPS == 0:
            self._tf.publish(self._transform_writer.write(now, simulation.map_to_odom, simulation.odometry))
            odometry = self._odometry_writer.write(now, simulation.odometry, simulation.velocity)
            self._odom.publish(odometry)
            self._filtered.publish(odometry)
            self._state.publish(self._state_writer.write(now, simulation.pose, simulation.velocity))
        if simulation.contacts != self._contacts or step % ENERGY_STEPS == 0:
            self._report_contacts()
        if step % SENSOR_STEPS == 0:
            self._publish_sensors(now)
        if step % SAFETY_STEPS == 0:
            self._safety.publish(simulation.safety)
        if step % LOCALISATION_STEPS == 0:
            noise = simulation.settings.localisation_noise
            self._localised.publish(messages.localised_pose(simulation.localised, noise, now))
        if step % ENERGY_STEPS == 0:
            self._energy.publish(simulation.energy)
            self._battery.publish(messages.battery_state(simulation, now))

    def _publish_sensors(self, now: rospy.Time) -> None:
        """Publish the raw data that somebody listens to."""
        robot = self._simulation.robot
        for publisher, laser in ((self._front, robot.front_laser), (self._rear, robot.rear_laser)):
            if publisher.get_num_connections() > 0:
                publisher.publish(sensor_messages.laser_scan(laser, self._simulation.scan(laser), now))
        if self._depth.get_num_connections() > 0:
            image = self._simulation.depth_image()
            self._depth.publish(sensor_messages.depth_image(robot.camera, image, now))

    def _report_contacts(self) -> None:
        """Publish the count of contacts, and say what was touched when it has grown."""
        contacts = self._simulation.contacts
        if contacts > max(self._contacts, 0):
            touched = ", ".join(self._simulation.touching())
            rospy.logwarn(f"contact {contacts}: the robot touches {touched or 'something'}")
        self._contacts = contacts
        self._contact_count.publish(contacts)


def _world_path(value: Any) -> Path:
    """Return the path of the world file; empty stands for the factory floor of this package."""
    if value == "":
        return Path(rospkg.RosPack().get_path("metacontrol_sim")) / "worlds" / "factory.yaml"
    return file_path(value, "~world")


def main() -> int:
    """Run the node and return its exit status."""
    # The loop computes without a pause at real-time factor 0: threads that talk to other nodes get their turn sooner.
    sys.setswitchinterval(0.001)
    rospy.init_node("simulator")
    try:
        node = SimulatorNode()
    except (ParameterError, WorldError, SimulationError) as error:
        rospy.logfatal(str(error))
        return 2
    try:
        node.run()
    except rospy.ROSException:
        # Topics close while the loop may be about to publish on one; only then is it no error.
        if not rospy.is_shutdown():
            raise
    finally:
        node.close()
    return 0
