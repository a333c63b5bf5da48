"""What an arm does to take a block, to put it, and to go out of the way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from arm_motion.grasping import Grasp, grasp
from arm_motion.planning import NoPathError, line, plan
from arm_motion.scene import Box
from arm_motion.timing import timed

from metacontrol_manipulation.pick_place.pyramid import SIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from arm_motion.scene import Scene
    from arm_motion.timing import Trajectory
    from arm_motion.vectors import Vector

    from metacontrol_manipulation.handling.surroundings import BlockPose, Surroundings

OPEN = 0.08
"""m between the open fingers."""
RELEASED = 0.064
"""m between the fingers after a block was put: 7 mm at each side, so that they do not touch its neighbours."""
GRIP_FORCE = 20.0
"""N, all that the gripper has; a block of 0.09 kg needs 1 N at rest."""
SPEED, CAREFUL = 0.7, 0.25
"""Shares of the fastest motion: on the way, and near blocks."""
DEADLINE = 2.0
"""s of wall time for a search."""
_HIGH, _RISE = 0.30, 0.10
"""m above the table from which on a hand is over all blocks, and by which it rises from among them."""
HELD = Box((0.0, 0.0, 0.0), (SIDE - 0.002,) * 3)
"""A held block in the TCP's frame."""


class HandlingError(RuntimeError):
    """An arm can't do what is asked; the message says why."""


@dataclass(frozen=True)
class Move:
    """A motion of the joints."""

    trajectory: Trajectory


@dataclass(frozen=True)
class Grip:
    """A motion of the fingers: m between them, N."""

    width: float
    force: float = GRIP_FORCE


Deed = Move | Grip

LET_GO = Grip(RELEASED)
"""A block that stands somewhere is let go of, and stays there."""


def take(scene: Scene, around: Surroundings, joints: Vector, block: BlockPose, seed: int) -> list[Deed]:
    """Return how to take a block, and to lift it.

    Args:
        scene: what is in the way; the block itself is not in it.
        around: where the arm is.
        joints: where it is now, rad.
        block: in the cell frame.
        seed: of the search for a path.

    Raises:
        HandlingError: the block is out of reach, or there is no path.
    """
    position, yaw = around.in_arm(block)
    chosen = grasp(scene, position, yaw, joints)
    if chosen is None:
        raise HandlingError(f"a block at {_text(block)} is out of reach")
    up = list(reversed(chosen.down))
    return [
        Grip(OPEN),
        _way(scene, joints, chosen, seed),
        Move(timed(chosen.down, CAREFUL)),
        Grip(0.0),
        Move(timed(up, CAREFUL)),
    ]


def put(scene: Scene, around: Surroundings, joints: Vector, place: BlockPose, seed: int) -> list[Deed]:
    """Return how to put the block that is held, and to leave it.

    Args:
        scene: what is in the way.
        around: where the arm is.
        joints: where it is now, rad.
        place: in the cell frame. The fingers close along the cell's x axis.
        seed: of the search for a path.

    Raises:
        HandlingError: the place is out of reach, or there is no path.
    """
    position, yaw = around.in_arm(place)
    chosen = grasp(scene, position, yaw, joints, along=around.along, held=HELD)
    if chosen is None:
        raise HandlingError(f"a place at {_text(place)} is out of reach")
    up = list(reversed(chosen.down))
    return [
        _way(scene, joints, chosen, seed, HELD),
        Move(timed(chosen.down, CAREFUL)),
        LET_GO,
        Move(timed(up, CAREFUL)),
    ]


def go(scene: Scene, joints: Vector, goal: Sequence[float], seed: int, *, holds: bool = False) -> list[Deed]:
    """Return how to go to a posture.

    Raises:
        HandlingError: there is no path.
    """
    try:
        path = plan(scene, joints, goal, seed=seed, deadline=DEADLINE, held=HELD if holds else None)
    except NoPathError as error:
        raise HandlingError(str(error)) from error
    return [Move(timed(path, SPEED))]


def rise(scene: Scene, joints: Vector, table: float) -> list[Deed]:
    """Return how a hand rises straight by some cm; nothing where it is high above the table.

    Args:
        scene: what is in the way.
        joints: where the arm is, rad.
        table: height of the table in the arm's frame, m.

    Raises:
        HandlingError: something is in the way.
    """
    position, quaternion = scene.forward(joints)
    if position[2] > table + _HIGH:
        return []
    above = (position[0], position[1], position[2] + _RISE)
    try:
        return [Move(timed(line(scene, joints, above, quaternion), CAREFUL))]
    except NoPathError as error:
        raise HandlingError(str(error)) from error


def _way(scene: Scene, joints: Vector, chosen: Grasp, seed: int, held: Box | None = None) -> Move:
    try:
        return Move(timed(plan(scene, joints, chosen.above, seed=seed, deadline=DEADLINE, held=held), SPEED))
    except NoPathError as error:
        raise HandlingError(str(error)) from error


def _text(place: BlockPose) -> str:
    return f"({place.x:.3f}, {place.y:.3f}, {place.z:.3f}) of the cell"
