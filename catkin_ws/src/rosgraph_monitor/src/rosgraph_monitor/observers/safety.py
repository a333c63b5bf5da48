"""Safety: the risk from the closest obstacle in the direction of motion, against the braking distance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from nav_msgs.msg import Odometry
from robot_formulas.safety import (
    BRAKING_GAIN,
    braking_distance,
    closest_in_direction,
    physical_braking_distance,
    safety_risk,
)
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

from rosgraph_monitor.observer import StaleInputError, TopicObserver, Topics
from rosgraph_monitor.observers.frames import StaticFrames

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus
    from numpy.typing import NDArray
    from ros_model.language.metamodel import RosSystem

ODOMETRY = "odometry/filtered"
SCAN = "front/scan"
REAR_SCAN = "rear/scan"
CLOUD = "camera/depth/points"
DISTANCE = "d_obstacle"
"""Names as they are published; settings change them."""
STATIC_FRAMES = "/tf_static"

AT_REST = 0.01
"""m/s; slower than this the robot counts as standing, and there is no direction of motion."""

_DEFAULTS: dict[str, Any] = {
    "base_frame": "base_link",
    "braking_gain": BRAKING_GAIN,  # 1/s
    "max_deceleration": 0.0,  # m/s2; positive: the physical formula in place of the published one
    "reaction_time": 0.0,  # s, of the physical formula
    "half_angle": math.pi / 2,  # rad
    "measured_from": "sensor",  # or centre
    "min_height": 0.05,  # m above the base frame: points of a cloud below are floor
    "max_height": 1.5,  # m: points above do not concern the robot
    "max_distance": 10.0,  # m, published where nothing is seen
    "odometry_topic": ODOMETRY,
    "scan_topic": SCAN,
    "rear_scan_topic": REAR_SCAN,
    "cloud_topic": CLOUD,
}
_DATA_TYPES = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}

Points = tuple["NDArray[np.float64]", "NDArray[np.float64]"]


class SafetyQualityObserver(TopicObserver):
    """Publishes `safety` (a risk) and the distance of the closest obstacle at 10 Hz.

    It reads the sensor with which the active configuration navigates: the one that a connection brings to a component,
    or that `observation_sources` name (`scan`, `rear_scan`, `point_cloud`). Where no configuration says so, the laser,
    and the point cloud when the laser is silent.
    """

    qa_name = "safety"
    max_age = 0.5
    defaults = _DEFAULTS

    def __init__(self, name: str = "SafetyQualityObserver") -> None:
        super().__init__(name, 10.0, [])
        self._frames = StaticFrames()
        self._chosen: str | None = None
        self._need_cloud = False
        self._distance = math.inf

    @property
    def topics(self) -> Topics:
        """Odometry, fixed frames, and the sensors in use: a camera may only work while somebody listens."""
        scan, rear, cloud = self._sensor_topics
        topics: Topics = [(self.settings["odometry_topic"], Odometry), (STATIC_FRAMES, TFMessage)]
        if self._chosen in (None, scan):
            topics.append((scan, LaserScan))
        if self._chosen == rear:
            topics.append((rear, LaserScan))
        if self._chosen == cloud or self._need_cloud:
            topics.append((cloud, PointCloud2))
        return topics

    @property
    def outputs(self) -> Topics:
        """Distance of the closest obstacle in the direction of motion in m."""
        return [(DISTANCE, Float32)]

    def follow(self, system: RosSystem | None) -> None:
        """Choose the sensor with which the active system navigates."""
        self._chosen = None if system is None else navigation_sensor(system, *self._sensor_topics)
        self._need_cloud = False

    def receive(self, topic: str, msg: Any, now: float) -> None:
        """Keep the message; fixed frames add up."""
        if topic == STATIC_FRAMES:
            self._frames.add(msg)
        else:
            super().receive(topic, msg, now)

    def take_outputs(self) -> list[tuple[str, Any]]:
        """Return the distance: the sensor's range if nothing is seen; no message while the distance is unknown."""
        if math.isnan(self._distance):
            return []
        return [(DISTANCE, Float32(min(self._distance, self.settings["max_distance"])))]

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:
        """Return the risk."""
        self._distance = math.nan
        twist = self.latest(self.settings["odometry_topic"], now).twist.twist.linear
        if not (math.isfinite(twist.x) and math.isfinite(twist.y)):
            raise StaleInputError(f"velocity on {self.settings['odometry_topic']} is not finite")
        speed = math.hypot(twist.x, twist.y)
        moving = speed > AT_REST
        direction = math.atan2(twist.y, twist.x) if moving else 0.0
        x, y = self._obstacles(now)
        self._distance = closest_in_direction(x, y, direction, self.settings["half_angle"])
        return [self.qa_status(safety_risk(self._distance, self._braking(speed)) if moving else 0.0)]

    @property
    def _sensor_topics(self) -> tuple[str, str, str]:
        """Topics of the laser, of the one that looks back, and of the point cloud."""
        return self.settings["scan_topic"], self.settings["rear_scan_topic"], self.settings["cloud_topic"]

    def _braking(self, speed: float) -> float:
        if self.settings["max_deceleration"] > 0.0:
            return physical_braking_distance(speed, self.settings["max_deceleration"], self.settings["reaction_time"])
        return braking_distance(speed, self.settings["braking_gain"])

    def _obstacles(self, now: float) -> Points:
        """Return obstacle points in the base's orientation, relative to the sensor or the centre."""
        scan_topic, rear_scan_topic, cloud_topic = self._sensor_topics
        if self._chosen == cloud_topic:
            return self._from_cloud(self.latest(cloud_topic, now))
        if self._chosen == rear_scan_topic:
            return self._from_rear_scan(self.latest(rear_scan_topic, now))
        try:
            scan = self.latest(scan_topic, now)
        except StaleInputError as silent:
            if self._chosen == scan_topic:
                raise
            self._need_cloud = True
            try:
                return self._from_cloud(self.latest(cloud_topic, now))
            except StaleInputError as too:
                raise StaleInputError(f"{silent}; {too}") from too
        return self._from_scan(scan)

    def _from_scan(self, scan: LaserScan) -> Points:
        x, y = scan_points(scan)
        matrix = self._frames.transform(scan.header.frame_id, self.settings["base_frame"])
        if matrix is None:
            return x, y  # as published: the laser looks along the base's x
        px, py, _ = _moved(matrix, x, y, np.zeros_like(x))
        return self._from_origin(matrix, px, py)

    def _from_rear_scan(self, scan: LaserScan) -> Points:
        if self._frames.transform(scan.header.frame_id, self.settings["base_frame"]) is None:
            raise StaleInputError(f"no fixed transform from {scan.header.frame_id} to {self.settings['base_frame']}")
        return self._from_scan(scan)

    def _from_cloud(self, cloud: PointCloud2) -> Points:
        matrix = self._frames.transform(cloud.header.frame_id, self.settings["base_frame"])
        if matrix is None:
            raise StaleInputError(f"no fixed transform from {cloud.header.frame_id} to {self.settings['base_frame']}")
        x, y, z = _moved(matrix, *cloud_points(cloud))
        kept = (z >= self.settings["min_height"]) & (z <= self.settings["max_height"])
        return self._from_origin(matrix, x[kept], y[kept])

    def _from_origin(self, matrix: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> Points:
        if self.settings["measured_from"] == "centre":
            return x, y
        return x - matrix[0, 3], y - matrix[1, 3]


def navigation_sensor(
    system: RosSystem, scan_topic: str = SCAN, rear_scan_topic: str = REAR_SCAN, cloud_topic: str = CLOUD
) -> str | None:
    """Return the topic of the sensor with which a system navigates, or None if the model does not say.

    `observation_sources` decide, because costmaps read them; without them, a connection with the topic's name decides.
    """
    sources = {
        word
        for component in system.components
        for parameter in component.parameters
        if parameter.key.rpartition("/")[2] == "observation_sources" and isinstance(parameter.value, str)
        for word in parameter.value.split()
    }
    wired = {connection.name.strip("/") for connection in system.connections}
    sensors = {"scan": scan_topic, "rear_scan": rear_scan_topic, "point_cloud": cloud_topic}
    for source, topic in sensors.items():
        if source in sources or (not sources and topic.strip("/") in wired):
            return topic
    return None


def scan_points(scan: LaserScan) -> Points:
    """Return the returns of a scan as x and y in m in the frame of the laser.

    By REP 117, inf is no return, NaN is no measurement, and -inf is a return closer than `range_min`: it counts as one
    at that distance.

    Raises:
        StaleInputError: the scan has no measurement, or its angles or limits are none.
    """
    ranges = np.asarray(scan.ranges, dtype=float)
    if np.isnan(ranges).all():
        raise StaleInputError(f"scan has no measurement among {len(ranges)} ranges")
    angles_fit = all(map(math.isfinite, (scan.angle_min, scan.angle_increment)))
    if not angles_fit or (scan.angle_increment == 0.0 and len(ranges) > 1):
        raise StaleInputError(
            f"scan is malformed: angle_min is {scan.angle_min:g}, angle_increment {scan.angle_increment:g}"
        )
    if not (math.isfinite(scan.range_min) and scan.range_min < scan.range_max):
        raise StaleInputError(f"scan is malformed: range_min is {scan.range_min:g}, range_max {scan.range_max:g}")
    ranges = np.where(np.isneginf(ranges), scan.range_min, ranges)
    with np.errstate(invalid="ignore"):
        valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges < scan.range_max)
    angles = scan.angle_min + scan.angle_increment * np.flatnonzero(valid)
    return ranges[valid] * np.cos(angles), ranges[valid] * np.sin(angles)


