"""The drivers of the sensors in lockstep, and their faults. The base model says which drivers run."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pybullet_simulator.messages.sensors import laser_scan, point_cloud
from pybullet_simulator.robot.faults import Fault, Outlet
from pybullet_simulator.robot.laser_and_camera import (
    DEPTH_NOISE,
    LASER_NOISE,
    DepthProjector,
    measure_depth,
    measure_ranges,
)
from ros_model.language.metamodel import PortKind
from sensor_msgs.msg import LaserScan, PointCloud2

from metacontrol_experiments.contingency.contingency import Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.robot.robot import Laser
    from ros_model.language.metamodel import RosSystem


class Drivers:
    """The drivers that the base model has; one that does not run is silent.

    Attributes:
        topics: class of the messages by the topic of each driver.
        components: names of the drivers' components.
    """

    def __init__(self, simulation: Simulation, base: RosSystem, seed: int) -> None:
        """Start all, with the random numbers that the nodes have."""
        self._simulation = simulation
        self._laser_rngs = {
            laser.mount.frame: np.random.default_rng([seed, stream])
            for laser, stream in ((simulation.robot.front_laser, 3), (simulation.robot.rear_laser, 7))
        }
        self._camera_rng = np.random.default_rng([seed, 8])
        camera = simulation.robot.camera
        self._projector = DepthProjector(camera.width, camera.height, camera.field_of_view)
        made: dict[str, tuple[type, Callable[[Any], Any]]] = {  # by executable
            "front_laser": (LaserScan, partial(self._scan, simulation.robot.front_laser)),
            "rear_laser": (LaserScan, partial(self._scan, simulation.robot.rear_laser)),
            "camera": (PointCloud2, self._cloud),
        }
        self.topics: dict[str, type] = {}
        self._sources: dict[str, tuple[str, Callable[[Any], Any]]] = {}  # topic -> component and how it measures
        for component in base.components:
            executable = component.executable
            if executable is None or executable.node not in made:
                continue
            message_class, measure = made[executable.node]
            for topic in (port.name.strip("/") for port in component.ports if port.kind is PortKind.PUBLISHER):
                self.topics[topic] = message_class
                self._sources[topic] = component.graph_name, measure
        self.components = tuple(component for component, _ in self._sources.values())
        self._silent: dict[str, Kind] = {}  # component -> what made it so
        self._outlets = {component: Outlet() for component in self.components}

    def inject(self, kind: Kind, component: str) -> None:
        """Inject a fault into a driver; only a frozen driver thaws."""
        if kind.spoils_data:
            self._outlets[component].fault = Fault(kind.value)
        elif kind is not Kind.THAW:
            self._silent[component] = kind
        else:
            self._outlets[component].fault = None
            if self._silent.get(component) is Kind.FREEZE:
                del self._silent[component]

    def start(self, component: str) -> bool:
        """Start a driver again that has ended; tell whether it runs. Without its device it ends at once."""
        if self._silent.get(component) in (Kind.KILL, Kind.STOP):
            del self._silent[component]
        return component not in self._silent

    def message(self, topic: str, stamp: Any) -> Any | None:
        """Return a driver's message, a ROS one so that navigation takes it as on ROS; None where it is silent."""
        component, measure = self._sources[topic]
        return None if component in self._silent else self._outlets[component].pass_on(measure(stamp))

    def _scan(self, laser: Laser, stamp: Any) -> Any:
        ranges = self._simulation.scan(laser)
        noisy = measure_ranges(
            ranges, laser.range_min, laser.range_max, LASER_NOISE, self._laser_rngs[laser.mount.frame]
        )
        return laser_scan(laser, noisy, stamp)

    def _cloud(self, stamp: Any) -> Any:
        simulation, camera = self._simulation, self._simulation.robot.camera
        depth = measure_depth(simulation.depth_image(), simulation.light, DEPTH_NOISE, self._camera_rng)
        points = self._projector.points(depth, camera.range_min, camera.range_max)
        return point_cloud(points, camera.mount.frame, stamp)
