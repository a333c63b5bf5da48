"""The controller in an arm's driver: follows trajectories, and stops the arm when it meets resistance.

It holds the arm where it is until it is given a trajectory. A contact force above the limit is a safety stop: the arm
stays where it is, and no trajectory is taken, until somebody releases it, as on an industrial arm.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

JOINTS = 7
START_TOLERANCE = 0.05
"""rad: how far from the first point of a trajectory an arm may be; a jump would be a jerk."""
PATH_TOLERANCE = 0.20
"""rad: how far behind its trajectory an arm may fall; servos with load lag."""
GOAL_TOLERANCE = 0.01
"""rad: how near to the last point a joint must come."""
GOAL_TIME = 2.0
"""s after the end of a trajectory until the goal's tolerance is due, where the goal says none."""
FORCE_READINGS = 2
"""Readings in a row above the limit that are a contact; a single one may be a touch between steps of the physics."""


class Outcome(Enum):
    """How a trajectory ended."""

    DONE = auto()
    STOPPED = auto()
    """By a safety stop."""
    BEHIND = auto()
    """A joint has fallen behind by more than the path's tolerance."""
    NOT_REACHED = auto()
    """A joint is not at the goal in time."""


class TrajectoryError(ValueError):
    """A trajectory can't be followed; the text says why."""


@dataclass(frozen=True)
class Trajectory:
    """Points of all joints over time.

    Attributes:
        times: s from the start, increasing, n of them.
        positions: rad, n times 7.
        velocities: rad/s, n times 7.
    """

    times: tuple[float, ...]
    positions: tuple[tuple[float, ...], ...]
    velocities: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        """Check the points.

        Raises:
            TrajectoryError: there are none, they are not finite, not of 7 joints, or their times do not increase.
        """
        if not self.times or not len(self.times) == len(self.positions) == len(self.velocities):
            raise TrajectoryError("each point needs a time, positions and velocities, and there must be points")
        if any(len(point) != JOINTS for point in (*self.positions, *self.velocities)):
            raise TrajectoryError(f"each point needs {JOINTS} positions and velocities")
        if not all(map(math.isfinite, (*self.times, *(v for p in (*self.positions, *self.velocities) for v in p)))):
            raise TrajectoryError("a number is not finite")
        if self.times[0] < 0.0 or any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise TrajectoryError("the times of the points must increase from 0")

    @property
    def duration(self) -> float:
        """Time of the last point, s."""
        return self.times[-1]

    def at(self, time: float) -> tuple[float, ...]:
        """Return the positions at a time, by cubic splines through the points and their velocities."""
        after = bisect.bisect_right(self.times, time)
        if after == 0:
            return self.positions[0]
        if after == len(self.times):
            return self.positions[-1]
        start, span = self.times[after - 1], self.times[after] - self.times[after - 1]
        share = (time - start) / span
        square, cube = share * share, share * share * share
        weights = (2 * cube - 3 * square + 1, (cube - 2 * square + share) * span, 3 * square - 2 * cube)
        return tuple(
            weights[0] * p0 + weights[1] * v0 + weights[2] * p1 + (cube - square) * span * v1
            for p0, v0, p1, v1 in zip(
                self.positions[after - 1],
                self.velocities[after - 1],
                self.positions[after],
                self.velocities[after],
                strict=True,
            )
        )


class ArmController:
    """Follows one trajectory at a time. Times are ROS time in s, readings those of the arm."""

    def __init__(self, force_limit: float) -> None:
        """Prepare.

        Args:
            force_limit: N, above which the arm stops.
        """
        self.force_limit = force_limit
        self.is_stopped = False
        self.resistance = 0.0
        """N, the force that stopped the arm."""
        self._target: tuple[float, ...] | None = None
        self._trajectory: Trajectory | None = None
        self._began = 0.0
        self._goal_time = GOAL_TIME
        self._above = 0

    @property
    def is_moving(self) -> bool:
        """Whether a trajectory is being followed."""
        return self._trajectory is not None

    def follow(self, trajectory: Trajectory, now: float, positions: Sequence[float], goal_time: float = 0.0) -> None:
        """Take a trajectory, in place of the one that is being followed.

        Args:
            trajectory: its first point is where the arm is.
            now: s.
            positions: rad, where the arm is.
            goal_time: s after the trajectory's end until the goal is due; 0: the usual time.

        Raises:
            TrajectoryError: the arm is stopped, or not at the first point.
        """
        if self.is_stopped:
            raise TrajectoryError(f"the arm is stopped: it met {self.resistance:.0f} N; release it first")
        # An arm that moves is a bit behind its target. A trajectory goes on from either.
        here = [positions] if self._target is None else [positions, self._target]
        if min(_distance(trajectory.at(0.0), place) for place in here) > START_TOLERANCE:
            raise TrajectoryError(f"the trajectory begins more than {START_TOLERANCE:g} rad from where the arm is")
        self._trajectory, self._began, self._goal_time = trajectory, now, goal_time or GOAL_TIME

    def cancel(self, positions: Sequence[float]) -> None:
        """Stop where the arm is, by order."""
        self._trajectory = None
        self._target = tuple(positions)

    def release(self, contact_force: float) -> str:
        """End a safety stop; return why not, or an empty text."""
        if contact_force > self.force_limit:
            return f"it still meets {contact_force:.0f} N"
        self.is_stopped, self.resistance, self._above = False, 0.0, 0
        return ""

    def update(self, now: float, positions: Sequence[float], contact_force: float) -> Outcome | None:
        """Take a reading; return how the trajectory ended, if it did now."""
        if self._target is None:
            self._target = tuple(positions)
        self._above = self._above + 1 if contact_force > self.force_limit else 0
        if self._above >= FORCE_READINGS and not self.is_stopped:
            was_moving = self.is_moving
            self.cancel(positions)
            self.is_stopped, self.resistance = True, contact_force
            return Outcome.STOPPED if was_moving else None
        trajectory = self._trajectory
        if trajectory is None:
            return None
        elapsed = now - self._began
        self._target = trajectory.at(elapsed)
        outcome = self._outcome(trajectory, elapsed, positions)
        if outcome is Outcome.BEHIND:
            self.cancel(positions)
        elif outcome is not None:
            self._trajectory = None
        return outcome

    @property
    def target(self) -> tuple[float, ...] | None:
        """Targets of the servos, rad; None before the first reading."""
        return self._target

    def _outcome(self, trajectory: Trajectory, elapsed: float, positions: Sequence[float]) -> Outcome | None:
        if elapsed < trajectory.duration:
            return Outcome.BEHIND if _distance(trajectory.at(elapsed), positions) > PATH_TOLERANCE else None
        if _distance(trajectory.positions[-1], positions) <= GOAL_TOLERANCE:
            return Outcome.DONE
        return Outcome.NOT_REACHED if elapsed > trajectory.duration + self._goal_time else None


def _distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference of a joint, rad."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))
