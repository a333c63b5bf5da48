"""Times for a path: as fast as the Panda's limits of velocity and acceleration allow, at rest at both ends only.

A path is straight between its points, so an arm would have to stop at each. It need not if the corners are rounded:
each corner becomes a parabola that stays within 0.01 rad of it. Along the rounded path, the square of the speed is
limited by the velocity of each joint, by its acceleration where the path bends, and by the acceleration that the bend
leaves to become faster and slower.

The library toppra finds the same times, but its import takes 1.2 s of CPU, and that of OMPL 0.04 s (decision 35).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from arm_motion.panda import JOINTS, MAX_ACCELERATION, MAX_VELOCITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from arm_motion.vectors import Array

TOLERANCE = 0.01
"""rad; the largest distance of the rounded path from a corner."""

_STEP = 0.02  # rad, the norm, between points of a motion
_TURN = 0.25  # change of direction between points of a motion
_SAME = 1e-6  # rad


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A motion that begins and ends at rest.

    Attributes:
        times: (n,), s from its start, strictly increasing.
        positions: (n, 7), rad.
        velocities: (n, 7), rad/s.
    """

    times: Array
    positions: Array
    velocities: Array

    @property
    def duration(self) -> float:
        """Return how long it takes in s."""
        return float(self.times[-1])

    def at(self, time: float) -> tuple[Array, Array]:
        """Return positions and velocities at a time, by cubics as joint trajectory controllers do; at rest outside."""
        if time <= 0.0 or time >= self.duration:
            return self.positions[0 if time <= 0.0 else -1], np.zeros(JOINTS)
        i = int(np.searchsorted(self.times, time, side="right")) - 1
        length = self.times[i + 1] - self.times[i]
        s = (time - self.times[i]) / length
        way = self.positions[i + 1] - self.positions[i]
        first, second = self.velocities[i] * length, self.velocities[i + 1] * length
        square, cube = 3.0 * way - 2.0 * first - second, first + second - 2.0 * way
        position = self.positions[i] + s * (first + s * (square + s * cube))
        return position, (first + s * (2.0 * square + 3.0 * s * cube)) / length


def timed(path: Sequence[Array], speed: float = 1.0) -> Trajectory:
    """Return the fastest simple motion along a path.

    Args:
        path: joints, at least one.
        speed: share of the fastest motion, above 0 to 1: at 0.5 all velocities are half as large, and the motion takes
            twice as long.

    Raises:
        ValueError: the path is empty, or the speed is out of range.
    """
    if not len(path) or not 0.0 < speed <= 1.0:
        raise ValueError(f"a path of {len(path)} points at speed {speed}: give at least one point, and a speed up to 1")
    points = np.asarray(path, float)
    points = points[np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > _SAME])]
    if len(points) == 1:
        return Trajectory(np.zeros(1), points, np.zeros((1, JOINTS)))
    lengths, positions, tangents, bends = _rounded(points)
    rates = _rates(lengths, tangents, bends)
    steps = 2.0 * lengths / (rates[:-1] + rates[1:])
    times = np.concatenate([[0.0], np.cumsum(steps)])
    return Trajectory(times / speed, positions, tangents * rates[:, None] * speed)


def _rounded(points: Array) -> tuple[Array, Array, Array, Array]:
    """Return lengths (n - 1,) of steps along the rounded path, positions and tangents (n, 7), bends (n - 1, 7)."""
    ways = np.diff(points, axis=0)
    straight = np.linalg.norm(ways, axis=1)
    directions = ways / straight[:, None]
    turns = np.linalg.norm(np.diff(directions, axis=0), axis=1)
    cut = np.minimum(4.0 * TOLERANCE / np.maximum(turns, 1e-9), np.minimum(straight[:-1], straight[1:]) / 2.0)
    cut = np.concatenate([[0.0], cut, [0.0]])
    lengths, positions, tangents, bends = [], [points[:1]], [directions[:1]], []
    for i, direction in enumerate(directions):
        begin = points[i] + cut[i] * direction
        after = directions[min(i + 1, len(directions) - 1)]
        corner = 2.0 * cut[i + 1]
        for length, to in ((straight[i] - cut[i] - cut[i + 1], direction), (corner, after)):
            if length < 1e-12:
                continue
            bend = (to - direction) / length
            count = int(np.ceil(max(2.0, length / _STEP, float(np.linalg.norm(to - direction)) / _TURN)))
            at = np.linspace(0.0, length, count + 1)[1:, None]
            lengths.append(np.full(count, length / count))
            positions.append(begin + at * direction + at**2 / 2.0 * bend)
            tangents.append(direction + at * bend)
            bends.append(np.broadcast_to(bend, (count, JOINTS)))
            begin = positions[-1][-1]
    return np.concatenate(lengths), np.concatenate(positions), np.concatenate(tangents), np.concatenate(bends)


def _rates(lengths: Array, tangents: Array, bends: Array) -> Array:
    """Return the speed along the path at each of its positions."""
    with np.errstate(divide="ignore"):
        squares = (MAX_VELOCITY / np.abs(tangents)).min(axis=1) ** 2
        bent = (MAX_ACCELERATION / np.abs(bends)).min(axis=1)
    squares[1:] = np.minimum(squares[1:], bent)
    squares[:-1] = np.minimum(squares[:-1], bent)
    squares[0] = squares[-1] = 0.0
    # In a step, joints may gain speed by the acceleration that the bend leaves at the faster of its ends.
    shares = 2.0 * lengths[:, None] / np.maximum(np.maximum(np.abs(tangents[:-1]), np.abs(tangents[1:])), _SAME)
    gains, losses = shares * MAX_ACCELERATION, 1.0 + shares * np.abs(bends)
    for i in range(len(lengths)):
        squares[i + 1] = min(squares[i + 1], float(((squares[i] + gains[i]) / losses[i]).min()))
    for i in reversed(range(len(lengths))):
        squares[i] = min(squares[i], float(((squares[i + 1] + gains[i]) / losses[i]).min()))
    return np.sqrt(squares)