def cloud_points(cloud: PointCloud2) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the finite points of a cloud as x, y and z in m in the frame of the sensor.

    Raises:
        StaleInputError: the cloud lacks a coordinate, or its size does not fit its data.
    """
    formats = {}
    for field in cloud.fields:
        if field.name in ("x", "y", "z") and field.datatype in _DATA_TYPES:
            formats[field.name] = (("<", ">")[bool(cloud.is_bigendian)] + _DATA_TYPES[field.datatype], field.offset)
    count, row = cloud.width * cloud.height, cloud.width * cloud.point_step
    step = max(cloud.row_step, row) if cloud.height > 1 else row  # rows may be padded; some drivers leave out the step
    if count and (cloud.height - 1) * step + row > len(cloud.data):
        raise StaleInputError(
            f"point cloud is malformed: {count} points are announced, {len(cloud.data)} bytes are there"
        )
    # numpy would reckon with offsets of more than 31 bits wrongly, and read outside of the data.
    if any(offset + np.dtype(kind).itemsize > cloud.point_step for kind, offset in formats.values()):
        raise StaleInputError(
            f"point cloud is malformed: a coordinate is outside of a point of {cloud.point_step} bytes"
        )
    if not count:
        return np.empty(0), np.empty(0), np.empty(0)
    try:
        dtype = np.dtype(
            {
                "names": ["x", "y", "z"],
                "formats": [formats[axis][0] for axis in "xyz"],
                "offsets": [formats[axis][1] for axis in "xyz"],
                "itemsize": cloud.point_step,
            }
        )
        points = np.ndarray((cloud.height, cloud.width), dtype, cloud.data, strides=(step, cloud.point_step))
    except (KeyError, ValueError, TypeError) as error:
        raise StaleInputError(f"point cloud is malformed: {error}") from error
    x, y, z = (points[axis].astype(float).ravel() for axis in "xyz")
    finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    return (x, y, z) if finite.all() else (x[finite], y[finite], z[finite])


def _moved(
    matrix: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    moved = matrix[:3, :3] @ np.vstack((x, y, z)) + matrix[:3, 3:]
    return moved[0], moved[1], moved[2]
