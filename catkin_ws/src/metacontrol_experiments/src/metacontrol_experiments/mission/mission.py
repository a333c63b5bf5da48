"""A mission as a state machine: when the perturbation strikes, how far the robot is, when and why the mission is over.

Nothing here knows ROS or a clock: poses, goal states and times are handed in, and every step returns the next state and
what is to be done now. Times are in simulated seconds, positions in metres in the map frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.metrics import TIMEOUT_S

from metacontrol_experiments.contingency.contingency import Contingency, strikes_due

ACKNOWLEDGE_S = 5.0
"""A goal that no status message lists after this time is sent again, under the same id."""

LOST_S = 10.0
"""A goal that was listed and no longer is, is given up after this time without a reconfiguration."""

SETTLE_S = 3.0
"""After a reconfiguration, the time in which a goal that had ended badly during it may be taken up again."""

MIN_DISTANCE_M = 0.5
"""A goal nearer than this is no mission: the share of the way done means nothing."""


class MissionError(ValueError):
    """The mission cannot be run as asked for."""


class Outcome(Enum):
    """How a mission ended."""

    REACHED = "reached"
    ABORTED = "aborted"
    TIMEOUT = "timeout"
    INTERRUPTED = "interrupted"


class Action(Enum):
    """What the shell has to do now."""

    RESEND_GOAL = "resend_goal"
    CANCEL_GOAL = "cancel_goal"


@dataclass(frozen=True)
class Strike:
    """The shell has to let one of the plan's contingencies strike now."""

    index: int


@dataclass(frozen=True)
class Plan:
    """What a mission is to do.

    Attributes:
        goal_x: goal, m in the map frame.
        goal_y: goal, m in the map frame.
        contingencies: what goes wrong on the way, and when.
        timeout_s: simulated seconds after which the mission has failed.
    """

    goal_x: float
    goal_y: float
    contingencies: tuple[Contingency, ...] = ()
    timeout_s: float = TIMEOUT_S

    def distance(self, x: float, y: float) -> float:
        """Euclidean distance to the goal in m."""
        return math.hypot(self.goal_x - x, self.goal_y - y)


@dataclass(frozen=True)
class State:
    """Where a mission stands.

    Attributes:
        started_s: when the goal was sent.
        initial_m: distance to the goal at the start.
        distance_m: distance to the goal now.
        x: position of the robot, m in the map frame.
        y: position of the robot, m in the map frame.
        struck: indices of the contingencies that have struck.
        stable: whether the manipulator reports every function as STABLE.
        stable_since_s: since when; the start of the mission if it always was.
        asked_s: when the goal was last sent.
        seen_s: when a status message last listed the goal as live, None before the first.
        bad_end: the state and text of a goal that ended badly while the system was being reconfigured.
        outcome: None until the mission is over.
        reason: why it is over, one line.
        ended_s: when it was over.
    """

    started_s: float
    initial_m: float
    distance_m: float
    x: float
    y: float
    struck: frozenset[int] = frozenset()
    stable: bool = True
    stable_since_s: float = 0.0
    asked_s: float = 0.0
    seen_s: float | None = None
    bad_end: tuple[GoalStatus, str] | None = None
    outcome: Outcome | None = None
    reason: str = ""
    ended_s: float | None = None

    @property
    def share(self) -> float:
        """Share of the way done, Euclidean, never below 0."""
        return max(0.0, (self.initial_m - self.distance_m) / self.initial_m)

    @property
    def over(self) -> bool:
        """Whether the mission is over."""
        return self.outcome is not None


Step = tuple[State, tuple[Action | Strike, ...]]
"""The next state and what to do now."""


def start(plan: Plan, now_s: float, x: float, y: float) -> State:
    """The state of a mission whose goal is sent now; the contingencies of the start have struck already.

    Args:
        plan: what the mission is to do.
        now_s: simulated time.
        x: position of the robot, m in the map frame.
        y: position of the robot, m in the map frame.

    Raises:
        MissionError: the goal is where the robot stands already, or a position is not finite.
    """
    distance = plan.distance(x, y)
    if not math.isfinite(distance):
        raise MissionError(f"robot at ({x}, {y}), goal at ({plan.goal_x}, {plan.goal_y}): not finite")
    if distance < MIN_DISTANCE_M:
        raise MissionError(
            f"goal ({plan.goal_x:.2f}, {plan.goal_y:.2f}) is {distance:.2f} m from the robot; "
            f"choose a route of at least {MIN_DISTANCE_M} m"
        )
    return State(
        started_s=now_s,
        initial_m=distance,
        distance_m=distance,
        x=x,
        y=y,
        struck=frozenset(index for index, entry in enumerate(plan.contingencies) if entry.when.at_start),
        stable_since_s=now_s,
        asked_s=now_s,
    )


