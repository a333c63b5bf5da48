"""Clutter and people on the floor, which no map shows, and which come and go at run time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pybullet_simulator.world.walking import CLEARANCE, HEIGHT, RADIUS, Walker
from pybullet_simulator.world.world import overlap, way_problem

if TYPE_CHECKING:
    from robot_formulas.geometry import Pose

    from pybullet_simulator.physics.physics import Physics
    from pybullet_simulator.robot.robot import Robot
    from pybullet_simulator.world.world import Box, World

CLUTTER_SIZE = (0.3, 0.3, 0.95)
CLUTTER_MASS = 500.0
"""m and kg of an obstacle of the published clutter contingency."""
MAX_OBSTACLES = 500
MAX_SIZE = 10.0
"""m; larger is a building, which belongs into the world file."""


class ObstacleError(ValueError):
    """An obstacle cannot be placed as requested, or does not exist; the message says why."""


@dataclass(frozen=True)
class Shown:
    """An obstacle as others see it.

    Attributes:
        name: its own.
        pose: m, m, rad, map frame.
        size: length, width, height, m; a person's length is the diameter.
        person: whether it walks.
    """

    name: str
    pose: Pose
    size: tuple[float, float, float]
    person: bool


@dataclass
class _Walking:
    walker: Walker
    body: int
    walked: float = 0.0


class Obstacles:
    """Keeps the bodies of clutter and people.

    Attributes:
        changes: grows with every obstacle that comes or goes.
    """

    def __init__(self, physics: Physics, world: World, robot: Robot) -> None:
        """Put the world's people on their ways."""
        self._physics = physics
        self._world = world
        self._robot = robot
        self._boxes: dict[str, tuple[Box, int]] = {}
        self._walkers: dict[str, _Walking] = {}
        self._number = 0
        self.changes = 0
        for walker in world.walkers:
            self._walkers[walker.name] = _Walking(walker, physics.add_person(*walker.waypoints[0]))

    @property
    def walking(self) -> bool:
        """Whether anybody walks."""
        return bool(self._walkers)

    def shown(self) -> tuple[Shown, ...]:
        """Return what is there now."""
        place = self._physics.place
        boxes = (
            Shown(name, place(body), (box.length, box.width, box.height), False)
            for name, (box, body) in self._boxes.items()
        )
        people = (
            Shown(name, place(entry.body), (2.0 * RADIUS, 2.0 * RADIUS, HEIGHT), True)
            for name, entry in self._walkers.items()
        )
        return (*boxes, *people)

    def name_of(self, body: int) -> str | None:
        """Return the name of the obstacle with a body, None where none has it."""
        for name, (_, other) in self._boxes.items():
            if other == body:
                return name
        return next((name for name, entry in self._walkers.items() if entry.body == body), None)

    def spawn(self, box: Box, mass: float, robot: Pose) -> str:
        """Put a box on the floor and return its name; an empty one is made up.

        Args:
            box: what and where, map frame.
            mass: kg; 0 cannot be moved.
            robot: pose of base_link.

        Raises:
            ObstacleError: a value makes no sense, or the place is taken.
        """
        numbers = (box.x, box.y, box.yaw, box.length, box.width, box.height, mass)
        if not all(math.isfinite(number) for number in numbers):
            raise ObstacleError(f"obstacle {box.name!r}: every number must be finite")
        if not (min(box.length, box.width, box.height) > 0.0 and max(box.length, box.width, box.height) <= MAX_SIZE):
            raise ObstacleError(f"obstacle {box.name!r}: sizes must be more than 0 and at most {MAX_SIZE:g} m")
        if mass < 0.0:
            raise ObstacleError(f"obstacle {box.name!r}: a mass of {mass:g} kg; give 0 or more")
        name = self._new_name(box.name, "obstacle")
        self._check_place(name, box, robot)
        self._boxes[name] = (box, self._physics.add_box(box, mass))
        self.changes += 1
        return name

    def spawn_walker(self, walker: Walker, robot: Pose) -> str:
        """Put a person on their way and return their name; an empty one is made up.

        Raises:
            ObstacleError: the way or the speed makes no sense, or the robot stands at the first waypoint.
        """
        if problem := way_problem(self._world, walker):
            raise ObstacleError(f"person {walker.name!r}: {problem}")
        name = self._new_name(walker.name, "person")
        if self._gap_to_robot(*walker.waypoints[0], robot) < RADIUS:
            raise ObstacleError(f"person {walker.name!r}: the robot stands at the first waypoint")
        self._walkers[name] = _Walking(walker, self._physics.add_person(*walker.waypoints[0]))
        self.changes += 1
        return name

    def delete(self, name: str) -> int:
        """Take an obstacle or a person away, or all with an empty name; return the body, -1 for all.

        Raises:
            ObstacleError: there is none of this name.
        """
        if not name:
            for other in (*self._boxes, *self._walkers):
                self.delete(other)
            return -1
        if name in self._boxes:
            body = self._boxes.pop(name)[1]
        elif name in self._walkers:
            body = self._walkers.pop(name).body
        else:
            known = ", ".join((*self._boxes, *self._walkers)) or "none"
            raise ObstacleError(f"no obstacle {name!r}; there are: {known}")
        self._physics.remove(body)
        self.changes += 1
        return body

    def advance(self, robot: Pose, duration: float) -> None:
        """Let people walk for a time in s; a person who would come too close to the robot waits."""
        for entry in self._walkers.values():
            here = entry.walker.place(entry.walked)
            walked = entry.walked + entry.walker.speed * duration
            there = entry.walker.place(walked)
            gap = self._gap_to_robot(*there, robot)
            if gap < RADIUS + CLEARANCE and gap < self._gap_to_robot(*here, robot):
                continue
            entry.walked = walked
            self._physics.move(entry.body, *there)

    def _new_name(self, name: str, kind: str) -> str:
        if len(self._boxes) + len(self._walkers) >= MAX_OBSTACLES:
            raise ObstacleError(f"{kind} {name!r}: there are {MAX_OBSTACLES} obstacles already")
        taken = {box.name for box in self._world.boxes} | self._boxes.keys() | self._walkers.keys()
        if name in taken:
            raise ObstacleError(f"{kind} {name!r}: the name is taken")
        while not name:
            self._number += 1
            candidate = f"{kind}_{self._number}"
            name = "" if candidate in taken else candidate
        return name

    def _check_place(self, name: str, box: Box, robot: Pose) -> None:
        """Raise ObstacleError where the box would stand in something."""
        if not self._world.contains(box.x, box.y):
            raise ObstacleError(f"obstacle {name!r}: ({box.x:g}, {box.y:g}) is off the floor")
        if overlap(box, self._robot.body(robot)):
            raise ObstacleError(f"obstacle {name!r}: the robot stands at ({box.x:g}, {box.y:g})")
        placed = (other for other, _ in self._boxes.values() if overlap(box, other))
        if other := self._world.under(box) or next(placed, None):
            raise ObstacleError(f"obstacle {name!r}: ({box.x:g}, {box.y:g}) lies in {other.name!r}")

    def _gap_to_robot(self, x: float, y: float, robot: Pose) -> float:
        """Return the distance of a point to the robot's footprint, m."""
        return float(self._robot.body(robot).distance(x, y))
