"""Dynamic-window controller: samples velocities, rolls them out, checks the footprint, scores, takes the cheapest.

As in base_local_planner the robot drives arcs and turns on the spot; sideways and backward samples are tried only where
none of these is free, because the sensors look ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from move_base.geometry import Pose, Velocity, inscribed_radius, wrap_angle
from move_base.grid import INSCRIBED
from move_base.oscillation import OscillationFlags

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.costmap import Snapshot
    from move_base.parameters import MoveBaseParameters

MIN_STEPS, MAX_STEPS = 4, 20
"""Poses per trajectory: as many as sim_granularity asks for, within these. At 0.75 m/s and 2 s the most are 7.5 cm
apart, under a tenth of the footprint."""

EDGE_SPACING = 0.1
"""Distance between the points that stand for the footprint's edge, m."""

HARD_PADDING = (0.5, 0.25, 0.0)
"""Shares of the footprint's padding that a trajectory must keep free: the first, and what is tried where an obstacle is
in it already. The planner keeps the whole padding, so its paths leave the controller some room to follow them."""

SCORED_EVERY = 4
"""Every so many poses of a trajectory count for its distance to the path."""

MIN_HORIZON = 0.8
"""Shortest roll-out near the goal, s."""

TURN_CHANGE_COST = 0.03
"""Cost in metres per rad/s of change to the turning speed: keeps neighbouring samples from alternating."""

SPEED_CHANGE_COST = 0.05
"""Cost in metres per m/s of change to the forward speed, for the same reason; accelerating costs energy, too."""

ALIGN_ANGLE = 1.05
"""Off the path's direction by more than this (rad) the robot turns on the spot before it drives, if it can."""

NARROW_ALIGN_ANGLE = 0.35
"""The same for a robot that hardly moves in front of a narrow passage, which it can't enter aslant, rad."""

NARROW_AHEAD = 1.0
"""How far ahead a passage counts as in front, m: the robot's length."""

ESCAPE_DISTANCE = 0.3
"""Once it has to back off, the robot does so for this distance, m: with less it would come back to where it stuck."""


@dataclass(frozen=True)
class Trajectory:
    """A velocity and where it leads.

    Attributes:
        velocity: the command.
        poses: x, y, yaw over the horizon (S, 3).
        cost: its score, m.
    """

    velocity: Velocity
    poses: NDArray[np.float64]
    cost: float


@dataclass(frozen=True)
class _Rollout:
    """Sampled velocities (C, 3) and their poses x, y, yaw: three arrays (C, S)."""

    velocities: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    yaw: NDArray[np.float64]


@dataclass(frozen=True)
class _Scene:
    """What trajectories are judged by: the path ahead (N, 2), the costmap, and the shape to keep free."""

    path: NDArray[np.float64]
    snapshot: Snapshot
    shape: _Shape