def on_pose(plan: Plan, state: State, now_s: float, x: float, y: float) -> Step:
    """A new position of the robot (m, map frame); contingencies strike once their share or place is reached."""
    if state.over or not (math.isfinite(x) and math.isfinite(y)):
        return state, ()
    return _strike(plan, replace(state, distance_m=plan.distance(x, y), x=x, y=y), now_s)


def on_goal_status(state: State, now_s: float, status: GoalStatus | None) -> Step:
    """A status message of the action server.

    Args:
        state: the mission so far.
        now_s: simulated time.
        status: the state of our goal in it, None where it does not list our goal.
    """
    if state.over or status is None or not status.live:
        return state, ()
    return replace(state, seen_s=now_s, bad_end=None), ()


def on_goal_result(state: State, now_s: float, status: GoalStatus, text: str) -> Step:
    """The server's result for our goal.

    A bad end while the system is being reconfigured is kept back: a restarted server may take the same goal up again.
    """
    if state.over:
        return state, ()
    if status is GoalStatus.SUCCEEDED:
        return _end(state, now_s, Outcome.REACHED, "goal reached")
    if not state.stable:
        return replace(state, bad_end=(status, text)), ()
    return _end(state, now_s, Outcome.ABORTED, _bad_end_reason(status, text))


def on_configuration(state: State, now_s: float, stable: bool) -> Step:
    """The manipulator's report: whether every function is STABLE."""
    if state.over or stable == state.stable:
        return state, ()
    return replace(state, stable=stable, stable_since_s=now_s), ()


def on_time(plan: Plan, state: State, now_s: float) -> Step:
    """Simulated time has gone on: time-out, contingencies, goals that were never accepted or got lost."""
    if state.over:
        return state, ()
    if now_s - state.started_s > plan.timeout_s:
        reason = f"goal not reached within {plan.timeout_s:g} s, {state.distance_m:.1f} m were left"
        return _end(state, now_s, Outcome.TIMEOUT, reason, (Action.CANCEL_GOAL,))
    state, strikes = _strike(plan, state, now_s)
    if state.stable:
        state, actions = _follow_goal(state, now_s)
        return state, (*strikes, *actions)
    return state, strikes


def interrupt(state: State, now_s: float, reason: str) -> State:
    """The mission was broken off from outside."""
    return state if state.over else _end(state, now_s, Outcome.INTERRUPTED, reason)[0]


def abort(state: State, now_s: float, reason: str) -> State:
    """The mission cannot go on, for instance because the simulator is gone."""
    return state if state.over else _end(state, now_s, Outcome.ABORTED, reason)[0]


def _strike(plan: Plan, state: State, now_s: float) -> Step:
    """Lets the contingencies strike whose moment has come."""
    due = strikes_due(plan.contingencies, state.struck, state.share, now_s - state.started_s, state.x, state.y)
    if not due:
        return state, ()
    return replace(state, struck=state.struck | set(due)), tuple(Strike(index) for index in due)


def _follow_goal(state: State, now_s: float) -> Step:
    """Looks after a goal that the server does not list, while nothing is being reconfigured."""
    if state.bad_end is not None:
        if now_s - state.stable_since_s > SETTLE_S:
            return _end(state, now_s, Outcome.ABORTED, _bad_end_reason(*state.bad_end))
    elif state.seen_s is None:
        if now_s - state.asked_s > ACKNOWLEDGE_S:
            return replace(state, asked_s=now_s), (Action.RESEND_GOAL,)
    elif now_s - max(state.seen_s, state.stable_since_s) > LOST_S:
        reason = f"the action server has not listed the goal for {LOST_S:g} s"
        return _end(state, now_s, Outcome.ABORTED, reason, (Action.CANCEL_GOAL,))
    return state, ()


def _end(state: State, now_s: float, outcome: Outcome, reason: str, actions: tuple[Action, ...] = ()) -> Step:
    return replace(state, outcome=outcome, reason=reason, ended_s=now_s), actions


def _bad_end_reason(status: GoalStatus, text: str) -> str:
    return f"move_base: goal {status.name.lower()}" + (f": {text}" if text else "")
