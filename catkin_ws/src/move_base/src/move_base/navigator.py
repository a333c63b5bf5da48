"""The navigation state machine: goal in, velocity or outcome out. It knows no ROS and is told the time.

    IDLE -> PLANNING -> CONTROLLING -> IDLE (succeeded, aborted, cancelled)
               ^ |           |
               | v           v
              RECOVERING <----

Whatever the state, nothing moves on sensor data that are too old, nor without a map or a transform.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Protocol

import numpy as np

from move_base.costmap import LETHAL, Costmap, Snapshot
from move_base.dwa import DwaController, Trajectory
from move_base.geometry import STOP, Pose, Velocity, wrap_angle
from move_base.global_planner import PATH_SPACING, Plan, PlanningError, make_plan, path_cost
from move_base.recovery import Recovery

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.costmap import StaticMap
    from move_base.parameters import CostmapParameters, MoveBaseParameters, ObservationSource
    from move_base.sensors import Observation

LOOKAHEAD = 3.0
"""Length of the plan that the controller is given, m: twice what 0.75 m/s covers in a sim_time of 2 s."""

PATH_STEP = 2
"""The controller is given every second point of the plan (0.1 m)."""

KEEP_RATIO = 0.9
"""A new plan replaces a free one only if it costs less than this share of it: equal ways must not alternate."""

KEEP_DISTANCE = 0.3
"""Farther than this from its plan (m) the robot takes the new one in any case."""

FUTURE_LIMIT = 0.5
"""A measurement whose stamp is this far ahead of the clock (s) is not believed."""

KEPT_OBSERVATIONS = 5
"""Per source: as many as can be waiting for their transform at any usual rate."""

ROTATE_SPEED = 1.0
"""Speed of the recovery's turn, rad/s: rotate_recovery's default."""

QUIET_WAIT = 0.5
"""Waiting is worth a warning after this time, s: the first messages after a start take a few tenths."""


class State(Enum):
    """What the navigator is doing."""

    IDLE = "idle"
    PLANNING = "planning"
    CONTROLLING = "controlling"
    RECOVERING = "recovering"


class Outcome(Enum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"


class Transformer(Protocol):
    """Access to the tree of frames."""

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Returns the 4 x 4 transform from `source` to `target` at a time (None: newest), or None if there is none."""

    def newest(self, target: str, source: str) -> float | None:
        """Returns the time of the newest transform between two frames, s; None where they are not connected."""


@dataclass(frozen=True)
class Result:
    """What one step decided.

    Attributes:
        velocity: the command; None where nothing is to be sent.
        robot: pose in the global frame, if known.
        outcome: set when the goal has just ended.
        text: the reason of the outcome.
        warning: something the operator should know; repeated as long as it holds.
        new_plan: the plan, where a new one was taken.
        path: what the controller followed, in the local frame.
        trajectory: what it chose.
    """

    velocity: Velocity | None = None
    robot: Pose | None = None
    outcome: Outcome | None = None
    text: str = ""
    warning: str = ""
    new_plan: Plan | None = None
    path: NDArray[np.float64] | None = None
    trajectory: Trajectory | None = None


@dataclass
class _Sensor:
    """What is known of one source."""

    source: ObservationSource
    recent: list[Observation] = field(default_factory=list)
    used: float = -math.inf  # stamp of the newest observation in a costmap

    def newest(self, after: float, target: str, frames: Transformer) -> tuple[Observation, NDArray[np.float64]] | None:
        """Returns the newest observation later than `after` that can be transformed."""
        for observation in reversed(self.recent):
            if observation.stamp <= after:
                return None
            transform = frames.lookup(target, observation.frame, observation.stamp)
            if transform is not None:
                return observation, transform
        return None

    def trouble(self, now: float) -> str:
        """Why nothing current of it is in a costmap, or an empty text.

        The age that counts is that of the newest measurement in a costmap, not of one that can't be transformed.
        """
        period = self.source.expected_update_rate
        if now - self.used <= period:
            return ""
        if self.recent and now - self.recent[-1].stamp <= period:
            return f"no transform for {self.source.topic} from its frame {self.recent[-1].frame!r}"
        return f"no current data from {self.source.topic}"


