"""The part of the node simulator that publishes: the robot's topics, raw sensor data and the ground truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Illuminance, Image, Imu, LaserScan
from std_msgs.msg import Float32, Int32
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from pybullet_simulator.messages import sensors, state
from pybullet_simulator.messages.grid import occupancy_grid
from pybullet_simulator.physics.simulation import (
    ENERGY_STEPS,
    LIGHT_STEPS,
    LOCALISATION_STEPS,
    MOTION_STEPS,
    SAFETY_STEPS,
    STEP,
)
from pybullet_simulator.world.world import rasterise

if TYPE_CHECKING:
    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.world.world import World

WALKING_STEPS = 20
"""Steps between two messages with the places of people who walk."""


class Output:
    """Publishes what is due after each step."""

    def __init__(self, simulation: Simulation, world: World, laser_steps: int, camera_steps: int) -> None:
        """Connect, and publish the map.

        Args:
            simulation: is read only.
            world: of which the map is drawn.
            laser_steps: between two scans.
            camera_steps: between two images.
        """
        self._simulation = simulation
        self._laser_steps = laser_steps
        self._camera_steps = camera_steps
        self._contacts = -1
        self._changes = -1
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10, tcp_nodelay=True)
        self._odom = rospy.Publisher("odom", Odometry, queue_size=10, tcp_nodelay=True)
        self._filtered = rospy.Publisher("odometry/filtered", Odometry, queue_size=10, tcp_nodelay=True)
        self._imu = rospy.Publisher("imu/data", Imu, queue_size=20, tcp_nodelay=True)
        self._battery = rospy.Publisher("battery_state", BatteryState, queue_size=1)
        self._illuminance = rospy.Publisher("illuminance", Illuminance, queue_size=1)
        self._localised = rospy.Publisher("amcl_pose", PoseWithCovarianceStamped, queue_size=5, latch=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=20, tcp_nodelay=True)
        self._state = rospy.Publisher("ground_truth/state", Odometry, queue_size=10)
        self._safety = rospy.Publisher("ground_truth/safety", Float32, queue_size=10)
        self._energy = rospy.Publisher("ground_truth/energy", Float32, queue_size=10)
        self._contact_count = rospy.Publisher("ground_truth/contacts", Int32, queue_size=10, latch=True)
        self._obstacles = rospy.Publisher("ground_truth/obstacles", MarkerArray, queue_size=2, latch=True)
        self._front = rospy.Publisher("simulator/front_rays", LaserScan, queue_size=1, tcp_nodelay=True)
        self._rear = rospy.Publisher("simulator/rear_rays", LaserScan, queue_size=1, tcp_nodelay=True)
        self._depth = rospy.Publisher("simulator/depth", Image, queue_size=1, tcp_nodelay=True)
        self._light = rospy.Publisher("simulator/light", Float32, queue_size=1, latch=True)
        errors = self._simulation.settings.errors
        self._odometry_writer = state.OdometryWriter(state.ODOM, errors.slip)
        self._state_writer = state.OdometryWriter(state.MAP)
        self._imu_writer = state.ImuWriter(errors)
        self._transform_writer = state.TransformWriter()
        now = state.stamp(self._simulation.time_ns)
        self._map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._map.publish(occupancy_grid(rasterise(world), now))
        self.tell_light()

    def publish(self, step: int) -> None:
        """Publish what is due after a step, /clock first."""
        simulation = self._simulation
        now = state.stamp(simulation.time_ns)
        self._clock.publish(now)
        if step % MOTION_STEPS == 0:
            self._publish_motion(now)
        if simulation.contacts != self._contacts or step % ENERGY_STEPS == 0:
            self._report_contacts()
        self._publish_sensors(step, now)
        if step % SAFETY_STEPS == 0:
            self._safety.publish(simulation.safety)
        if step % LOCALISATION_STEPS == 0:
            deviation = simulation.settings.errors.localisation
            self._localised.publish(state.localised_pose(simulation.localised, deviation, now))
        if step % LIGHT_STEPS == 0:
            self._illuminance.publish(state.illuminance(simulation.illuminance, now))
        if step % ENERGY_STEPS == 0:
            self._energy.publish(simulation.energy)
            self._battery.publish(state.battery_state(simulation, now))
        obstacles = simulation.obstacles
        if obstacles.changes != self._changes or (obstacles.walking and step % WALKING_STEPS == 0):
            self._changes = obstacles.changes
            self._obstacles.publish(state.obstacle_markers(obstacles.shown(), now))

    def tell_light(self) -> None:
        """Publish the brightness."""
        self._light.publish(self._simulation.light)

    def _publish_motion(self, now: rospy.Time) -> None:
        """Publish what the robot measures of its motion, and what it truly is."""
        simulation = self._simulation
        odometry = simulation.odometry
        self._imu.publish(self._imu_writer.write(now, simulation))
        self._tf.publish(self._transform_writer.write(now, simulation.map_to_odom, odometry.filtered))
        self._odom.publish(self._odometry_writer.write(now, odometry.wheels, odometry.velocity))
        velocity = (*odometry.velocity[:2], odometry.turn_rate)
        self._filtered.publish(self._odometry_writer.write(now, odometry.filtered, velocity))
        self._state.publish(self._state_writer.write(now, simulation.pose, simulation.velocity))

    def _publish_sensors(self, step: int, now: rospy.Time) -> None:
        """Publish the raw data that are due and that somebody listens to."""
        robot = self._simulation.robot
        if step % self._laser_steps == 0:
            for publisher, laser in ((self._front, robot.front_laser), (self._rear, robot.rear_laser)):
                if publisher.get_num_connections() > 0:
                    ranges = self._simulation.scan(laser)
                    publisher.publish(sensors.laser_scan(laser, ranges, now, self._laser_steps * STEP))
        if step % self._camera_steps == 0 and self._depth.get_num_connections() > 0:
            image = self._simulation.depth_image()
            self._depth.publish(sensors.depth_image(robot.camera, image, now))

    def _report_contacts(self) -> None:
        """Publish the count of contacts, and say what was touched when it has grown."""
        contacts = self._simulation.contacts
        if contacts > max(self._contacts, 0):
            touched = ", ".join(self._simulation.touching())
            rospy.logwarn(f"contact {contacts}: the robot touches {touched or 'something'}")
        self._contacts = contacts
        self._contact_count.publish(contacts)