class DwaController:
    """The controller; from one step to the next it keeps the last command, and where it began to back off."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.reconfigure(parameters)
        self.reset()

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Takes other parameters on the way."""
        self.parameters = parameters.controller
        self._period = 1.0 / parameters.controller_frequency
        footprint, padded = np.array(parameters.local_costmap.footprint), parameters.local_costmap.padded_footprint()
        padding = inscribed_radius(padded) - inscribed_radius(footprint)
        self._shapes = [_Shape(footprint, share * padding) for share in HARD_PADDING]

    def reset(self) -> None:
        """Forgets the last command, for a new goal."""
        self._last = Velocity()
        self._backing_from: Pose | None = None
        self._oscillation = OscillationFlags()

    def follow(
        self, robot: Pose, velocity: Velocity, path: NDArray[np.float64], to_goal: float, snapshot: Snapshot
    ) -> Trajectory | None:
        """Returns the best trajectory along a path, or None where every sample collides.

        Args:
            robot: in the local costmap's frame.
            velocity: measured, in the base's frame.
            path: the part of the plan ahead, in the local costmap's frame (N, 2), N >= 2.
            to_goal: length of the plan ahead, m.
            snapshot: the local costmap.
        """
        p = self.parameters
        self._oscillation.follow(robot, p.oscillation_reset_dist)
        horizon = min(p.sim_time, max(MIN_HORIZON, 2.0 * to_goal / p.max_vel_x))
        scene = _Scene(path, snapshot, self._shape_for(robot, snapshot))
        best = self._back_off(robot, scene)
        error = abs(wrap_angle(_direction_of(path) - robot.yaw))
        if best is None and error > self._align_angle(velocity, scene):
            best = self._best(self._turn_samples(velocity), robot, horizon, scene)
        if best is None:
            best = self._best(self._arc_samples(velocity), robot, horizon, scene)
        if best is None:
            best = self._best(self._sideways_samples(velocity), robot, MIN_HORIZON, scene)
        if best is None:
            best = self._best(self._backward_samples(), robot, MIN_HORIZON, scene)
            self._backing_from = None if best is None else robot
        if best is not None:
            self._last = best.velocity
            self._oscillation.take(robot, best.velocity)
        return best

    def turn(self, robot: Pose, angle: float, snapshot: Snapshot) -> Trajectory | None:
        """Returns a turn on the spot by up to `angle` (rad, signed), or None where it is not free.

        The speed falls with the angle left, so that the turn ends without overshoot.
        """
        p = self.parameters
        speed = min(p.max_vel_theta, max(p.min_in_place_vel_theta, abs(angle) / 0.5))
        command = np.array([[0.0, 0.0, np.copysign(speed, angle)]])
        rollout = _roll_out(command, robot, min(abs(angle) / speed, 1.0), MAX_STEPS)
        if not self._free(rollout, snapshot, self._shape_for(robot, snapshot))[0]:
            return None
        self._last = Velocity(0.0, 0.0, float(command[0, 2]))
        return _trajectory(rollout, 0, 0.0)

    def _back_off(self, robot: Pose, scene: _Scene) -> Trajectory | None:
        """Goes on backing off, if it has begun and is not far enough or blocked."""
        if self._backing_from is None:
            return None
        if robot.distance(self._backing_from) < ESCAPE_DISTANCE:
            backward = self._best(self._backward_samples(), robot, MIN_HORIZON, scene)
            if backward is not None:
                return backward
        self._backing_from = None
        return None

    def _align_angle(self, velocity: Velocity, scene: _Scene) -> float:
        """How far off the path's direction the robot may drive, rad."""
        if velocity.x > 1.5 * self.parameters.min_vel_x:
            return ALIGN_ANGLE
        near = scene.path[np.hypot(*(scene.path - scene.path[0]).T) <= NARROW_AHEAD]
        g = scene.snapshot.geometry
        rows, columns = g.cells(near)
        clearance = scene.snapshot.clearance[rows.clip(0, g.height - 1), columns.clip(0, g.width - 1)].min()
        narrow = clearance < scene.shape.circumscribed + scene.shape.margin
        return NARROW_ALIGN_ANGLE if narrow else ALIGN_ANGLE

    def _shape_for(self, robot: Pose, snapshot: Snapshot) -> _Shape:
        """The footprint with its margin; a smaller margin where an obstacle is in it already, or nothing could move."""
        here = _Rollout(np.zeros((1, 3)), *(np.array([[value]]) for value in (robot.x, robot.y, robot.yaw)))
        return next((shape for shape in self._shapes if self._free(here, snapshot, shape)[0]), self._shapes[-1])

    def _arc_samples(self, velocity: Velocity) -> NDArray[np.float64]:
        p = self.parameters
        reach = p.acc_lim_x * self._period
        fastest = min(p.max_vel_x, max(velocity.x + reach, p.min_vel_x))
        slowest = min(max(p.min_vel_x, velocity.x - reach), fastest)
        forward = np.linspace(fastest, slowest, p.vx_samples)
        turn_reach = p.acc_lim_theta * self._period
        low = max(p.min_vel_theta, velocity.yaw - turn_reach)
        high = min(p.max_vel_theta, velocity.yaw + turn_reach)
        turns = np.linspace(min(low, high), max(low, high), p.vtheta_samples)
        turns = np.unique(np.append(turns, [np.clip(0.0, turns[0], turns[-1])]))
        arcs = np.stack(np.meshgrid(forward, [0.0], turns, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.vstack([arcs, self._turn_samples(velocity)])

    def _turn_samples(self, velocity: Velocity) -> NDArray[np.float64]:
        p = self.parameters
        turn_reach = p.acc_lim_theta * self._period
        rates = np.linspace(p.min_in_place_vel_theta, p.max_vel_theta, max(2, p.vtheta_samples // 2))
        rates = np.concatenate([-rates, rates])
        near = rates[np.abs(rates - velocity.yaw) <= max(turn_reach, p.min_in_place_vel_theta * 1.01)]
        samples = np.zeros((len(near), 3))
        samples[:, 2] = near
        return self._oscillation.allowed(samples)

    def _sideways_samples(self, velocity: Velocity) -> NDArray[np.float64]:
        p = self.parameters
        reach = p.acc_lim_y * MIN_HORIZON  # what the base gets to while it drives such a sample
        laterals = sorted({min(max(lateral, velocity.y - reach), velocity.y + reach) for lateral in p.y_vels})
        samples = [(forward, lateral, 0.0) for lateral in laterals for forward in (0.0, p.min_vel_x)]
        return self._oscillation.allowed(np.array(samples).reshape(-1, 3))

    def _backward_samples(self) -> NDArray[np.float64]:
        escape = self.parameters.escape_vel
        return np.array([[escape, 0.0, 0.0]] if escape else []).reshape(-1, 3)

    def _best(
        self,
        samples: NDArray[np.float64],
        robot: Pose,
        horizon: float,
        scene: _Scene,
    ) -> Trajectory | None:
        if len(samples) == 0:
            return None
        rollout = _roll_out(samples, robot, horizon, self._steps(horizon))
        free = self._free(rollout, scene.snapshot, scene.shape)
        if not free.any():
            return None
        kept = _Rollout(samples[free], rollout.x[free], rollout.y[free], rollout.yaw[free])
        costs = self._score(kept, scene.path, scene.snapshot)
        best = int(costs.argmin())
        return _trajectory(kept, best, float(costs[best]))

    def _steps(self, horizon: float) -> int:
        p = self.parameters
        return int(np.clip(np.ceil(p.max_vel_x * horizon / p.sim_granularity), MIN_STEPS, MAX_STEPS))

    def _free(self, rollout: _Rollout, snapshot: Snapshot, shape: _Shape) -> NDArray[np.bool_]:
        """Whether each trajectory keeps the footprint off obstacles (C,); outside the costmap nothing is free.

        The clearance of the robot's centre decides most poses; the edge is looked at only in between.
        """
        g = snapshot.geometry
        rows, columns = g.cells(np.stack([rollout.x, rollout.y], axis=-1))
        inside = (rows >= 0) & (rows < g.height) & (columns >= 0) & (columns < g.width)
        clearance = np.where(
            inside, snapshot.clearance[rows.clip(0, g.height - 1), columns.clip(0, g.width - 1)], np.float32(0.0)
        )
        margin = shape.margin + 0.5 * g.resolution  # clearances end at the middle of an obstacle's cell
        blocked: NDArray[np.bool_] = np.any(clearance <= shape.inscribed + margin, axis=1)
        unsure = (clearance <= shape.circumscribed + margin) & ~blocked[:, None]
        if unsure.any():
            which, step = np.nonzero(unsure)
            cos, sin = np.cos(rollout.yaw[which, step]), np.sin(rollout.yaw[which, step])
            edge_x = rollout.x[which, step, None] + cos[:, None] * shape.edge[:, 0] - sin[:, None] * shape.edge[:, 1]
            edge_y = rollout.y[which, step, None] + sin[:, None] * shape.edge[:, 0] + cos[:, None] * shape.edge[:, 1]
            columns = ((edge_x - g.origin_x) * (1.0 / g.resolution)).astype(np.intp)
            rows = ((edge_y - g.origin_y) * (1.0 / g.resolution)).astype(np.intp)
            np.clip(columns, 0, g.width - 1, out=columns)
            np.clip(rows, 0, g.height - 1, out=rows)
            touching = (snapshot.clearance[rows, columns] <= margin).any(axis=1)
            blocked[which[touching]] = True
        return ~blocked

    def _score(self, rollout: _Rollout, path: NDArray[np.float64], snapshot: Snapshot) -> NDArray[np.float64]:
        """Returns the cost of each trajectory (C,) in metres: off the path, short of its end, near obstacles, jerky."""
        p = self.parameters
        lengths = np.hypot(*np.diff(path, axis=0).T)
        remaining = np.append(np.cumsum(lengths[::-1])[::-1], 0.0)
        steps = slice(rollout.x.shape[1] - 1, None, -SCORED_EVERY)
        dx = rollout.x[:, steps, None] - path[:, 0]
        dy = rollout.y[:, steps, None] - path[:, 1]
        squared = dx * dx + dy * dy
        nearest = squared[:, 0].argmin(axis=1)
        off_path = np.sqrt(squared.min(axis=2))
        to_goal = remaining[nearest] + off_path[:, 0]
        steps_along = np.diff(path, axis=0)
        directions = np.arctan2(steps_along[:, 1], steps_along[:, 0])
        turned = rollout.yaw[:, -1] - directions[np.minimum(nearest, len(directions) - 1)]
        misaligned = p.heading_lookahead * (1.0 - np.cos(turned))
        g = snapshot.geometry
        rows, columns = g.cells(np.stack([rollout.x[:, steps], rollout.y[:, steps]], axis=-1))
        cell_costs = snapshot.costs[rows, columns].astype(np.float32)
        occupied = np.minimum(cell_costs, INSCRIBED).mean(axis=1) * g.resolution
        changes = np.abs(rollout.velocities - (self._last.x, self._last.y, self._last.yaw))
        jerk = changes @ (SPEED_CHANGE_COST, SPEED_CHANGE_COST, TURN_CHANGE_COST)
        path_cost = p.path_distance_bias * (off_path.mean(axis=1) + misaligned)
        return np.asarray(path_cost + p.goal_distance_bias * to_goal + p.occdist_scale * occupied + jerk)


class _Shape:
    """A footprint: points along its edge (N, 2), its two radii, and the margin kept around it, m."""

    def __init__(self, corners: NDArray[np.float64], margin: float) -> None:
        self.margin = margin
        pieces = []
        for corner, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            count = max(1, int(np.ceil(np.hypot(*(following - corner)) / EDGE_SPACING)))
            fractions = np.arange(count)[:, None] / count
            pieces.append(corner + fractions * (following - corner))
        self.edge = np.concatenate(pieces)
        self.inscribed = inscribed_radius(corners)
        self.circumscribed = float(np.hypot(*corners.T).max())


def _roll_out(velocities: NDArray[np.float64], robot: Pose, horizon: float, steps: int) -> _Rollout:
    """Integrates constant velocities (C, 3) in closed form over the horizon (s), to so many poses."""
    times = np.linspace(horizon / steps, horizon, steps)
    turned = velocities[:, 2:] * times
    # sin(a)/a and (1 - cos(a))/a, whose limits at a = 0 are 1 and 0
    sinc = np.sinc(turned / np.pi)
    cosc = np.sinc(turned / (2.0 * np.pi)) * np.sin(turned / 2.0)
    forward = (velocities[:, :1] * sinc - velocities[:, 1:2] * cosc) * times
    left = (velocities[:, :1] * cosc + velocities[:, 1:2] * sinc) * times
    cos, sin = np.cos(robot.yaw), np.sin(robot.yaw)
    return _Rollout(
        velocities, robot.x + cos * forward - sin * left, robot.y + sin * forward + cos * left, robot.yaw + turned
    )


def _trajectory(rollout: _Rollout, index: int, cost: float) -> Trajectory:
    poses = np.stack([rollout.x[index], rollout.y[index], rollout.yaw[index]], axis=1)
    return Trajectory(Velocity(*(float(value) for value in rollout.velocities[index])), poses, cost)


def _direction_of(path: NDArray[np.float64], over: float = 0.5) -> float:
    """Returns the direction of a path's first `over` metres, rad."""
    away = np.hypot(*(path - path[0]).T)
    beyond = np.flatnonzero(away >= over)
    step = path[beyond[0] if len(beyond) else -1] - path[0]
    return float(np.arctan2(step[1], step[0]))
