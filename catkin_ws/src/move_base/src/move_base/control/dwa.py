"""Dynamic-window controller: samples velocities, rolls them out, checks the footprint, scores, takes the cheapest.

As in base_local_planner the robot drives arcs and turns on the spot; sideways and backward samples are tried only where
none of these is free, because the sensors look ahead. A robot that touches an obstacle moves slowly out of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from robot_formulas.geometry import Pose, Velocity, inscribed_radius, wrap

from move_base.control.escape import Escape, escape_samples
from move_base.control.oscillation import OscillationFlags
from move_base.control.rollout import Footprint, Rollout, Trajectory, roll_out
from move_base.costmap.grid import INSCRIBED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.costmap.snapshot import Snapshot
    from move_base.parameters.parameters import MoveBaseParameters

MIN_STEPS, MAX_STEPS = 4, 20
"""Poses per trajectory: as many as sim_granularity asks for, within these. At 0.75 m/s and 2 s the most are 7.5 cm
apart, under a tenth of the footprint."""

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

ALIGNED_ANGLE = 0.05
"""Within this angle of the path's direction turning on the spot helps no further, rad."""

NARROW_AHEAD = 1.0
"""How far ahead a passage counts as in front, m: the robot's length."""

ESCAPE_DISTANCE = 0.3
"""Once it has to back off, the robot does so for this distance, m: with less it would come back to where it stuck."""


@dataclass(frozen=True)
class _Scene:
    """The criteria for trajectories: the path ahead (N, 2), the costmap, and the shape to keep free."""

    path: NDArray[np.float64]
    snapshot: Snapshot
    shape: Footprint


