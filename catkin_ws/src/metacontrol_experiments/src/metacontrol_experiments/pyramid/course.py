"""The course of a mission of D1 as a state machine: what strikes when, and how the mission ends.

The caller hands in what it hears, with the ROS time in s. Every function returns the next state; `on_time` also returns
what to do now.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from metacontrol_bags.goal_status import GoalStatus

from metacontrol_experiments.mission.mission import Action, Outcome
from metacontrol_experiments.pyramid.scenarios import ARMS, Obstacle, Scenario, Strike

if TYPE_CHECKING:
    from collections.abc import Mapping

BLOCKS = 6
TIMEOUT_S = 400.0
"""s of ROS time after which a mission has failed."""
WATCH_S = 5.0
"""s for which the table is watched after the goal's end: what stands has to stand still."""
ACKNOWLEDGE_S = 5.0
"""s after which a goal that no status lists is sent again, under the same id."""
_LEAVE_S = 2.0
"""s after the arm's stop after which the obstacle is taken away."""
_MISSED_S = 10.0
"""s after which an obstacle that nothing has met is taken away; it will be put in the next way."""


@dataclass(frozen=True)
class Inject:
    """Make this strike happen now, and say `struck` or `refused`."""

    strike: Strike


@dataclass(frozen=True)
class TakeAway:
    """Take the obstacle away."""


Deed = Action | Inject | TakeAway


@dataclass(frozen=True)
class State:
    """Where a mission stands; moments in s of ROS time.

    Attributes:
        started: when the goal was sent.
        placed: blocks in their places.
        carrying: arms that bring a block to the pyramid.
        stopped: arms in a safety stop, and since when.
        next: index of the next strike.
        struck: when the last one happened.
        obstacle: that stands in the cell.
        asked: when the goal was last sent.
        is_known: whether the server has listed the goal.
        ended: when the goal's result came, None before.
        status: of that result.
        text: of that result.
        outcome: None until the mission is over.
        reason: why it is over, one line.
        over_at: when.
    """

    started: float
    placed: int = 0
    carrying: frozenset[str] = frozenset()
    stopped: Mapping[str, float] = field(default_factory=dict)
    next: int = 0
    struck: float = 0.0
    obstacle: Obstacle | None = None
    asked: float = 0.0
    is_known: bool = False
    ended: float | None = None
    status: GoalStatus | None = None
    text: str = ""
    outcome: Outcome | None = None
    reason: str = ""
    over_at: float | None = None

    @property
    def is_over(self) -> bool:
        """Whether the mission is over."""
        return self.outcome is not None


def start(now: float) -> State:
    """Return the state of a mission whose goal is sent now."""
    return State(now, struck=now, asked=now)


def on_placed(state: State, placed: int) -> State:
    """Take in how many blocks stand in their places."""
    return replace(state, placed=placed)


def on_carrying(state: State, carrying: frozenset[str]) -> State:
    """Take in which arms bring a block to the pyramid."""
    return replace(state, carrying=carrying)


def on_stops(state: State, now: float, arm: str, *, is_stopped: bool) -> State:
    """Take in whether an arm is in a safety stop."""
    if arm not in ARMS or is_stopped == (arm in state.stopped):
        return state
    stopped = dict(state.stopped)
    if is_stopped:
        stopped[arm] = now
    else:
        del stopped[arm]
    return replace(state, stopped=stopped)


def on_known(state: State) -> State:
    """Take in that the action's server lists the goal."""
    return replace(state, is_known=True)


def on_result(state: State, now: float, status: GoalStatus, text: str) -> State:
    """Take in the result of the goal."""
    if state.is_over or state.ended is not None:
        return state
    return replace(state, ended=now, status=status, text=text)


def struck(state: State, now: float) -> State:
    """Take in that the next strike has happened."""
    return replace(state, next=state.next + 1, struck=now)


def stands(state: State, obstacle: Obstacle) -> State:
    """Take in that an obstacle stands in the cell."""
    return replace(state, obstacle=obstacle)


def on_time(scenario: Scenario, state: State, now: float) -> tuple[State, tuple[Deed, ...]]:
    """Take in the time; return what to do now."""
    if state.is_over:
        return state, ()
    if state.ended is not None:
        if now - state.ended < WATCH_S:
            return state, ()
        return _judged(state, now), ()
    if now - state.started > TIMEOUT_S:
        reason = f"not built within {TIMEOUT_S:g} s: {state.placed} of {BLOCKS} blocks stand"
        return _over(state, now, Outcome.TIMEOUT, reason), (Action.CANCEL_GOAL,)
    state, deeds = _see_to_obstacle(state, now)
    if not state.is_known and now - state.asked > ACKNOWLEDGE_S:
        return replace(state, asked=now), (*deeds, Action.RESEND_GOAL)
    due = _due(scenario, state, now)
    return state, (*deeds, Inject(due)) if due and not deeds else deeds


def interrupt(state: State, now: float, reason: str) -> State:
    """End a mission that was interrupted from outside."""
    return state if state.is_over else _over(state, now, Outcome.INTERRUPTED, reason)


def abort(state: State, now: float, reason: str) -> State:
    """End a mission that cannot go on."""
    return state if state.is_over else _over(state, now, Outcome.ABORTED, reason)


def _see_to_obstacle(state: State, now: float) -> tuple[State, tuple[Deed, ...]]:
    """Take an obstacle away that has done its work, or that nothing has met: then it strikes again."""
    obstacle = state.obstacle
    if obstacle is None:
        return state, ()
    met = state.stopped.get(obstacle.arm)
    if met is not None and now - met > _LEAVE_S:
        return replace(state, obstacle=None, struck=now), (TakeAway(),)
    if met is None and now - state.struck > _MISSED_S:
        return replace(state, obstacle=None, next=state.next - 1, struck=now), (TakeAway(),)
    return state, ()


def _due(scenario: Scenario, state: State, now: float) -> Strike | None:
    """Return the strike whose moment has come; none while an obstacle stands."""
    if state.next >= len(scenario.strikes) or state.obstacle is not None:
        return None
    strike = scenario.strikes[state.next]
    if state.placed < strike.placed or now - state.struck < strike.after:
        return None
    if isinstance(strike.what, Obstacle) and strike.what.arm not in state.carrying:
        return None
    return strike


def _judged(state: State, now: float) -> State:
    """End a mission some time after its goal has."""
    if state.status is GoalStatus.SUCCEEDED and state.placed == BLOCKS:
        return _over(state, now, Outcome.REACHED, "the pyramid stands")
    if state.status is GoalStatus.SUCCEEDED:
        return _over(state, now, Outcome.ABORTED, f"the program says it stands; {state.placed} of {BLOCKS} blocks do")
    status = state.status.name.lower() if state.status else "lost"
    return _over(state, now, Outcome.ABORTED, f"build: goal {status}" + (f": {state.text}" if state.text else ""))


def _over(state: State, now: float, outcome: Outcome, reason: str) -> State:
    return replace(state, outcome=outcome, reason=reason, over_at=now)
