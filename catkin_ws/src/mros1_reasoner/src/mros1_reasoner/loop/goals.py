"""Goals of tasks: each one has an objective pursued until it is given up, and hears how the objective stands.

There is at most one goal for a function. All that changes what the loop pursues are commands, as of an operator. So a
journal has them, and a replay needs no goals. Times are s of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from metacontrol_bags.decision import FAILED, Decision
from metacontrol_msgs.msg import ObjectiveWords as Words

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop import entries
from mros1_reasoner.loop.fulfilment import Fulfilment
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError

NEVER = 0.0
"""As the time after which a goal gives up."""


@dataclass(frozen=True)
class Wish:
    """What a goal asks for.

    Attributes:
        function: the function.
        name: of the objective; empty: that of the function's objective, or a new one.
        limits: quality and limit; two of one quality are a band, the least level first.
        always_improve: adapt also when a clearly better design has become available; None: as the settings say.
        give_up_after: end when the objective has not been fulfilled for so long, s; 0: never.
    """

    function: str
    name: str = ""
    limits: tuple[tuple[str, float], ...] = ()
    always_improve: bool | None = None
    give_up_after: float = NEVER


@dataclass(frozen=True)
class End:
    """How a goal has ended.

    Attributes:
        reason: a word of metacontrol_msgs/ObjectiveWords.
        objective: its name.
        message: in one line.
    """

    reason: str
    objective: str
    message: str


@dataclass(frozen=True)
class _Goal:
    """An active goal.

    Attributes:
        wish: what it asks for.
        objective: the name of the one that is pursued.
        before: the objective as it was before the goal; None: there was none.
        unfulfilled_since: None: it is fulfilled, or ROS time has not begun.
        told: what was told last.
        end: how it ends when its objective can be given up.
    """

    wish: Wish
    objective: str
    before: Objective | None
    unfulfilled_since: float | None = None
    told: Fulfilment | None = None
    end: End | None = None


class Goals:
    """The active goals by id."""

    def __init__(self, core: Mape, command: Callable[[entries.Command], object]) -> None:
        """Begin without goals.

        Args:
            core: what pursues objectives.
            command: has the core take in a command, or raises MapeError.
        """
        self._core, self._command = core, command
        self._goals: dict[str, _Goal] = {}
        self._ended: list[tuple[str, End]] = []
        self._refusals: dict[str, Decision] = {}

    def ask(self, goal: str, wish: Wish) -> str:
        """Have an objective pursued from now on, in place of that of an older goal for the function.

        Args:
            goal: its id.
            wish: what it asks for.

        Returns:
            Which objective is pursued, in words.

        Raises:
            MapeError: it makes no sense.
        """
        if not (math.isfinite(wish.give_up_after) and wish.give_up_after >= NEVER):
            raise MapeError(f"give_up_after is {wish.give_up_after}: give seconds, 0 for never")
        operator = self._core.operator
        name, limits = operator.pursuer(wish.function, wish.name), operator.limits_of(wish.limits)
        older = next((known for known, other in self._goals.items() if other.wish.function == wish.function), None)
        before = self._core.objectives[name] if name in self._core.roots else None
        words = f"objective {name} is there already: its limits are replaced" if before else f"objective {name} is new"
        self._command(entries.Pursue(name, wish.function, limits, wish.always_improve))
        if older is not None:
            former = self._goals.pop(older)
            end = End(Words.REPLACED, former.objective, f"a newer goal asks for {wish.function}")
            if former.objective == name:
                before = former.before
                self._ended.append((older, former.end or end))
            else:
                self._goals[older] = replace(former, end=former.end or end)
        self._goals[goal] = _Goal(wish, name, before)
        return words

    def cancel(self, goal: str) -> None:
        """Give a goal up; it ends with one of the next looks."""
        if goal in self._goals:
            known = self._goals[goal]
            end = End(Words.CANCELLED, known.objective, f"{known.objective} is given up")
            self._goals[goal] = replace(known, end=known.end or end)

    def heed_limit(self, objective: str, quality: str, limit: float) -> None:
        """Keep a limit that an operator sets beyond the end of a goal; no name means every objective."""
        for goal, known in self._goals.items():
            if known.before and objective in ("", known.objective):
                before = replace(known.before, limits={**known.before.limits, quality: limit})
                self._goals[goal] = replace(known, before=before)

    def heed_decision(self, decision: Decision) -> None:
        """Keep why the loop refuses to adapt an objective, until it decides otherwise."""
        if decision.repair:
            return  # that another design is taken, or none, is another decision
        if decision.state == FAILED:
            self._refusals[decision.objective] = decision
        else:
            self._refusals.pop(decision.objective, None)

    def look(self, now: float) -> list[tuple[str, Fulfilment | End]]:
        """Return what is new: goals that have ended, and how the objectives of others stand now."""
        found: list[tuple[str, Fulfilment | End]] = []
        for goal, known in list(self._goals.items()):
            if known.objective not in self._core.roots:
                removed = End(Words.REMOVED, known.objective, f"{known.objective} was removed by somebody else")
                self._end(goal, known.end or removed)
            elif known.end is None:
                found += self._look_at(goal, known, now)
            if goal in self._goals:
                self._let_go(goal)
        self._refusals = {name: last for name, last in self._refusals.items() if name in self._core.objectives}
        ended, self._ended = self._ended, []
        return [*found, *ended]

    def due(self) -> float | None:
        """Return when the next goal gives up; None if none does."""
        waiting = (g for g in self._goals.values() if g.wish.give_up_after and g.end is None)
        times = [g.unfulfilled_since + g.wish.give_up_after for g in waiting if g.unfulfilled_since is not None]
        return min(times, default=None)

    def _look_at(self, goal: str, known: _Goal, now: float) -> list[tuple[str, Fulfilment]]:
        """Notice that a goal has not been fulfilled for too long; return how it stands, if that is new."""
        stands = self._standing(known.objective, now)
        since = known.unfulfilled_since
        if stands.is_fulfilled or now <= 0.0:  # the clock has not begun
            since = None
        elif since is None or since > now:  # it has gone back
            since = now
        end, patience = None, known.wish.give_up_after
        if since is not None and patience and now - since >= patience:
            words = f"{known.objective} has not been fulfilled for {patience:g} s: {stands.why}"
            end = End(Words.NOT_FULFILLED, known.objective, words)
        self._goals[goal] = replace(known, told=stands, unfulfilled_since=since, end=end)
        return [(goal, stands)] if stands != known.told else []

    def _standing(self, name: str, now: float) -> Fulfilment:
        stands = self._core.fulfilment(name, now)
        if stands.is_fulfilled:
            self._refusals.pop(name, None)
        last = self._refusals.get(name)
        if last is None:
            return stands
        return replace(stands, stage=stands.stage or last.id, why=last.explanation)

    def _let_go(self, goal: str) -> None:
        """Give the objective of a goal up that ends; not while it is being adapted."""
        known = self._goals[goal]
        if known.end is None or not (known.before or self._core.operator.can_remove(known.objective)):
            return
        before, end = known.before, known.end
        try:
            if before is None:
                self._command(entries.RemoveObjective(known.objective))
            else:
                self._command(entries.Pursue(before.name, before.function, before.limits, before.always_improve))
        except (MapeError, KnowledgeBaseError) as error:  # an operator has set limits meanwhile that don't fit these
            end = replace(end, message=f"{end.message}; its former limits can't be restored: {error}")
        self._end(goal, end)

    def _end(self, goal: str, end: End) -> None:
        del self._goals[goal]
        self._ended.append((goal, end))
