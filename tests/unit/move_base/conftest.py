"""Closes the loop around the navigator by kinematic simulation: a holonomic base, rays cast on a grid, exact frames."""

import copy
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import yaml
from move_base.costmap.grid import Geometry
from move_base.costmap.sensors import Observation
from move_base.costmap.static_map import StaticMap
from move_base.navigation.navigator import Navigator
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import Pose, Velocity

CONFIG = Path(__file__).parents[3] / "catkin_ws/src/metacontrol_sim/config/move_base.yaml"
RESOLUTION = 0.05
LASER = Pose(0.4, 0.0, 0.0)
REAR_LASER = Pose(-0.4, 0.0, math.pi)
CAMERA = Pose(0.45, 0.0, 0.0)
SUBSTEP = 0.01


def base_tree(**changes):
    """The parameters of D2 as the parameter server returns them, with changes as `group__name=value`."""
    tree = copy.deepcopy(yaml.safe_load(CONFIG.read_text()))
    for path, value in changes.items():
        *groups, name = path.split("__")
        level = tree
        for group in groups:
            level = level.setdefault(group, {})
        level[name] = value
    return tree


def variant_tree(speed=0.5, radius=0.65, source="scan", rate=20.0, **changes):
    """The same for one of D2's variants; the one with the rear laser drives backwards."""
    ahead = (-0.1, -speed) if source == "rear_scan" else (speed, 0.1)
    costmaps = {}
    for costmap in ("local_costmap", "global_costmap"):
        costmaps[f"{costmap}__inflater_layer__inflation_radius"] = radius
        costmaps[f"{costmap}__obstacles_layer__observation_sources"] = source
    return base_tree(
        controller_frequency=rate,
        planner_frequency=rate / 5,
        global_costmap__update_frequency=rate / 5,
        local_costmap__update_frequency=rate / 2,
        TrajectoryPlannerROS__max_vel_x=ahead[0],
        TrajectoryPlannerROS__min_vel_x=ahead[1],
        TrajectoryPlannerROS__max_vel_y=speed,
        TrajectoryPlannerROS__acc_lim_x=12 * speed,
        TrajectoryPlannerROS__acc_lim_y=12 * speed,
        **costmaps,
        **changes,
    )


def room(width=12.0, height=12.0):
    """The four walls of a room around the origin, as boxes (x, y, length, width, yaw)."""
    half_w, half_h = width / 2, height / 2
    return [
        (-half_w, 0.0, 0.2, height, 0.0),
        (half_w, 0.0, 0.2, height, 0.0),
        (0.0, -half_h, width, 0.2, 0.0),
        (0.0, half_h, width, 0.2, 0.0),
    ]


@dataclass
class Run:
    """What a run of the simulation recorded."""

    outcome: object = None
    text: str = ""
    duration: float = 0.0
    contacts: int = 0
    states: list = field(default_factory=list)  # (time, Pose, Velocity)
    commands: list = field(default_factory=list)  # (time, Velocity)
    warnings: list = field(default_factory=list)

    @property
    def length(self):
        points = np.array([(pose.x, pose.y) for _, pose, _ in self.states])
        return float(np.hypot(*np.diff(points, axis=0).T).sum())