@dataclass
class _Work:
    """What is remembered for one goal; times in s.

    Attributes:
        planned_well: last time that a plan was found, or that waiting for one began.
        controlled: the same for a free velocity.
        anchored: when the robot was at `anchor`, which follows it by steps of the oscillation distance.
        anchor: see above.
        planned: when planning was last tried.
        planning_error: why it failed.
        failed_plans: how often, since `planned_well`.
        progress: index of the plan's point nearest to the robot.
        stale_since: since when sensor data are too old.
        not_ready_since: since when map or transforms are missing.
        reached_xy: whether the robot was within the goal's position tolerance.
        recovery: what was tried against being stuck.
    """

    planned_well: float
    controlled: float
    anchored: float
    anchor: Pose | None = None
    planned: float = -math.inf
    planning_error: str = ""
    failed_plans: int = 0
    progress: int = 0
    stale_since: float | None = None
    not_ready_since: float | None = None
    reached_xy: bool = False
    recovery: Recovery = field(default_factory=Recovery)

    @classmethod
    def begun(cls, now: float) -> _Work:
        return cls(planned_well=now, controlled=now, anchored=now)

    def restart_patience(self, now: float) -> None:
        """Starts planner's, controller's and oscillation's patience anew; also while the robot has to stand still."""
        self.planned_well = self.controlled = self.anchored = now
        self.failed_plans = 0
        self.anchor = None


class _MappedArea:
    """A costmap with its rate and the stamps of what it has used."""

    def __init__(self, parameters: CostmapParameters) -> None:
        self.parameters = parameters
        self.costmap = Costmap(parameters)
        self.snapshot: Snapshot | None = None
        self.updated = -math.inf
        self.used: dict[tuple[str, str], float] = {}

    def due(self, now: float) -> bool:
        return self.snapshot is None or now - self.updated >= 1.0 / self.parameters.update_frequency - 1e-3


