"""A mission as a state machine: how far the robot is, which contingencies are due, when and why the mission is over.

The caller hands in poses, goal states and times. Every function returns the next state and what is to be done now.
Times are in simulated seconds, positions in metres in the map frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.metrics import TIMEOUT_S

from metacontrol_experiments.contingency.contingency import Contingency, contingencies_due

ACKNOWLEDGE_S = 5.0
"""Seconds after which a goal that no status message lists is sent again, under the same id."""

LOST_S = 10.0
"""Seconds without a reconfiguration after which a goal that is no longer listed is given up."""

SETTLE_S = 3.0
"""Seconds after a reconfiguration in which a restarted server may take a goal up again that had ended badly."""

MIN_DISTANCE_M = 0.5
"""A nearer goal makes no mission: the share of the way done would mean nothing."""


class MissionError(ValueError):
    """The mission cannot be run as asked for."""


class Outcome(Enum):
    """How a mission ended."""

    REACHED = "reached"
    ABORTED = "aborted"
    TIMEOUT = "timeout"
    INTERRUPTED = "interrupted"


class Action(Enum):
    """What the caller has to do now."""

    RESEND_GOAL = "resend_goal"
    CANCEL_GOAL = "cancel_goal"


@dataclass(frozen=True)
class Inject:
    """The caller must make one of the plan's contingencies happen now."""

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
        injected: indices of the contingencies that have injected.
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
    injected: frozenset[int] = frozenset()
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


Step = tuple[State, tuple[Action | Inject, ...]]
"""The next state and what to do now."""


def start(plan: Plan, now_s: float, x: float, y: float) -> State:
    """Return the state of a mission whose goal is sent now; the contingencies of the start have happened already.

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
        injected=frozenset(index for index, entry in enumerate(plan.contingencies) if entry.when.at_start),
        stable_since_s=now_s,
        asked_s=now_s,
    )


def on_pose(plan: Plan, state: State, now_s: float, x: float, y: float) -> Step:
    """Take in a position of the robot (m, map frame): contingencies happen once their share or place is reached."""
    if state.over or not (math.isfinite(x) and math.isfinite(y)):
        return state, ()
    return _inject(plan, replace(state, distance_m=plan.distance(x, y), x=x, y=y), now_s)


def on_goal_status(state: State, now_s: float, status: GoalStatus | None) -> Step:
    """Take in a status message of the action server.

    Args:
        state: the mission so far.
        now_s: simulated time.
        status: the state of our goal in it, None where it does not list our goal.
    """
    if status is GoalStatus.SUCCEEDED:  # its result may be missed, which is told only once
        return on_goal_result(state, now_s, status, "")
    if state.over or status is None or not status.live:
        return state, ()
    return replace(state, seen_s=now_s, bad_end=None), ()


def on_goal_result(state: State, now_s: float, status: GoalStatus, text: str) -> Step:
    """Take in the server's result for our goal.

    A bad end during a reconfiguration does not count yet: a restarted server may take the same goal up again.
    """
    if state.over:
        return state, ()
    if status is GoalStatus.SUCCEEDED:
        return _end(state, now_s, Outcome.REACHED, "goal reached")
    if not state.stable:
        return replace(state, bad_end=(status, text)), ()
    return _end(state, now_s, Outcome.ABORTED, _bad_end_reason(status, text))


def on_configuration(state: State, now_s: float, stable: bool) -> Step:
    """Take in whether the manipulator reports every function as STABLE."""
    if state.over or stable == state.stable:
        return state, ()
    return replace(state, stable=stable, stable_since_s=now_s), ()


def on_time(plan: Plan, state: State, now_s: float) -> Step:
    """Take in the simulated time: see to the time-out, contingencies, goals that were never accepted or got lost."""
    if state.over:
        return state, ()
    if now_s - state.started_s > plan.timeout_s:
        reason = f"goal not reached within {plan.timeout_s:g} s, {state.distance_m:.1f} m were left"
        return _end(state, now_s, Outcome.TIMEOUT, reason, (Action.CANCEL_GOAL,))
    state, strikes = _inject(plan, state, now_s)
    if state.stable:
        state, actions = _follow_goal(state, now_s)
        return state, (*strikes, *actions)
    return state, strikes


def on_jump(state: State, now_s: float, by_s: float) -> State:
    """Take in that the time has jumped: what was waited for has not been waited for any longer.

    Args:
        state: the mission so far.
        now_s: simulated time after the jump.
        by_s: how far it has jumped; below 0, back.
    """

    def moved(moment: float) -> float:
        return min(moment + by_s, now_s)

    seen = None if state.seen_s is None else moved(state.seen_s)
    return replace(state, seen_s=seen, asked_s=moved(state.asked_s), stable_since_s=moved(state.stable_since_s))


def interrupt(state: State, now_s: float, reason: str) -> State:
    """End a mission that was interrupted from outside."""
    return state if state.over else _end(state, now_s, Outcome.INTERRUPTED, reason)[0]


def abort(state: State, now_s: float, reason: str) -> State:
    """End a mission that cannot go on, for instance because the simulator is gone."""
    return state if state.over else _end(state, now_s, Outcome.ABORTED, reason)[0]


def _inject(plan: Plan, state: State, now_s: float) -> Step:
    """Make the contingencies that are due happen."""
    due = contingencies_due(plan.contingencies, state.injected, state.share, now_s - state.started_s, state.x, state.y)
    if not due:
        return state, ()
    return replace(state, injected=state.injected | set(due)), tuple(Inject(index) for index in due)


def _follow_goal(state: State, now_s: float) -> Step:
    """Handle a goal that the server does not list, while nothing is being reconfigured."""
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
