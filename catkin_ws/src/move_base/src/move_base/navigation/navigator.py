"""The navigation state machine: goal in, velocity or outcome out. It knows no ROS and is told the time.

    IDLE -> PLANNING -> CONTROLLING -> IDLE (succeeded, aborted, cancelled)
               ^ |           |
               | v           v
              RECOVERING <----

In no state does the robot move on sensor data that are too old, or without a map or a transform.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from robot_formulas.geometry import STOP, Pose, Velocity, wrap

from move_base.control.direction import Controller
from move_base.costmap.grid import LETHAL
from move_base.costmap.surroundings import Surroundings
from move_base.navigation.goal_memory import Work
from move_base.navigation.result import Outcome, RecoveryStatus, Result, State
from move_base.planning.followed_plan import FollowedPlan
from move_base.planning.global_planner import Plan, PlanningError, make_plan

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from move_base.costmap.sensors import Observation
    from move_base.costmap.snapshot import Snapshot
    from move_base.costmap.static_map import MapPart, StaticMap
    from move_base.costmap.surroundings import Transformer
    from move_base.parameters.parameters import MoveBaseParameters, ObservationSource

ROTATE_SPEED = 1.0
"""Speed of the recovery's turn, rad/s: rotate_recovery's default."""

TURNED = 0.05
"""A robot that has turned by so many rad turns still."""

PLANNING_SHARE = 0.1
"""A robot that drives plans for this share of the time at the most: the base stands still while a long plan is made."""

QUIET_WAIT = 0.5
"""Waiting is worth a warning after this time, s: the first messages after a start take a few tenths."""


class Navigator:
    """Costmaps, planner, controller and recovery behind one `step`."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.parameters = parameters
        self.state = State.IDLE
        self.goal: Pose | None = None
        self._followed: FollowedPlan | None = None
        self._surroundings = Surroundings(parameters)
        self._global, self._local = self._surroundings.global_area, self._surroundings.local_area
        self._controller = Controller(parameters)
        self._work = Work.begun(0.0)
        self._planning_since: float | None = None  # begin of the last step, if it planned
        self._plan_took = 0.0  # s, the last step that planned

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Take other parameters while the robot drives: goal, plan, obstacles and speed stay.

        Frames, sizes and sensors are the same as before (`move_base.parameters.reconfiguration` offers no others).
        """
        self.parameters = parameters
        self._surroundings.reconfigure(parameters)
        self._controller.reconfigure(parameters)

    # -- what comes in ---------------------------------------------------------------------------------------------

    @property
    def sources(self) -> list[ObservationSource]:
        """The sources to listen to, those that convert a topic's messages alike once."""
        return self._surroundings.sources

    @property
    def global_snapshot(self) -> Snapshot | None:
        """The newest global costmap."""
        return self._global.snapshot

    @property
    def local_snapshot(self) -> Snapshot | None:
        """The newest local costmap."""
        return self._local.snapshot

    def set_map(self, static: StaticMap, topic: str = "", now: float = 0.0, frames: Transformer | None = None) -> str:
        """Take the static map of a topic; without one, it is for all static layers.

        Returns:
            Why it waits while another one stays in use, or an empty text: `frames` must connect it with the costmaps.
        """
        return self._surroundings.set_map(static, topic, now, frames)

    def update_map(self, part: MapPart, topic: str) -> None:
        """Take a part of the static map of a topic.

        Raises:
            MapError: the part is not within the map, or there is none in its frame.
        """
        self._surroundings.update_map(part, topic)

    def observe(self, observation: Observation, now: float) -> str:
        """Take a measurement.

        Returns:
            Why it was ignored, or an empty text.
        """
        return self._surroundings.observe(observation, now)

    def set_goal(self, goal: Pose, now: float) -> None:
        """Pursue a goal in the global frame, in place of the present one."""
        self.goal = goal
        self._followed = None
        self.state = State.PLANNING
        self._controller.reset()
        self._work = Work.begun(now)

    def cancel(self) -> None:
        """Drop the goal; the caller stops the robot."""
        self.goal = None
        self._followed = None
        self.state = State.IDLE

    def clear_costmaps(self) -> None:
        """Forget all obstacles but those of the static map."""
        self._surroundings.clear()

    def reset_time(self, now: float) -> None:
        """Forget all stamps, after the clock was set back; the goal stays, a recovery that is under way does not."""
        self._surroundings.reset_time()
        self._work = Work.begun(now)
        self._planning_since = None
        if self.state is State.RECOVERING:
            self.state = State.PLANNING

    # -- the step --------------------------------------------------------------------------------------------------

    def step(self, now: float, frames: Transformer, velocity: Velocity) -> Result:
        """Update the costmaps that are due, and decide.

        Args:
            now: time in s.
            frames: the transforms.
            velocity: of the base, measured, in its own frame.
        """
        if self._planning_since is not None:
            self._plan_took, self._planning_since = now - self._planning_since, None
        robot, local_robot = self._global.robot_pose(now, frames), self._local.robot_pose(now, frames)
        resting = self.goal is None and self.parameters.shutdown_costmaps
        missing = "" if resting else self._surroundings.update(now, frames, robot, local_robot)
        if self.goal is None:
            return Result(robot=robot)
        if missing or robot is None or local_robot is None:
            return self._not_ready(now, robot, missing)
        self._work.not_ready_since = None
        stale = self._surroundings.stale_reason(now)
        if stale:
            return self._hold(now, robot, stale)
        self._fresh_again(now)
        if self._at_goal(robot):
            return self._turn_to_goal(now, robot, local_robot)
        if self.state is State.RECOVERING:
            return self._recover(now, robot, local_robot)
        return self._drive(now, frames, robot, local_robot, velocity)

    def plan_between(self, start: Pose, goal: Pose, tolerance: float) -> Plan:
        """Plan on the newest global costmap.

        Raises:
            PlanningError: no costmap yet, or no plan.
        """
        snapshot = self._global.snapshot
        if snapshot is None:
            raise PlanningError("there is no costmap yet: map or transforms are missing")
        return make_plan(
            snapshot,
            start,
            goal,
            tolerance=tolerance,
            escape_radius=2.0 * self._global.costmap.inscribed_radius,
            allow_unknown=self.parameters.allow_unknown,
        )

    def _not_ready(self, now: float, robot: Pose | None, reason: str) -> Result:
        if self._work.not_ready_since is None:
            self._work.not_ready_since = now
        waited = now - self._work.not_ready_since
        self._work.restart_patience(now)
        if waited >= max(self.parameters.planner_patience, 5.0):
            return self._abort(robot, f"{reason} for {waited:.1f} s")
        return Result(velocity=STOP, robot=robot, warning=f"Waiting: {reason}" if waited > QUIET_WAIT else "")

    def _hold(self, now: float, robot: Pose, reason: str) -> Result:
        """Stand still while data are too old: neither drive nor turn. All other patience pauses meanwhile."""
        if self._work.stale_since is None:
            self._work.stale_since = now
        waited = now - self._work.stale_since
        self._work.restart_patience(now)
        if waited >= self.parameters.controller_patience:
            return self._abort(robot, f"{reason} for {waited:.1f} s")
        return Result(velocity=STOP, robot=robot, warning=f"Standing still: {reason}" if waited > QUIET_WAIT else "")

    def _fresh_again(self, now: float) -> None:
        if self._work.stale_since is not None:
            self._work.stale_since = None
            self._work.planned = -math.inf
            self._work.restart_patience(now)

    def _at_goal(self, robot: Pose) -> bool:
        p = self.parameters.controller
        assert self.goal is not None  # noqa: S101
        target = self._followed.plan.goal if self._followed is not None else self.goal
        if robot.distance(target) <= p.xy_goal_tolerance:
            self._work.reached_xy = True
            return True
        return self._work.reached_xy and p.latch_xy_goal_tolerance

    def _turn_to_goal(self, now: float, robot: Pose, local_robot: Pose) -> Result:
        assert self.goal is not None  # noqa: S101
        error = wrap(self.goal.yaw - robot.yaw)
        if abs(error) <= self.parameters.controller.yaw_goal_tolerance:
            return self._end(robot, Outcome.SUCCEEDED, "Goal reached.")
        snapshot = self._local.snapshot
        turn = self._controller.turn(local_robot, error, snapshot) if snapshot is not None else None
        before = self._work.turned
        if turn is not None and (before is None or abs(wrap(robot.yaw - before)) >= TURNED):
            self._work.controlled, self._work.turned = now, robot.yaw
        if now - self._work.controlled >= self.parameters.controller_patience:
            why = "the robot does not turn" if turn is not None else "there is no room to turn"
            return self._abort(robot, f"{why} to the goal's heading")
        if turn is None:
            return Result(velocity=STOP, robot=robot, warning="No room to turn to the goal's heading")
        return Result(velocity=turn.velocity, robot=robot, trajectory=turn)

    def _drive(self, now: float, frames: Transformer, robot: Pose, local_robot: Pose, velocity: Velocity) -> Result:
        p = self.parameters
        new_plan = self._plan_if_due(now, robot)
        if self._followed is None:
            hopeless = self._hopeless_goal()
            if hopeless:
                return self._abort(robot, hopeless)
            waited = now - self._work.planned_well
            retries = self._work.failed_plans - 1
            if waited >= p.planner_patience or 0 <= p.max_planning_retries < retries:
                tried = f"no plan for {waited:.1f} s, {retries} retries: {self._work.planning_error}"
                return self._start_recovery(now, robot, tried)
            return Result(velocity=STOP, robot=robot, warning=f"No plan: {self._work.planning_error}")
        self.state = State.CONTROLLING
        if self._oscillating(now, robot):
            return self._start_recovery(
                now, robot, f"moved less than {p.oscillation_distance:g} m in {p.oscillation_timeout:g} s", new_plan
            )
        return replace(self._control(now, frames, robot, local_robot, velocity), new_plan=new_plan)

    def _control(
        self,
        now: float,
        frames: Transformer,
        robot: Pose,
        local_robot: Pose,
        velocity: Velocity,
    ) -> Result:
        assert self._followed is not None  # noqa: S101
        ahead, to_goal = self._followed.ahead(robot)
        path = self._in_local_frame(ahead, frames)
        if path is None or self._local.snapshot is None:
            return Result(velocity=STOP, robot=robot, warning="No transform for the plan")
        trajectory = self._controller.follow(local_robot, velocity, path, to_goal, self._local.snapshot)
        if trajectory is not None:
            self._work.controlled = now
            return Result(velocity=trajectory.velocity, robot=robot, path=path, trajectory=trajectory)
        patience = self.parameters.controller_patience
        if now - self._work.controlled >= patience:
            return self._start_recovery(now, robot, f"no free velocity for {patience:g} s")
        return Result(velocity=STOP, robot=robot, warning="No free velocity", path=path)

    # -- planning --------------------------------------------------------------------------------------------------

    def _plan_if_due(self, now: float, robot: Pose) -> Plan | None:
        """Plan at planner_frequency, or at once if there is no plan; return a newly accepted plan.

        Where a plan takes longer than two control periods, a robot that drives plans less often.
        """
        p = self.parameters
        period = 1.0 / p.planner_frequency if p.planner_frequency > 0.0 else math.inf
        stuck = now - self._work.controlled > max(1.0, 2.0 * self._plan_took)
        if self._followed is None or stuck:  # look for another way
            period = min(period, 0.25)
        elif self._plan_took > 2.0 / p.controller_frequency:
            period = max(period, self._plan_took / PLANNING_SHARE)
        if now - self._work.planned < period - 1e-3:
            return None
        self._work.planned = self._planning_since = now
        assert self.goal is not None  # noqa: S101
        try:
            plan = self.plan_between(robot, self.goal, max(p.controller.xy_goal_tolerance, p.default_tolerance))
        except PlanningError as error:
            self._work.planning_error = str(error)
            self._work.failed_plans += 1
            if not self._plan_is_free(robot):
                self._followed = None
            return None
        self._work.planned_well = now
        self._work.failed_plans = 0
        if self._keeps_plan(robot, plan):
            return None
        self._followed = FollowedPlan(plan)
        return plan

    def _plan_is_free(self, robot: Pose) -> bool:
        if self._followed is None or self._global.snapshot is None:
            return False
        return (
            self._followed.cost_left(robot, self._global.snapshot, allow_unknown=self.parameters.allow_unknown)
            < math.inf
        )

    def _keeps_plan(self, robot: Pose, plan: Plan) -> bool:
        if self._followed is None or self._global.snapshot is None:
            return False
        allow_unknown = self.parameters.allow_unknown
        return self._followed.is_better_than(plan, robot, self._global.snapshot, allow_unknown=allow_unknown)

    def _in_local_frame(self, path: NDArray[np.float64], frames: Transformer) -> NDArray[np.float64] | None:
        """Return points (N, 2) of the global frame in the local one, or None without a transform."""
        local, planned = self._local.parameters.global_frame, self._global.parameters.global_frame
        if local == planned:
            return path
        matrix = frames.lookup(local, planned, None)
        return None if matrix is None else Pose.from_matrix(matrix).apply(path)

    def _hopeless_goal(self) -> str:
        """Return why neither waiting nor recovery can help, or an empty text: the goal is off the map or in a wall."""
        assert self.goal is not None  # noqa: S101
        snapshot = self._global.snapshot
        if snapshot is None:
            return ""
        goal = self.goal
        if not snapshot.geometry.contains(goal.x, goal.y):
            return f"the goal ({goal.x:.2f}, {goal.y:.2f}) is outside the map"
        if self._global.costmap.static_cost(goal.x, goal.y) == LETHAL:
            return f"the goal ({goal.x:.2f}, {goal.y:.2f}) is in a wall of the map"
        return ""

    # -- recovery --------------------------------------------------------------------------------------------------

    def _oscillating(self, now: float, robot: Pose) -> bool:
        p = self.parameters
        if self._work.anchor is None or robot.distance(self._work.anchor) >= p.oscillation_distance:
            self._work.anchor, self._work.anchored = robot, now
            self._work.recovery.follow(robot)
        return p.oscillation_timeout > 0.0 and now - self._work.anchored > p.oscillation_timeout

    def _start_recovery(self, now: float, robot: Pose, reason: str, new_plan: Plan | None = None) -> Result:
        """Begin the next recovery behaviour; abort with the reason when all were tried."""
        p = self.parameters
        behaviour = None
        if p.recovery_behavior_enabled:
            behaviour = self._work.recovery.begin(p.recovery_behaviors, now, robot)
        if behaviour is None:
            tried = "after all recovery behaviours" if p.recovery_behavior_enabled else "recovery is disabled"
            return self._abort(robot, f"{reason} ({tried})")
        self.state = State.RECOVERING
        warning = f"Recovery {behaviour.name}: {reason}"
        status = RecoveryStatus(behaviour.name, self._work.recovery.tried - 1, len(p.recovery_behaviors))
        return Result(velocity=STOP, robot=robot, warning=warning, new_plan=new_plan, recovery=status)

    def _recover(self, now: float, robot: Pose, local_robot: Pose) -> Result:
        recovery = self._work.recovery
        assert recovery.behaviour is not None  # noqa: S101
        if recovery.behaviour.kind == "rotate":
            angle = min(recovery.left_to_turn(now, robot), 0.5 * ROTATE_SPEED)
            snapshot = self._local.snapshot
            turn = self._controller.turn(local_robot, angle, snapshot) if snapshot and angle else None
            if turn is not None:
                return Result(velocity=turn.velocity, robot=robot, trajectory=turn)
        else:
            behaviour = recovery.behaviour
            for costmap, area, pose in (("global", self._global, robot), ("local", self._local, local_robot)):
                if behaviour.affects(costmap):
                    area.costmap.clear(
                        pose,
                        0.5 * behaviour.reset_distance,
                        layers=behaviour.layer_names,
                        inside=behaviour.invert_area_to_clear,
                    )
        self.state = State.PLANNING
        self._followed = None
        self._work.planned = -math.inf
        self._work.restart_patience(now)
        return Result(velocity=STOP, robot=robot)

    # -- ends and clocks -------------------------------------------------------------------------------------------

    def _abort(self, robot: Pose | None, reason: str) -> Result:
        return self._end(robot, Outcome.ABORTED, reason)

    def _end(self, robot: Pose | None, outcome: Outcome, text: str) -> Result:
        self.cancel()
        return Result(velocity=STOP, robot=robot, outcome=outcome, text=text)
