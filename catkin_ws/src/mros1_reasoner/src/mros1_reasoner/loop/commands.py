"""The commands of an operator: pause, lock, approve, other objectives and limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from metacontrol_bags.decision import DECIDED, FAILED, Decision

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.state import State


class Operator:
    """Applies the operator's commands; they take effect with the loop's next step."""

    def __init__(self, state: State, wall: Callable[[], float]) -> None:
        """Change the loop's state.

        Args:
            state: of the loop.
            wall: wall clock that measures durations, s.
        """
        self._state, self._wall = state, wall

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
            MapeError: there is no such objective.
        """
        self._state.lock(self._state.named(objective))

    def unlock(self, objective: str = "") -> None:
        """Take `lock` back.

        Raises:
            MapeError: there is no such objective.
        """
        self._state.unlock(self._state.named(objective))

    def approve(self, decision_id: str) -> Decision:
        """Approve the proposed decision. It is DECIDED now; the caller publishes it and has it carried out.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = replace(self._proposed(decision_id), state=DECIDED)
        self._state.begin(decision, self._wall())
        return decision

    def reject(self, decision_id: str, now: float) -> Decision:
        """Reject the proposed decision; its design is not proposed again until the error log forgets it.

        Returns:
            The decision, FAILED, to publish.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = self._proposed(decision_id)
        words = "rejected by the operator"
        self._state.note_in_vain(now, decision.to_configuration, decision.objective, words)
        self._state.propose(None)
        self._state.reconsider()
        return replace(decision, state=FAILED, explanation=f"{decision.explanation}; {words}", stamp_executed=now)

    def add_objective(self, objective: Objective) -> None:
        """Ask for a function from now on.

        Raises:
            MapeError: the name is taken, or the model holds no such function or quality.
        """
        if objective.name in self._state.roots:
            raise MapeError(f"objective {objective.name} exists already: give another name")
        functions = self._state.kb.functions
        if objective.function not in functions:
            known = ", ".join(functions)
            raise MapeError(f"objective {objective.name}: no Function is called {objective.function!r}: known: {known}")
        for quality, limit in objective.limits.items():
            self._check_limit(quality, limit)
        self._state.ask_for(objective)

    def remove_objective(self, name: str) -> None:
        """No longer ask for a function; objectives that only it required go with it.

        Raises:
            MapeError: there is no such objective, or a decision about it is being carried out.
        """
        roots, pending = self._state.roots, self._state.pending
        if name not in roots:
            raise MapeError(f"no objective is called {name!r}: known: {', '.join(roots)}")
        if pending and (pending.objective == name or pending.objective not in roots):
            raise MapeError(f"objective {name} is being adapted: remove it afterwards")
        self._state.ask_no_longer(name)

    def set_nfr(self, objective: str, quality: str, limit: float) -> None:
        """Give an objective another limit of a quality.

        Raises:
            MapeError: there is no such objective or quality, or the limit is not finite.
        """
        self._state.named(objective)
        self._check_limit(quality, limit)
        self._state.set_limit(objective, quality, limit, f"the operator wants a limit of {limit:g} of {quality}")

    def _proposed(self, decision_id: str) -> Decision:
        proposal = self._state.proposal
        if proposal is None or proposal.id != decision_id:
            raise MapeError(f"decision {decision_id} does not wait for approval")
        return proposal

    def _check_limit(self, quality: str, limit: float) -> None:
        if not self._state.kb.admit(quality):
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(limit):
            raise MapeError(f"limit of {quality} is {limit}, not a finite number: left as it is")
