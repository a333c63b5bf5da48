"""Let contingencies happen in lockstep, as the module `ros.fault_injection` does on ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pybullet_simulator.world.clutter import ClutterError, scatter
from pybullet_simulator.world.obstacles import CLUTTER_MASS, CLUTTER_SIZE, ObstacleError
from pybullet_simulator.world.world import Box
from robot_formulas.geometry import Pose

from metacontrol_experiments.contingency.contingency import InjectionError, Kind

if TYPE_CHECKING:
    from collections.abc import Collection

    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.world.grid import Grid

    from metacontrol_experiments.contingency.contingency import Contingency
    from metacontrol_experiments.lockstep.drivers import Drivers


class FaultInjector:
    """Knows how each kind of contingency is made."""

    def __init__(self, simulation: Simulation, drivers: Drivers, grid: Grid, way: tuple[Pose, Pose]) -> None:
        """Keep what it needs.

        Args:
            simulation: of robot and world.
            drivers: of the sensors.
            grid: the world's map.
            way: where the robot starts and where it goes; clutter at random places follows from it and the seed.
        """
        self._simulation = simulation
        self._drivers = drivers
        self._grid = grid
        self._way = way
        self.obstacles: list[tuple[float, float]] = []  # places of all clutter so far, m

    def inject(self, contingency: Contingency) -> dict[str, str]:
        """Make a contingency happen now; return a description of it.

        Raises:
            InjectionError: it cannot.
        """
        kind, value = contingency.kind, contingency.value
        if kind.hits_component:
            self._drivers.inject(kind, contingency.target)
            return {"how": kind.value}
        if kind is Kind.POWER:
            self._simulation.set_consumption_factor(value)
            return {"factor": f"{value:g}"}
        if kind is Kind.LIGHT:
            self._simulation.set_light(value)
            return {"light": f"{value:g}"}
        if kind is Kind.CLUTTER:
            return self._clutter(contingency)
        raise InjectionError(f"{contingency}: lockstep can't inject a contingency of kind {kind.value}")

    def _clutter(self, contingency: Contingency) -> dict[str, str]:
        places = tuple(Pose(x, y, 0.0) for x, y in contingency.places)
        try:
            if not places:
                places = scatter(self._grid, *self._way, contingency.count, contingency.seed or 0)
            for place in places:
                box = Box("", "clutter", place.x, place.y, *CLUTTER_SIZE, place.yaw)
                self._simulation.spawn(box, CLUTTER_MASS)
        except (ClutterError, ObstacleError) as error:
            raise InjectionError(f"{contingency}: {error}") from error
        self.obstacles += [(round(place.x, 1), round(place.y, 1)) for place in places]
        return {"places": " ".join(f"{place.x:.3f},{place.y:.3f}" for place in places)}


def check(contingency: Contingency, components: Collection[str]) -> None:
    """Refuse a component that does not run in lockstep.

    Args:
        contingency: what is to happen.
        components: those that run.

    Raises:
        InjectionError: it hits another one.
    """
    if contingency.kind.hits_component and contingency.target not in components:
        raise InjectionError(f"{contingency}: in lockstep there are only the components {' and '.join(components)}")
