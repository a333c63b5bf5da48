"""The controller in an arm's driver: follows trajectories, and stops the arm when it meets resistance.

It holds the arm where it is until it is given a trajectory. A contact force above the limit is a safety stop: the arm
stays where it is, and no trajectory is taken, until somebody releases it, as on an industrial arm. It can only be sent
back along the way that it came.
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


BACK_SPEED = 0.6
"""rad/s of the fastest joint on the way back."""
BACK_BLIND = 0.5
"""s from the begin of the way back, in which the arm may still press on what stopped it."""
_WAY_STEP = 0.02
"""rad between two places that are remembered of the way."""
_SAME_PLACE = 0.03
"""rad within which the arm is at a place of its way again, as after it has gone down to take something."""
_WAY_LENGTH = 2000
"""Places that are remembered at most."""


class Outcome(Enum):
    """How a trajectory ended."""

    DONE = auto()
    STOPPED = auto()
    """By a safety stop."""
    BEHIND = auto()
    """A joint has fallen behind by more than the path's tolerance."""
    NOT_REACHED = auto()
    """A joint is not at the goal in time."""
    SET_BACK = auto()
    """The clock was set back to before the trajectory began."""


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
        self._way: list[tuple[float, ...]] = []  # by which the arm came
        self._starts: list[int] = []  # places on it where a trajectory began
        self._is_going_back = False
        self._blind_until = 0.0

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
        if self._way and _distance(self._way[0], positions) < _WAY_STEP:  # back where it came from
            self._way, self._starts = [], []
        self._starts.append(len(self._way))
        self._remember(tuple(positions))

    def go_back(self, now: float, positions: Sequence[float]) -> str:
        """Send an arm that is stopped back to where its last trajectory began; return why not, or an empty text.

        The way was free when the arm came. If it meets something after the first half second, it stops again.

        Args:
            now: s.
            positions: rad, where the arm is.
        """
        if not self.is_stopped or self.is_moving:
            return "the arm is not stopped" if not self.is_stopped else "the arm is on its way back"
        if not self._starts:
            return "the arm does not know the way by which it came any further"
        start = self._starts[-1]
        back = [tuple(positions), *reversed(self._way[start:])]
        times, places = [0.0], [back[0]]
        for place in back[1:]:
            step = _distance(place, places[-1])
            if step > 1e-3:
                times.append(times[-1] + step / BACK_SPEED)
                places.append(place)
        speeds = [_slope(places, times, index) for index in range(len(times))]
        self._trajectory = Trajectory(tuple(times), tuple(places), tuple(speeds))
        self._began, self._goal_time = now, GOAL_TIME
        self._is_going_back, self._blind_until = True, now + BACK_BLIND
        return ""

    def _remember(self, place: tuple[float, ...]) -> None:
        """Remember a place of the way. Where the arm has been there before, the detour in between is forgotten."""
        if self._way and _distance(place, self._way[-1]) < _WAY_STEP:
            return
        recent = next(
            (i for i in range(len(self._way) - 1, -1, -1) if _distance(place, self._way[i]) > _SAME_PLACE), -1
        )
        before = next((i for i in range(recent - 1, -1, -1) if _distance(place, self._way[i]) < _SAME_PLACE), None)
        if before is not None:
            del self._way[before + 1 :]
            self._starts = [start for start in self._starts if start <= before] + [before]
            return
        self._way.append(place)
        if len(self._way) > _WAY_LENGTH:
            self._way, self._starts = [place], [0]

    def cancel(self, positions: Sequence[float]) -> None:
        """Stop where the arm is, by order."""
        self._trajectory, self._is_going_back = None, False
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
        is_blind = self._is_going_back and now < self._blind_until
        is_above = contact_force > self.force_limit and not is_blind
        self._above = self._above + 1 if is_above else 0
        if self._above >= FORCE_READINGS and (self._is_going_back or not self.is_stopped):
            was_moving = self.is_moving
            self.cancel(positions)
            self.is_stopped, self.resistance = True, contact_force
            return Outcome.STOPPED if was_moving else None
        trajectory = self._trajectory
        if trajectory is None:
            return None
        elapsed = now - self._began
        if elapsed < 0.0:
            self.cancel(positions)
            return Outcome.SET_BACK
        self._target = trajectory.at(elapsed)
        if not self._is_going_back:
            self._remember(self._target)
        outcome = self._outcome(trajectory, elapsed, positions)
        if outcome is Outcome.BEHIND:
            self.cancel(positions)
        elif outcome is not None:
            self._trajectory = None
        if self._is_going_back and outcome is not None:
            self._is_going_back = False
            if outcome is Outcome.DONE:
                del self._way[self._starts.pop() :]
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


def _slope(places: Sequence[Sequence[float]], times: Sequence[float], index: int) -> tuple[float, ...]:
    """Return the speeds at a place of a way, rad/s; none at its ends."""
    if index in (0, len(times) - 1):
        return (0.0,) * len(places[0])
    span = times[index + 1] - times[index - 1]
    return tuple((b - a) / span for a, b in zip(places[index - 1], places[index + 1], strict=True))


def _distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference of a joint, rad."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))