class DwaController:
    """The controller; from one step to the next it keeps the last command, and where it began to back off."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.reconfigure(parameters)
        self.reset()

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Take other parameters while the robot drives."""
        self.parameters = p = parameters.controller
        self._period = 1.0 / parameters.controller_frequency
        footprint, padded = np.array(parameters.local_costmap.footprint), parameters.local_costmap.padded_footprint()
        padding = inscribed_radius(padded) - inscribed_radius(footprint)
        self._shapes = [Footprint(footprint, share * padding) for share in HARD_PADDING]
        self._escape = Escape(footprint, self._shapes[-1])
        self._reach = p.max_vel_x * p.sim_time + self._shapes[0].circumscribed

    def reset(self) -> None:
        """Forget the last command, for a new goal."""
        self._last = Velocity()
        self._backing_from: Pose | None = None
        self._oscillation = OscillationFlags()

    def follow(
        self, robot: Pose, velocity: Velocity, path: NDArray[np.float64], to_goal: float, snapshot: Snapshot
    ) -> Trajectory | None:
        """Return the best trajectory along a path, or None where every sample collides.

        A robot that touches an obstacle may get a way out of it instead.

        Args:
            robot: in the local costmap's frame.
            velocity: measured, in the base's frame.
            path: the part of the plan ahead, in the local costmap's frame (N, 2), N >= 2.
            to_goal: length of the plan ahead, m.
            snapshot: the local costmap.
        """
        p = self.parameters
        self._oscillation.follow(robot, p.oscillation_reset_dist)
        snapshot.part_around(robot.x, robot.y, self._reach)  # at once, and not part by part
        horizon = min(p.sim_time, max(MIN_HORIZON, 2.0 * to_goal / p.max_vel_x))
        shapes = self._shapes_for(robot, snapshot)
        scene = _Scene(path, snapshot, shapes[0])
        best = self._back_off(robot, scene)
        error = wrap(_direction_of(path) - robot.yaw)
        if best is None and abs(error) > self._align_angle(velocity, scene):
            best = self._turn(robot, error, snapshot)
        arcs = self._arc_samples(velocity) if best is None else np.empty((0, 3))
        for shape in shapes:  # a narrow passage is entered with less margin rather than not at all
            if best is None:
                best = self._best(arcs, robot, horizon, replace(scene, shape=shape))
        if best is None and abs(error) > ALIGNED_ANGLE:
            best = self._turn(robot, error, snapshot)
        if best is None:
            best = self._best(self._sideways_samples(velocity), robot, MIN_HORIZON, scene)
        if best is None:
            best = self._best(self._backward_samples(), robot, MIN_HORIZON, scene)
            self._backing_from = None if best is None else robot
        if best is None:
            best = self._come_free(robot, snapshot)
        if best is not None:
            self._last = best.velocity
            self._oscillation.take(robot, best.velocity)
        return best

    def turn(self, robot: Pose, angle: float, snapshot: Snapshot) -> Trajectory | None:
        """Return a turn on the spot by up to `angle` (rad, signed), or None if it is not free.

        The speed falls with the angle left, so that the turn ends without overshoot. A robot that touches an obstacle
        may get a way out of it instead.
        """
        chosen = self._turn(robot, angle, snapshot) or self._come_free(robot, snapshot)
        if chosen is not None:
            self._last = chosen.velocity
        return chosen

    def _turn(self, robot: Pose, angle: float, snapshot: Snapshot) -> Trajectory | None:
        p = self.parameters
        speed = min(p.max_vel_theta, max(p.min_in_place_vel_theta, abs(angle) / 0.5))
        command = np.array([[0.0, 0.0, np.copysign(speed, angle)]])
        rollout = roll_out(command, robot, min(abs(angle) / speed, 1.0), MAX_STEPS)
        if not any(shape.is_free(rollout, snapshot)[0] for shape in self._shapes_for(robot, snapshot)):
            return None
        return rollout.trajectory(0, 0.0)

    def _come_free(self, robot: Pose, snapshot: Snapshot) -> Trajectory | None:
        """Return a way out of an obstacle that the robot itself touches, without its padding; None if there is none."""
        if self._shapes[-1].is_free_at(robot, snapshot):
            return None
        return self._escape.best(escape_samples(self.parameters), robot, MIN_HORIZON, snapshot)

    def _back_off(self, robot: Pose, scene: _Scene) -> Trajectory | None:
        """Keep backing off if that has begun, the robot has not come far enough, and the way is free."""
        if self._backing_from is None:
            return None
        if robot.distance(self._backing_from) < ESCAPE_DISTANCE:
            backward = self._best(self._backward_samples(), robot, MIN_HORIZON, scene)
            if backward is not None:
                return backward
        self._backing_from = None
        return None

    def _align_angle(self, velocity: Velocity, scene: _Scene) -> float:
        """Return the largest deviation from the path's direction with which the robot may drive, rad."""
        if velocity.x > 1.5 * self.parameters.min_vel_x:
            return ALIGN_ANGLE
        near = scene.path[np.hypot(*(scene.path - scene.path[0]).T) <= NARROW_AHEAD]
        g = scene.snapshot.geometry
        rows, columns = g.cells(near)
        rows, columns = rows.clip(0, g.height - 1), columns.clip(0, g.width - 1)
        clearance = scene.snapshot.part_with(rows, columns).clearance_at(rows, columns).min()
        narrow = clearance < scene.shape.circumscribed + scene.shape.margin
        return NARROW_ALIGN_ANGLE if narrow else ALIGN_ANGLE

    def _shapes_for(self, robot: Pose, snapshot: Snapshot) -> list[Footprint]:
        """Return the footprint with its margins, largest first, but those in which an obstacle is already."""
        free = (index for index, shape in enumerate(self._shapes) if shape.is_free_at(robot, snapshot))
        return self._shapes[next(free, len(self._shapes) - 1) :]

    def _arc_samples(self, velocity: Velocity) -> NDArray[np.float64]:
        p = self.parameters
        reach = p.acc_lim_x * self._period
        fastest = min(p.max_vel_x, max(velocity.x + reach, p.min_vel_x))
        slowest = min(max(p.min_vel_x, velocity.x - reach), fastest)
        forward = np.linspace(fastest, slowest, p.vx_samples)
        turn_reach = p.acc_lim_theta * self._period
        low, high = (
            min(max(yaw, p.min_vel_theta), p.max_vel_theta)
            for yaw in (velocity.yaw - turn_reach, velocity.yaw + turn_reach)
        )
        turns = np.linspace(low, high, p.vtheta_samples).tolist()
        turns = sorted({*turns, min(max(0.0, turns[0]), turns[-1])})
        arcs = np.zeros((len(forward), len(turns), 3))
        arcs[..., 0], arcs[..., 2] = forward[:, None], turns
        return arcs.reshape(-1, 3)

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
        rollout = roll_out(samples, robot, horizon, self._steps(horizon))
        free = scene.shape.is_free(rollout, scene.snapshot)
        if not free.any():
            return None
        kept = rollout if free.all() else rollout.only(free)
        costs = self._score(kept, scene.path, scene.snapshot)
        best = int(costs.argmin())
        return kept.trajectory(best, float(costs[best]))

    def _steps(self, horizon: float) -> int:
        p = self.parameters
        return min(max(math.ceil(p.max_vel_x * horizon / p.sim_granularity), MIN_STEPS), MAX_STEPS)

    def _score(self, rollout: Rollout, path: NDArray[np.float64], snapshot: Snapshot) -> NDArray[np.float64]:
        """Return the cost of each trajectory (C,) in metres: off the path, short of its end, near obstacles, jerky."""
        p = self.parameters
        along = np.diff(path, axis=0)
        remaining = np.append(np.cumsum(np.hypot(along[::-1, 0], along[::-1, 1]))[::-1], 0.0)
        steps = slice(rollout.x.shape[1] - 1, None, -SCORED_EVERY)
        x, y = rollout.x[:, steps], rollout.y[:, steps]
        squared = np.subtract.outer(path[:, 0], x)  # in place from here: new arrays of this size cost more than numbers
        squared *= squared
        squared_y = np.subtract.outer(path[:, 1], y)
        squared_y *= squared_y
        squared += squared_y
        nearest = squared[:, :, 0].argmin(axis=0)
        off_path = np.sqrt(squared.min(axis=0))
        to_goal = remaining[nearest] + off_path[:, 0]
        directions = np.arctan2(along[:, 1], along[:, 0])
        turned = rollout.yaw[:, -1] - directions[np.minimum(nearest, len(directions) - 1)]
        misaligned = p.heading_lookahead * (1.0 - np.cos(turned))
        g = snapshot.geometry
        rows, columns = g.cells_at(x, y)
        cell_costs = snapshot.part_with(rows, columns).costs_at(rows, columns).astype(np.float32)
        occupied = np.minimum(cell_costs, INSCRIBED).mean(axis=1) * g.resolution
        changes = np.abs(rollout.velocities - (self._last.x, self._last.y, self._last.yaw))
        jerk = changes @ (SPEED_CHANGE_COST, SPEED_CHANGE_COST, TURN_CHANGE_COST)
        path_cost = p.path_distance_bias * (off_path.mean(axis=1) + misaligned)
        return np.asarray(path_cost + p.goal_distance_bias * to_goal + p.occdist_scale * occupied + jerk)


def _direction_of(path: NDArray[np.float64], over: float = 0.5) -> float:
    """Return the direction of a path's first `over` metres, rad."""
    away = np.hypot(*(path - path[0]).T)
    beyond = np.flatnonzero(away >= over)
    step = path[beyond[0] if len(beyond) else -1] - path[0]
    return float(np.arctan2(step[1], step[0]))
