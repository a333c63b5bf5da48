"""The commands of an operator: pause, lock, approve, other objectives and limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from metacontrol_bags.decision import DECIDED, FAILED, Decision

from mros1_reasoner.knowledge.model import LEAST, MOST, Objective
from mros1_reasoner.loop.loop_time import LoopTime
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.state import State


class Operator:
    """Applies the operator's commands; they take effect with the loop's next step."""

    def __init__(self, state: State, wall: Callable[[], float], loop_time: LoopTime) -> None:
        """Change the loop's state.

        Args:
            state: of the loop.
            wall: wall clock that measures durations, s.
            loop_time: the loop's.
        """
        self._state, self._wall, self._time = state, wall, loop_time

    def pause(self) -> None:
        """Decide nothing until `resume`; facts are still analysed, and a decision under way is still carried out."""
        self._state.pause()

    def resume(self) -> None:
        """Decide again."""
        self._state.resume()

    def lock(self, objective: str = "") -> None:
        """Keep the configuration of an objective; of all objectives if none is named.

        The loop publishes the adaptation that it would have done as a refusal.

        Raises:
            MapeError: there is no such objective, and no design may require it.
        """
        self._state.lock(self._names(objective))

    def unlock(self, objective: str = "") -> None:
        """Take `lock` back.

        Raises:
            MapeError: there is no such objective, and no design may require it.
        """
        self._state.unlock(self._names(objective) if objective else self._state.locked)

    def approve(self, decision_id: str, now: float) -> Decision:
        """Approve the proposed decision. It is DECIDED now; the caller publishes it and has it carried out.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = replace(self._proposed(decision_id), state=DECIDED)
        self._state.begin(decision, self._time.take(now), self._wall())
        return self._time.told(decision)

    def reject(self, decision_id: str, now: float) -> Decision:
        """Reject the proposed decision; its design is not proposed again for `error_log_expiry`.

        Returns:
            The decision, FAILED, to publish.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = self._proposed(decision_id)
        words, now = "rejected by the operator", self._time.take(now)
        if decision.repair:
            self._state.repairs.refuse(now, decision.repair)
        else:
            self._state.note_rejection(now, decision.to_configuration, decision.objective, words)
        self._state.propose(None)
        self._state.reconsider()
        told = replace(decision, state=FAILED, explanation=f"{decision.explanation}; {words}", stamp_executed=now)
        return self._time.told(told)

    def add_objective(self, objective: Objective) -> None:
        """Ask for a function from now on.

        Raises:
            MapeError: the name is taken or can't be one, or the model holds no such function or quality.
        """
        if objective.name in self._state.roots:
            raise MapeError(f"objective {objective.name} exists already: give another name")
        _check_name(objective.name)
        self._check(objective)
        self._state.ask_for(objective)

    def pursue(self, objective: Objective) -> None:
        """Ask for a function from now on; the limits replace those of an objective of that name.

        Raises:
            MapeError: the objective of that name has another function, or the model holds no such function or quality.
        """
        self._check(objective)
        if objective.name in self._state.roots:
            self._state.ask_anew(objective)
        else:
            self._state.ask_for(objective)

    def pursuer(self, function: str, name: str = "") -> str:
        """Return the name of the objective by which a function is to be pursued, which may not exist yet.

        It is the objective of the given name, or the first one of that function that is asked for, or a new one.

        Raises:
            MapeError: the model holds no such function, the objective of that name has another one, or it can't be one.
        """
        self._check_function(function)
        if name in self._state.roots:
            self._check(Objective(name, function))
            return name
        if name:
            _check_name(name)
        known = next((o for o in self._state.roots if self._state.objectives[o].function == function), None)
        return known or name or self._state.provider(function)

    def can_remove(self, name: str) -> bool:
        """Return whether a root objective can be removed now: no decision about it is being carried out."""
        pending = self._state.pending
        return pending is None or (pending.objective != name and pending.objective in self._state.roots)

    def remove_objective(self, name: str) -> None:
        """No longer ask for a function; objectives that only it required go with it.

        Raises:
            MapeError: there is no such objective, or a decision about it is being carried out.
        """
        if name not in self._state.roots:
            raise MapeError(f"no objective is called {name!r}: known: {', '.join(self._state.roots)}")
        if not self.can_remove(name):
            raise MapeError(f"objective {name} is being adapted: remove it afterwards")
        self._state.ask_no_longer(name)

    def limits_of(self, given: Iterable[tuple[str, float]]) -> dict[str, float]:
        """Return limits by name; of two limits of one quality, the first one is the least level of a band.

        Raises:
            MapeError: a quality is unknown or has more limits, a limit is no level, or a band is not in order.
        """
        found: dict[str, list[float]] = {}
        for quality, limit in given:
            self._check_limit(quality, limit)
            found.setdefault(quality, []).append(limit)
        limits: dict[str, float] = {}
        for quality, levels in found.items():
            if len(levels) > 2:
                raise MapeError(f"{quality} has {len(levels)} limits: give one, or the two of a band")
            if len(levels) == 2:
                band = self._state.kb.qualities[quality].band(quality, levels[0], levels[1])
                for end, level in band.items():
                    self._check_limit(end, level)
                limits |= band
            else:
                limits[quality] = levels[0]
        self._check_bands(limits)
        return limits

    def set_nfr(self, objective: str, quality: str, limit: float) -> None:
        """Give an objective another limit of a quality; all objectives if none is named.

        Raises:
            MapeError: there is no such objective and no design may require it, or there is no such quality, or the
                limit is no level of it, or makes no band with the other one.
        """
        names = sorted(self._names(objective))
        self._check_limit(quality, limit)
        for name in names:
            self._check_bands({**self._state.limits_of(name), quality: limit}, "set its other limit first")
        for name in names:
            self._state.set_limit(name, quality, limit, f"the operator wants a limit of {limit:g} of {quality}")

    def _names(self, objective: str) -> set[str]:
        """Return the objective of a name, which may come into being when a design requires it; all if it is empty."""
        return {objective} if objective in self._state.foreseen() else self._state.named(objective)

    def _proposed(self, decision_id: str) -> Decision:
        proposal = self._state.proposal
        is_gone = proposal is not None and proposal.objective not in self._state.objectives
        if proposal is None or proposal.id != decision_id or is_gone:
            raise MapeError(f"decision {decision_id} does not wait for approval")
        return proposal

    def _check(self, objective: Objective) -> None:
        """Refuse an objective that makes no sense."""
        name = objective.name
        self._check_function(objective.function, f"objective {name}: ")
        other = self._state.objectives[name].function if name in self._state.roots else objective.function
        if other != objective.function:
            raise MapeError(f"objective {name} is one of {other}, not of {objective.function}: give another name")
        for quality, limit in objective.limits.items():
            self._check_limit(quality, limit)
        self._check_bands(objective.limits)

    def _check_function(self, function: str, whose: str = "") -> None:
        if function not in self._state.kb.functions:
            known = ", ".join(self._state.kb.functions)
            raise MapeError(f"{whose}no Function is called {function!r}: known: {known}")

    def _check_bands(self, limits: Mapping[str, float], remedy: str = "give the least level first") -> None:
        for quality in limits:
            for least, most in ((f"{quality}{LEAST}", quality), (quality, f"{quality}{MOST}")):
                if least in limits and most in limits and limits[least] >= limits[most]:
                    band = f"{limits[least]:g} to {limits[most]:g}"
                    raise MapeError(f"the band of {quality} is {band}: {remedy}")

    def _check_limit(self, quality: str, limit: float) -> None:
        if not self._state.kb.admit(quality):
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(limit):
            raise MapeError(f"limit of {quality} is {limit}, not a finite number: left as it is")
        kind = self._state.kb.qualities[quality]
        if not kind.holds(limit):
            raise MapeError(f"limit of {quality} is {limit:g}, not within its range, {kind.range}: left as it is")


def _check_name(name: str) -> None:
    if not name.replace("_", "a").isalnum():
        raise MapeError(f"objective {name!r}: use letters, digits and '_' for its name")
