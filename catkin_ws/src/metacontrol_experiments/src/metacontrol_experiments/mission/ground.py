"""The ground of missions: a world, and the routes over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pybullet_simulator.robot.robot import Robot
from pybullet_simulator.world.standing import standing_problem

from metacontrol_experiments.mission.routes import RouteError

if TYPE_CHECKING:
    from pathlib import Path

    from pybullet_simulator.world.grid import Grid

    from metacontrol_experiments.mission.routes import Route


@dataclass(frozen=True)
class Ground:
    """Where missions are driven.

    Attributes:
        world: file of the world, or of a map; None for the factory.
        routes: file of the routes; None for the factory's.
        mark: tells it from any other: names and digest of its files; empty for the factory with its own routes.
    """

    world: Path | None = None
    routes: Path | None = None
    mark: str = ""


FACTORY = Ground()
"""The floor of D2, with its own routes."""


def check_route(route: Route, grid: Grid, where: str, world: str) -> None:
    """Check that the robot can stand at both ends of a route.

    Args:
        route: what is checked.
        grid: the map of the world.
        where: the file of routes, for messages.
        world: its file, for messages.

    Raises:
        RouteError: it cannot.
    """
    robot = Robot()
    for name, pose in (("start", route.start), ("goal", route.goal)):
        problem = standing_problem(grid, robot.body(pose))
        if problem:
            place = f"({pose.x:.2f}, {pose.y:.2f}, {pose.yaw:.2f}) {problem} in {world}"
            room = f"a place with room for the robot's {robot.length:.2f} x {robot.width:.2f} m"
            raise RouteError(
                f"{where}: route {route.name!r}, {name}: {place}; give {room}, or name the world's own routes"
            )