class Simulation:
    """Stepped by the test; also the navigator's access to the frames map -> odom -> base_link -> sensors."""

    def __init__(
        self, boxes, *, hidden=(), start=(0.0, 0.0, 0.0), tree=None, size=14.0, acceleration=2.0, odom=(0.3, -0.2, 0.1)
    ):
        cells = round(size / RESOLUTION)
        self.geometry = Geometry(RESOLUTION, cells, cells, -size / 2, -size / 2)
        self.known = self._rasterise(boxes)
        self.solid = self.known | self._rasterise(hidden)
        self.pose = Pose(*start)
        self.velocity = Velocity()
        self.time = 100.0
        self.acceleration = acceleration
        self.map_to_odom = Pose(*odom).matrix()
        self.silent_from = math.inf
        self.history = {round(self.time / SUBSTEP): self.pose}
        self.navigator = Navigator(read_parameters(tree or base_tree()))
        self.sent = -math.inf
        occupancy = np.where(self.known, 100, 0).ravel()
        self.static_map = StaticMap.create(occupancy, cells, cells, RESOLUTION, (-size / 2, -size / 2, 0.0), "map")
        self.navigator.set_map(self.static_map)
        self.run_log = Run()
        self._touching = False

    def _rasterise(self, boxes):
        rows, columns = np.indices(self.geometry.shape)
        points = self.geometry.centres(rows, columns)
        solid = np.zeros(self.geometry.shape, dtype=bool)
        for x, y, length, width, yaw in boxes:
            local = Pose(x, y, yaw).inverse().apply(points.reshape(-1, 2)).reshape(points.shape)
            solid |= (np.abs(local[..., 0]) <= length / 2) & (np.abs(local[..., 1]) <= width / 2)
        return solid

    # -- frames ---------------------------------------------------------------------------------------------------

    def lookup(self, target, source, stamp):
        pose = self.pose if stamp is None else self.history.get(round(stamp / SUBSTEP))
        if pose is None:
            return None
        in_map = {
            "map": np.eye(4),
            "odom": self.map_to_odom,
            "base_link": pose.matrix(),
            "front_laser": (pose @ LASER).matrix(0.2),
            "rear_laser": (pose @ REAR_LASER).matrix(0.2),
            "camera_link": (pose @ CAMERA).matrix(0.4),
        }
        if target not in in_map or source not in in_map:
            return None
        return np.linalg.inv(in_map[target]) @ in_map[source]

    def newest(self, target, source):
        return self.time

    # -- sensors --------------------------------------------------------------------------------------------------

    def cast(self, sensor, angles, reach):
        """Ranges of rays from a sensor pose; reach + 1 where there is nothing."""
        distances = np.arange(0.0, reach, RESOLUTION / 2)
        x = sensor.x + distances * np.cos(sensor.yaw + angles)[:, None]
        y = sensor.y + distances * np.sin(sensor.yaw + angles)[:, None]
        rows, columns = self.geometry.cells(np.stack([x, y], axis=-1))
        inside = (rows >= 0) & (rows < self.geometry.height) & (columns >= 0) & (columns < self.geometry.width)
        met = inside & self.solid[rows.clip(0, self.geometry.height - 1), columns.clip(0, self.geometry.width - 1)]
        return np.where(met.any(axis=1), distances[met.argmax(axis=1)], reach + 1.0)

    def sense(self):
        for source in self.navigator.sources:
            camera = source.data_type == "PointCloud2"
            mount, frame = (CAMERA, "camera_link") if camera else (LASER, "front_laser")
            if source.topic == "rear/scan":
                mount, frame = REAR_LASER, "rear_laser"
            angles = np.radians(np.linspace(-30, 30, 160) if camera else np.linspace(-135, 135, 361))
            reach = 8.0 if camera else 10.0
            ranges = self.cast(self.pose @ mount, angles, reach)
            hits = ranges <= reach
            ranges = np.where(hits, ranges, source.raytrace_range)
            points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * ranges], axis=1)
            if camera:
                points, hits = points[hits], hits[hits]
            observation = Observation(source, frame, self.time, points.astype(np.float32), hits, not camera)
            self.navigator.observe(observation, self.time)

    # -- physics --------------------------------------------------------------------------------------------------

    def move(self, command, duration):
        for _ in range(round(duration / SUBSTEP)):
            v = self.velocity
            step = self.acceleration * SUBSTEP
            self.velocity = Velocity(
                v.x + min(max(command.x - v.x, -step), step),
                v.y + min(max(command.y - v.y, -step), step),
                v.yaw + min(max(command.yaw - v.yaw, -4 * step), 4 * step),
            )
            v = self.velocity
            self.pose = self.pose @ Pose(v.x * SUBSTEP, v.y * SUBSTEP, v.yaw * SUBSTEP)
            self.time += SUBSTEP
            self.history[round(self.time / SUBSTEP)] = self.pose

    def touches(self):
        edge = np.linspace(-1.0, 1.0, 41)
        corners = np.concatenate(
            [np.stack([0.48 * edge, s * 0.4 * np.ones(41)], 1) for s in (1, -1)]
            + [np.stack([s * 0.48 * np.ones(41), 0.4 * edge], 1) for s in (1, -1)]
        )
        rows, columns = self.geometry.cells(self.pose.apply(corners))
        return bool(self.solid[rows, columns].any())

    # -- the loop -------------------------------------------------------------------------------------------------

    def run(self, seconds, until=None):
        """Runs until the goal ends, `until(self)` holds or the time is over; returns the log."""
        log = self.run_log
        period = 1.0 / self.navigator.parameters.controller_frequency
        end = self.time + seconds
        while self.time < end and not (until and until(self)):
            if self.time - self.sent >= 0.1 - 1e-6 and self.time < self.silent_from:
                self.sense()
                self.sent = self.time
            result = self.navigator.step(self.time, self, self.velocity)
            command = result.velocity or Velocity()
            log.commands.append((self.time, command))
            log.states.append((self.time, self.pose, self.velocity))
            if result.warning:
                log.warnings.append((self.time, result.warning))
            if result.outcome is not None:
                log.outcome, log.text, log.duration = result.outcome, result.text, self.time - 100.0
                break
            self.move(command, period)
            touching = self.touches()
            log.contacts += touching and not self._touching
            self._touching = touching
        return log


@pytest.fixture
def simulate():
    """Makes simulations: `simulate(boxes, hidden=..., start=..., tree=...)`."""
    return Simulation


@pytest.fixture
def tree():
    """Makes parameter trees of D2: `tree(TrajectoryPlannerROS__max_vel_x=0.3)`."""
    return base_tree


@pytest.fixture
def variant():
    """Makes parameter trees of D2's variants: `variant(speed=0.3, radius=0.5, source="point_cloud")`."""
    return variant_tree


@pytest.fixture
def walls():
    """Makes the boxes of a room's walls."""
    return room
