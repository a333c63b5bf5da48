"""ROS messages from the simulation's state. No rospy: these are plain conversions.

A writer keeps its message and sets only the fields that change. At 100 Hz this is much cheaper than a new message.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import genpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from robot_formulas.geometry import quaternion_of
from robot_formulas.power import BATTERY_CAPACITY_WH
from sensor_msgs.msg import BatteryState, Illuminance, Imu
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from pybullet_simulator.physics.physics import GRAVITY
from pybullet_simulator.robot.light_sensor import NOISE
from pybullet_simulator.robot.motion_sensors import vibration_variance

if TYPE_CHECKING:
    from collections.abc import Iterable

    import geometry_msgs.msg
    from robot_formulas.geometry import Pose

    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.robot.motion_sensors import Errors
    from pybullet_simulator.world.obstacles import Shown

MAP, ODOM, BASE, IMU = "map", "odom", "base_link", "imu_link"
_IMU_PERIOD = 0.02
"""s; its rate is 50 Hz."""
_SMALL = 1e-6
"""Variance of what the simulation knows exactly; 0 would mean "unknown"."""


def stamp(time_ns: int) -> genpy.Time:
    """Return ROS time."""
    return genpy.Time(time_ns // 1_000_000_000, time_ns % 1_000_000_000)


class OdometryWriter:
    """nav_msgs/Odometry with the velocity in base_link."""

    def __init__(self, frame: str, deviation: float = 0.0) -> None:
        """Prepare a message whose pose is in `frame`; `deviation` is that of the velocity, as a share of 1 m/s."""
        self._message = Odometry()
        self._message.header.frame_id = frame
        self._message.child_frame_id = BASE
        self._message.pose.covariance = _diagonal(_SMALL, 6)
        self._message.twist.covariance = _diagonal(max(deviation**2, _SMALL), 6)

    def write(self, now: genpy.Time, pose: Pose, velocity: tuple[float, float, float]) -> Odometry:
        """Return the message for a pose and a velocity (forward, left, turn rate)."""
        message = self._message
        message.header.stamp = now
        _set_pose(message.pose.pose, pose)
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = velocity
        return message


class ImuWriter:
    """sensor_msgs/Imu, its axes those of base_link: gravity upwards, as a device at rest reports it."""

    def __init__(self, errors: Errors) -> None:
        """Prepare the message."""
        self._message = Imu()
        self._message.header.frame_id = IMU
        self._message.orientation_covariance = _diagonal(_SMALL, 3)
        self._message.angular_velocity_covariance = _diagonal(max(errors.gyro**2, _SMALL), 3)
        # The vibration at 0.5 m/s, a usual speed.
        sideways = max(errors.imu**2, _SMALL)
        self._message.linear_acceleration_covariance = [
            vibration_variance(0.5, _IMU_PERIOD),
            *_diagonal(sideways, 3)[1:],
        ]
        self._message.linear_acceleration.z = GRAVITY

    def write(self, now: genpy.Time, simulation: Simulation) -> Imu:
        """Return the message for the last sample."""
        message = self._message
        message.header.stamp = now
        message.orientation.z, message.orientation.w = quaternion_of(simulation.odometry.filtered.yaw)
        message.angular_velocity.z = simulation.odometry.turn_rate
        message.linear_acceleration.x, message.linear_acceleration.y = simulation.acceleration
        return message


class TransformWriter:
    """tf2_msgs/TFMessage with map -> odom and odom -> base_link."""

    def __init__(self) -> None:
        """Prepare the message."""
        self._message = TFMessage([_transform(MAP, ODOM), _transform(ODOM, BASE)])

    def write(self, now: genpy.Time, map_to_odom: Pose, odometry: Pose) -> TFMessage:
        """Return the message for two poses."""
        for transform, pose in zip(self._message.transforms, (map_to_odom, odometry), strict=True):
            transform.header.stamp = now
            transform.transform.translation.x, transform.transform.translation.y = pose.x, pose.y
            transform.transform.rotation.z, transform.transform.rotation.w = quaternion_of(pose.yaw)
        return self._message


def localised_pose(pose: Pose, noise: float, now: genpy.Time) -> PoseWithCovarianceStamped:
    """Return a pose in the map, with the variances of the localisation's noise (standard deviation in m)."""
    message = PoseWithCovarianceStamped()
    message.header.stamp = now
    message.header.frame_id = MAP
    _set_pose(message.pose.pose, pose)
    variance = max(noise**2, _SMALL)
    message.pose.covariance = [*_diagonal(variance, 6)[:35], max(0.01 * variance, _SMALL)]
    return message


def illuminance(lux: float, now: genpy.Time) -> Illuminance:
    """Return what the light sensor measures, in lx, with its variance."""
    message = Illuminance()
    message.header.stamp = now
    message.header.frame_id = BASE
    message.illuminance = lux
    message.variance = max((NOISE * lux) ** 2, _SMALL)
    return message


def battery_state(simulation: Simulation, now: genpy.Time) -> BatteryState:
    """Return charge, voltage and current of the battery."""
    message = BatteryState()
    message.header.stamp = now
    message.header.frame_id = BASE
    battery = simulation.battery
    message.voltage, message.current = battery.voltage, battery.current(simulation.load)
    message.percentage = battery.charge
    message.design_capacity = message.capacity = BATTERY_CAPACITY_WH / 24.0
    message.charge = battery.charge * message.design_capacity
    message.temperature = math.nan
    message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    message.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_GOOD
    message.present = True
    return message


def obstacle_markers(shown: Iterable[Shown], now: genpy.Time) -> MarkerArray:
    """Return the obstacles that no map shows, after one marker that deletes all earlier ones."""
    markers = [Marker(action=Marker.DELETEALL)]
    for obstacle in shown:
        marker = Marker(ns=obstacle.name)
        marker.header.stamp, marker.header.frame_id = now, MAP
        marker.type = Marker.CYLINDER if obstacle.person else Marker.CUBE
        _set_pose(marker.pose, obstacle.pose)
        marker.pose.position.z = obstacle.size[2] / 2.0
        marker.scale.x, marker.scale.y, marker.scale.z = obstacle.size
        marker.color.r, marker.color.g, marker.color.b = (0.2, 0.6, 0.3) if obstacle.person else (0.75, 0.15, 0.15)
        marker.color.a = 0.9
        markers.append(marker)
    return MarkerArray(markers)


def _set_pose(target: geometry_msgs.msg.Pose, pose: Pose) -> None:
    target.position.x, target.position.y = pose.x, pose.y
    target.orientation.z, target.orientation.w = quaternion_of(pose.yaw)


def _transform(frame: str, child: str) -> TransformStamped:
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = frame, child
    transform.transform.rotation.w = 1.0
    return transform


@lru_cache(maxsize=16)
def _diagonal(value: float, size: int) -> tuple[float, ...]:
    """Return a row-major square matrix with one value on its diagonal."""
    return tuple(value if row == column else 0.0 for row in range(size) for column in range(size))
