"""The drivers of front laser and camera in lockstep, and what can be wrong with them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pybullet_simulator.robot.faults import Fault, Outlet
from pybullet_simulator.robot.sensors import DepthProjector, measure_depth, measure_ranges
from pybullet_simulator.ros.sensor_messages import laser_scan, point_cloud

from metacontrol_experiments.contingency.contingency import Kind

if TYPE_CHECKING:
    from pybullet_simulator.physics.simulation import Simulation

LASER_NOISE, DEPTH_NOISE = 0.01, 0.001
"""Defaults of the driver nodes."""


class Drivers:
    """The front laser's and the camera's driver; one that does not run is silent."""

    TOPICS = {"front/scan": "front_laser", "camera/depth/points": "camera"}
    COMPONENTS = tuple(TOPICS.values())

    def __init__(self, simulation: Simulation, seed: int) -> None:
        """Start all, with the random numbers that the nodes have."""
        self._simulation = simulation
        self._laser_rng = np.random.default_rng([seed, 3])
        self._camera_rng = np.random.default_rng([seed, 8])
        camera = simulation.robot.camera
        self._projector = DepthProjector(camera.width, camera.height, camera.field_of_view)
        self._silent: dict[str, Kind] = {}  # component -> what made it so
        self._outlets = {component: Outlet() for component in self.COMPONENTS}

    def strike(self, kind: Kind, component: str) -> None:
        """Let something happen to a driver; only what was frozen thaws."""
        if kind.spoils_data:
            self._outlets[component].fault = Fault(kind.value)
        elif kind is not Kind.THAW:
            self._silent[component] = kind
        else:
            self._outlets[component].fault = None
            if self._silent.get(component) is Kind.FREEZE:
                del self._silent[component]

    def message(self, topic: str, stamp: Any) -> Any | None:
        """Return a driver's message, a ROS one so that navigation takes it as on ROS; None where it is silent."""
        component = self.TOPICS[topic]
        if component in self._silent:
            return None
        measured = self._scan(stamp) if component == "front_laser" else self._cloud(stamp)
        return self._outlets[component].pass_on(measured)

    def _scan(self, stamp: Any) -> Any:
        laser = self._simulation.robot.front_laser
        ranges = self._simulation.scan(laser)
        noisy = measure_ranges(ranges, laser.range_min, laser.range_max, LASER_NOISE, self._laser_rng)
        return laser_scan(laser, noisy, stamp)

    def _cloud(self, stamp: Any) -> Any:
        simulation, camera = self._simulation, self._simulation.robot.camera
        depth = measure_depth(simulation.depth_image(), simulation.light, DEPTH_NOISE, self._camera_rng)
        points = self._projector.points(depth, camera.range_min, camera.range_max)
        return point_cloud(points, camera.mount.frame, stamp)