class Navigator:
    """Costmaps, planner, controller and recovery behind one `step`."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.parameters = parameters
        self.state = State.IDLE
        self.goal: Pose | None = None
        self.plan: Plan | None = None
        self._global = _MappedArea(parameters.global_costmap)
        self._local = _MappedArea(parameters.local_costmap)
        sources = [*parameters.global_costmap.sources, *parameters.local_costmap.sources]
        self._sensors = {(source.topic, source.data_type): _Sensor(source) for source in sources}
        self._controller = DwaController(parameters)
        self._map_frame = ""
        self._work = _Work.begun(0.0)

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Takes other parameters on the way: goal, plan and obstacles stay, and so does the robot's speed.

        Frames, sizes and sensors are the same as before (`move_base.reconfiguration` offers no others).
        """
        self.parameters = parameters
        for area, new in ((self._global, parameters.global_costmap), (self._local, parameters.local_costmap)):
            if new != area.parameters:
                area.parameters = new
                area.costmap.reconfigure(new)
                area.updated = -math.inf
        self._controller.reconfigure(parameters)

    # -- what comes in ---------------------------------------------------------------------------------------------

    @property
    def sources(self) -> list[ObservationSource]:
        """The sources to listen to, each topic once."""
        return [sensor.source for sensor in self._sensors.values()]

    @property
    def global_snapshot(self) -> Snapshot | None:
        """The newest global costmap."""
        return self._global.snapshot

    @property
    def local_snapshot(self) -> Snapshot | None:
        """The newest local costmap."""
        return self._local.snapshot

    def set_map(self, static: StaticMap, frame: str) -> None:
        """Takes the static map."""
        self._map_frame = frame.removeprefix("/")
        for area in (self._global, self._local):
            area.costmap.set_map(static)
            area.snapshot = None

    def observe(self, observation: Observation, now: float) -> str:
        """Takes a measurement.

        Returns:
            Why it was ignored, or an empty text.
        """
        sensor = self._sensors[(observation.source.topic, observation.source.data_type)]
        if observation.stamp > now + FUTURE_LIMIT:
            return f"{observation.source.topic}: the stamp is more than {FUTURE_LIMIT:g} s ahead of the clock"
        if sensor.recent and observation.stamp <= sensor.recent[-1].stamp:
            return f"{observation.source.topic}: the stamp is not newer than the last message's"
        sensor.recent = [*sensor.recent[1 - KEPT_OBSERVATIONS :], observation]
        return ""

    def set_goal(self, goal: Pose, now: float) -> None:
        """Starts on a goal in the global frame, in place of the present one."""
        self.goal = goal
        self.plan = None
        self.state = State.PLANNING
        self._controller.reset()
        self._work = _Work.begun(now)

    def cancel(self) -> None:
        """Drops the goal; the caller stops the robot."""
        self.goal = None
        self.plan = None
        self.state = State.IDLE

    def clear_costmaps(self) -> None:
        """Forgets all obstacles but those of the static map."""
        self._global.costmap.clear()
        self._local.costmap.clear()

    def reset_time(self, now: float) -> None:
        """Forgets all stamps, after the clock was set back; the goal stays."""
        for sensor in self._sensors.values():
            sensor.recent, sensor.used = [], -math.inf
        for area in (self._global, self._local):
            area.updated, area.used = -math.inf, {}
        self._work = _Work.begun(now)

    # -- the step --------------------------------------------------------------------------------------------------

    def step(self, now: float, frames: Transformer, velocity: Velocity) -> Result:
        """Updates the costmaps where they are due, and decides.

        Args:
            now: time in s.
            frames: the transforms.
            velocity: of the base, measured, in its own frame.
        """
        robot = self._robot_pose(self._global, now, frames)
        local_robot = self._robot_pose(self._local, now, frames)
        missing = self._update_costmaps(now, frames, robot, local_robot)
        if self.goal is None:
            return Result(robot=robot)
        if missing or robot is None or local_robot is None:
            return self._not_ready(now, robot, missing or self._missing_transform(robot))
        self._work.not_ready_since = None
        stale = self._stale_reason(now)
        if stale:
            return self._hold(now, robot, stale)
        self._fresh_again(now)
        if self._at_goal(robot):
            return self._turn_to_goal(now, robot, local_robot)
        if self.state is State.RECOVERING:
            return self._recover(now, robot, local_robot)
        return self._drive(now, frames, robot, local_robot, velocity)

    def plan_between(self, start: Pose, goal: Pose, tolerance: float) -> Plan:
        """Plans on the newest global costmap.

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

    def _robot_pose(self, area: _MappedArea, now: float, frames: Transformer) -> Pose | None:
        """Returns the robot's pose in the area's frame; None where there is none, or it is too old."""
        p = area.parameters
        matrix = frames.lookup(p.global_frame, p.robot_base_frame, None)
        stamp = frames.newest(p.global_frame, p.robot_base_frame)
        if matrix is None or stamp is None or now - stamp > p.transform_tolerance:
            return None
        return Pose.from_matrix(matrix)

    def _update_costmaps(self, now: float, frames: Transformer, robot: Pose | None, local: Pose | None) -> str:
        """Updates what is due, and returns what is missing for it."""
        for area, pose in ((self._local, local), (self._global, robot)):
            if area.costmap.needs_map:
                return f"no map received on {self._map_topic(area)}"
            if pose is None or not area.due(now):
                continue
            map_pose = self._map_pose(area, frames)
            if map_pose is None:
                return f"no transform from {self._map_frame!r} to {area.parameters.global_frame!r}"
            observations = []
            for source in area.parameters.sources:
                key = (source.topic, source.data_type)
                found = self._sensors[key].newest(area.used.get(key, -math.inf), area.parameters.global_frame, frames)
                if found is not None:
                    observations.append(found)
                    area.used[key] = found[0].stamp
                    self._sensors[key].used = max(self._sensors[key].used, found[0].stamp)
            area.snapshot = area.costmap.update(pose, observations, map_pose)
            # Rates are kept on average even if steps and updates do not divide evenly.
            period = 1.0 / area.parameters.update_frequency
            area.updated = max(area.updated + period, now - period) if math.isfinite(area.updated) else now
        return ""

    def _map_topic(self, area: _MappedArea) -> str:
        return next((layer.map_topic for layer in area.parameters.layers if layer.kind == "static"), "map")

    def _map_pose(self, area: _MappedArea, frames: Transformer) -> Pose | None:
        """Pose of the map's frame in the area's frame."""
        if not self._map_frame or self._map_frame == area.parameters.global_frame:
            return Pose(0.0, 0.0, 0.0)
        matrix = frames.lookup(area.parameters.global_frame, self._map_frame, None)
        return None if matrix is None else Pose.from_matrix(matrix)

    def _missing_transform(self, robot: Pose | None) -> str:
        p = (self._global if robot is None else self._local).parameters
        return f"no current transform from {p.robot_base_frame!r} to {p.global_frame!r}"

    def _not_ready(self, now: float, robot: Pose | None, reason: str) -> Result:
        if self._work.not_ready_since is None:
            self._work.not_ready_since = now
        waited = now - self._work.not_ready_since
        self._work.restart_patience(now)
        if waited >= max(self.parameters.planner_patience, 5.0):
            return self._abort(robot, f"{reason} for {waited:.1f} s")
        return Result(velocity=STOP, robot=robot, warning=f"Waiting: {reason}" if waited > QUIET_WAIT else "")

    def _stale_reason(self, now: float) -> str:
        """Names the first source whose data are too old, or returns an empty text."""
        return next(filter(None, (sensor.trouble(now) for sensor in self._sensors.values())), "")

    def _hold(self, now: float, robot: Pose, reason: str) -> Result:
        """Stands still on old data: neither drives nor turns, and no other patience runs meanwhile."""
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
        target = self.plan.goal if self.plan is not None else self.goal
        if robot.distance(target) <= p.xy_goal_tolerance:
            self._work.reached_xy = True
            return True
        return self._work.reached_xy and p.latch_xy_goal_tolerance

    def _turn_to_goal(self, now: float, robot: Pose, local_robot: Pose) -> Result:
        assert self.goal is not None  # noqa: S101
        error = wrap_angle(self.goal.yaw - robot.yaw)
        if abs(error) <= self.parameters.controller.yaw_goal_tolerance:
            return self._end(robot, Outcome.SUCCEEDED, "Goal reached.")
        snapshot = self._local.snapshot
        turn = self._controller.turn(local_robot, error, snapshot) if snapshot is not None else None
        if turn is None:
            if now - self._work.controlled >= self.parameters.controller_patience:
                return self._abort(robot, "there is no room to turn to the goal's heading")
            return Result(velocity=STOP, robot=robot, warning="No room to turn to the goal's heading")
        self._work.controlled = now
        return Result(velocity=turn.velocity, robot=robot, trajectory=turn)

    def _drive(self, now: float, frames: Transformer, robot: Pose, local_robot: Pose, velocity: Velocity) -> Result:
        p = self.parameters
        new_plan = self._plan_if_due(now, robot)
        if self.plan is None:
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
        path, to_goal = self._path_ahead(robot, frames)
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
        """Plans at planner_frequency, and at once where there is no plan; returns a plan that was newly taken."""
        p = self.parameters
        period = 1.0 / p.planner_frequency if p.planner_frequency > 0.0 else math.inf
        if self.plan is None or now - self._work.controlled > 1.0:  # the controller is stuck: look for another way
            period = min(period, 0.25)
        if now - self._work.planned < period - 1e-3:
            return None
        self._work.planned = now
        assert self.goal is not None  # noqa: S101
        try:
            plan = self.plan_between(robot, self.goal, max(p.controller.xy_goal_tolerance, p.default_tolerance))
        except PlanningError as error:
            self._work.planning_error = str(error)
            self._work.failed_plans += 1
            if not self._plan_is_free(robot):
                self.plan = None
            return None
        self._work.planned_well = now
        self._work.failed_plans = 0
        if self._keeps_plan(robot, plan):
            return None
        self.plan, self._work.progress = plan, 0
        return plan

    def _plan_is_free(self, robot: Pose) -> bool:
        return self._remaining_cost(robot) < math.inf

    def _remaining_cost(self, robot: Pose) -> float:
        """Cost of what remains of the present plan, in weighted metres; infinite where it is blocked or far away."""
        if self.plan is None or self._global.snapshot is None:
            return math.inf
        self._advance(robot)
        points = self.plan.points[self._work.progress :]
        if math.hypot(points[0, 0] - robot.x, points[0, 1] - robot.y) > KEEP_DISTANCE:
            return math.inf
        return path_cost(points, self._global.snapshot, allow_unknown=self.parameters.allow_unknown)

    def _keeps_plan(self, robot: Pose, plan: Plan) -> bool:
        if self.plan is None or self.plan.goal != plan.goal or self._global.snapshot is None:
            return False
        kept = self._remaining_cost(robot)
        new = path_cost(plan.points, self._global.snapshot, allow_unknown=self.parameters.allow_unknown)
        return kept < math.inf and new > KEEP_RATIO * kept

    def _advance(self, robot: Pose) -> None:
        """Moves the progress along the plan to its nearest point within the next few metres."""
        assert self.plan is not None  # noqa: S101
        window = self.plan.points[self._work.progress : self._work.progress + 60]
        squared = (window[:, 0] - robot.x) ** 2 + (window[:, 1] - robot.y) ** 2
        self._work.progress += int(squared.argmin())

    def _path_ahead(self, robot: Pose, frames: Transformer) -> tuple[NDArray[np.float64] | None, float]:
        """Returns the next metres of the plan in the local frame, and the length left to the goal (m)."""
        assert self.plan is not None  # noqa: S101
        self._advance(robot)
        points = self.plan.points[self._work.progress :]
        to_goal = float(np.hypot(*np.diff(points, axis=0).T).sum())
        count = round(LOOKAHEAD / PATH_SPACING)
        ahead = points[: count + 1 : PATH_STEP]
        if len(points) <= count or len(ahead) < 2:
            ahead = np.vstack([ahead, points[-1:]])
        local, planned = self._local.parameters.global_frame, self._global.parameters.global_frame
        if local == planned:
            return ahead, to_goal
        matrix = frames.lookup(local, planned, None)
        return (None if matrix is None else Pose.from_matrix(matrix).apply(ahead)), to_goal

    def _hopeless_goal(self) -> str:
        """Why waiting or recovery can't help: the goal is outside the map or in one of its walls."""
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
        """Begins the next recovery behaviour; aborts with the reason when all were tried."""
        p = self.parameters
        behaviour = None
        if p.recovery_behavior_enabled:
            behaviour = self._work.recovery.begin(p.recovery_behaviors, now, robot)
        if behaviour is None:
            tried = "after all recovery behaviours" if p.recovery_behavior_enabled else "recovery is disabled"
            return self._abort(robot, f"{reason} ({tried})")
        self.state = State.RECOVERING
        warning = f"Recovery {behaviour.name}: {reason}"
        return Result(velocity=STOP, robot=robot, warning=warning, new_plan=new_plan)

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
            keep = 0.5 * recovery.behaviour.reset_distance
            self._global.costmap.clear(robot, keep)
            self._local.costmap.clear(local_robot, keep)
        self.state = State.PLANNING
        self.plan = None
        self._work.planned = -math.inf
        self._work.restart_patience(now)
        return Result(velocity=STOP, robot=robot)

    # -- ends and clocks -------------------------------------------------------------------------------------------

    def _abort(self, robot: Pose | None, reason: str) -> Result:
        return self._end(robot, Outcome.ABORTED, reason)

    def _end(self, robot: Pose | None, outcome: Outcome, text: str) -> Result:
        self.cancel()
        return Result(velocity=STOP, robot=robot, outcome=outcome, text=text)
