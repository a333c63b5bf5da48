"""The part of the node simulator that fills PyBullet's window; only there with `gui`."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Path
from robot_formulas.geometry import ORIGIN, Pose
from sensor_msgs.msg import LaserScan, PointCloud2
from visualization_msgs.msg import Marker

from pybullet_simulator.messages.grid import read_grid
from pybullet_simulator.physics.window import (
    BLUE,
    GLOBAL_HIGH,
    GREEN,
    LOCAL_HIGH,
    PINK,
    RED,
    SKY,
    Points,
    Window,
    cost_points,
    cross_points,
    path_points,
    scan_points,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from pybullet_simulator.physics.simulation import Simulation

PERIOD_STEPS = 20
"""Steps between two drawings: 5 Hz."""
SENSORS = ("front/scan", "camera/depth/points")
_RED = 0.5
"""A text at least this red (0 to 1) is an alarm and stays red; other colours suit only RViz's light background."""
STALE_S = 1.0
"""Sensor data older than this are hidden, s of simulated time."""


class WindowView:
    """Keeps the latest message of each topic, and draws the new ones between two steps."""

    def __init__(self, simulation: Simulation) -> None:
        """Connect."""
        self._simulation = simulation
        self._window = Window(simulation.physics.client)
        self._text: Marker | None = None
        self._latest: dict[str, tuple[Callable[[Any], Points], Any]] = {}
        self._drawn: dict[str, float] = {}  # topic -> simulated time of the last drawing
        self._lock = threading.Lock()
        topics: tuple[tuple[str, type, Callable[[Any], Points]], ...] = (
            ("front/scan", LaserScan, self._scan),
            ("camera/depth/points", PointCloud2, self._cloud),
            ("move_base/global_costmap/costmap", OccupancyGrid, lambda grid: self._costmap(grid, 0.02, GLOBAL_HIGH)),
            ("move_base/local_costmap/costmap", OccupancyGrid, lambda grid: self._costmap(grid, 0.04, LOCAL_HIGH)),
            ("move_base/NavfnROS/plan", Path, lambda path: self._path(path, 0.1, GREEN)),
            ("move_base/TrajectoryPlannerROS/local_plan", Path, lambda path: self._path(path, 0.4, SKY)),
            ("move_base/current_goal", PoseStamped, self._goal),
        )
        self._inputs = [
            rospy.Subscriber(topic, kind, self._keep, (topic, convert), queue_size=1, buff_size=1 << 22)
            for topic, kind, convert in topics
        ]
        self._inputs.append(rospy.Subscriber("rviz/text", Marker, self._on_text, queue_size=1))

    def draw(self) -> None:
        """Draw what has come since the last time (called by the loop)."""
        with self._lock:
            latest, self._latest = self._latest, {}
            text = self._text
        for topic, (convert, message) in latest.items():
            try:
                points = convert(message)
            except ValueError as error:
                rospy.logwarn_throttle(10.0, f"{topic} not shown: {error}")
                continue
            self._window.draw(topic, points)
            self._drawn[topic] = self._simulation.time
        for topic in SENSORS:
            if self._simulation.time - self._drawn.get(topic, math.inf) > STALE_S:
                self._window.draw(topic, Points(np.empty((0, 3)), RED))
                del self._drawn[topic]
        if text is not None:
            lines = tuple(text.text.splitlines())
            self._window.write(lines, self._simulation.pose, alarm=text.color.r > _RED)

    def _keep(self, message: Any, handled: tuple[str, Callable[[Any], Points]]) -> None:
        topic, convert = handled
        with self._lock:
            self._latest[topic] = (convert, message)

    def _on_text(self, message: Marker) -> None:
        with self._lock:
            self._text = message

    def _frame(self, name: str) -> Pose:
        """Return the true pose of a frame on the map."""
        simulation = self._simulation
        robot = simulation.robot
        if name.lstrip("/") == "map":
            return ORIGIN
        if name.lstrip("/") == "odom":
            return simulation.pose @ simulation.odometry.filtered.inverse()
        mounts = {part.mount.frame: part.mount for part in (robot.front_laser, robot.rear_laser, robot.camera)}
        mount = mounts.get(name.lstrip("/"))
        return simulation.pose @ mount.pose if mount else simulation.pose

    def _scan(self, scan: LaserScan) -> Points:
        ranges = np.asarray(scan.ranges, dtype=float)
        height = self._simulation.robot.front_laser.mount.z
        points = scan_points(ranges, scan.angle_min, scan.angle_increment, height)
        return Points(points, RED, self._frame(scan.header.frame_id), 4)

    def _cloud(self, cloud: PointCloud2) -> Points:
        if cloud.point_step < 12 or len(cloud.data) % cloud.point_step:
            raise ValueError(f"{len(cloud.data)} bytes are no points of {cloud.point_step} bytes")
        rows = np.frombuffer(cloud.data, dtype=np.uint8).reshape(-1, cloud.point_step)[:, :12]
        points = np.ascontiguousarray(rows).view("<f4").astype(float)
        points[:, 2] += self._simulation.robot.camera.mount.z
        return Points(points[points[:, 2] > 0.05], BLUE, self._frame(cloud.header.frame_id), 2)

    def _costmap(self, message: OccupancyGrid, height: float, high: tuple[float, float, float]) -> Points:
        grid = read_grid(message)
        points, colours = cost_points(grid.cells, grid.resolution, height, high)
        corner = Pose(grid.origin_x, grid.origin_y, grid.origin_yaw)
        return Points(points, colours, self._frame(message.header.frame_id) @ corner, 2)

    def _path(self, path: Path, height: float, colour: tuple[float, float, float]) -> Points:
        corners = np.array([(stamped.pose.position.x, stamped.pose.position.y) for stamped in path.poses])
        points = path_points(corners.reshape(-1, 2), height)
        return Points(points, colour, self._frame(path.header.frame_id), 4)

    def _goal(self, goal: PoseStamped) -> Points:
        position = goal.pose.position
        return Points(cross_points(position.x, position.y), PINK, self._frame(goal.header.frame_id), 5)
