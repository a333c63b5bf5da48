"""Managers that react to what is wrong now, by a choice that needs no models: `random`, and `rules` for D2."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED, Cause, Decision
from metacontrol_msgs.msg import DiagnosticWords, FunctionGrounding
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, LevelFact, StaleFact

from metacontrol_experiments.managers.manager import Manager, ManagerError
from metacontrol_experiments.managers.violations import Violations

if TYPE_CHECKING:
    from collections.abc import Callable

    from mros1_reasoner.knowledge.model import Objective
    from mros1_reasoner.loop.entries import Fact

    from metacontrol_experiments.managers.manager import Situation

WINDOW_S = 2.0
"""s over which levels are averaged: the reasoner's default violation window."""
COOL_DOWN_S = 5.0
"""s after a change in which limits do not count: the reasoner's default."""


@dataclass(frozen=True)
class Trouble:
    """What is wrong.

    Attributes:
        quality: whose limit is violated; "" where none is.
        component: that has failed; "" where none has.
        surroundings: property of the surroundings that does not suit the running variant; "" where all do.
        words: what is wrong with the surroundings.
    """

    quality: str = ""
    component: str = ""
    surroundings: str = ""
    words: str = ""

    @property
    def trigger(self) -> str:
        """Its name in a decision."""
        if self.surroundings:
            return f"environment:{self.surroundings}"
        return f"qa:{self.quality}" if self.quality else f"component:{self.component}"

    def __str__(self) -> str:
        if self.surroundings:
            return self.words
        return f"{self.quality} violates its limit" if self.quality else f"{self.component} has failed"


if TYPE_CHECKING:
    Choose = Callable[[Trouble, str, tuple[str, ...]], str | None]
    """From the trouble, the running variant and the others that can run now, sorted, to the next one; None: stay."""


class ReactiveManager(Manager):
    """Asks for another variant while a limit is violated, and when the running variant can't work.

    It can't without a component that it needs, and where the surroundings are not as it needs them. The last value of a
    property of the surroundings holds until the next one comes.
    """

    observes = True

    def __init__(self, name: str, situation: Situation, choose: Choose) -> None:
        """Start with nothing known.

        Args:
            name: beginning of the decisions' ids.
            situation: with knowledge; it looks after the first objective.
            choose: the next variant.

        Raises:
            ManagerError: there is no knowledge or no objective.
        """
        if situation.knowledge is None or not situation.objectives:
            raise ManagerError(f"manager {name} needs a model with an objective: set the reasoner's ~model_file")
        self._name, self._choose = name, choose
        self._objective: Objective = situation.objectives[0]
        self._designs = {design.name: design for design in situation.knowledge.solving(self._objective.function)}
        self._violations = Violations(situation.knowledge.qualities, self._objective.limits, WINDOW_S)
        self._failed: set[str] = set()
        self._environment = situation.knowledge.environment
        self._surroundings: dict[str, float] = {}  # property -> its last value
        self._running = ""
        self._calm_until = 0.0
        self._waits_until = 0.0
        self._count = 0
        self._pending: Decision | None = None

    def take(self, now: float, fact: Fact) -> None:
        """See Manager.take."""
        match fact:
            case LevelFact() if fact.quality in self._environment:
                self._surroundings[fact.quality] = fact.level
            case LevelFact():
                self._violations.observe(now, fact.quality, fact.level)
            case StaleFact():
                self._violations.forget(fact.quality)
            case ComponentFact():
                change = self._failed.add if fact.status == DiagnosticWords.COMPONENT_FALSE else self._failed.discard
                change(fact.component)
            case ActiveFact() if fact.function == self._objective.function:
                self._running = fact.configuration if fact.state == FunctionGrounding.STABLE else ""

    def step(self, now: float, *, heartbeat: bool) -> list[Decision]:  # noqa: ARG002
        """See Manager.step."""
        if self._pending is not None or self._running not in self._designs or now < self._waits_until:
            return []
        others = tuple(sorted(name for name in self._designs if name != self._running and not self._hindrances(name)))
        for trouble in self._troubles(now):
            chosen = self._choose(trouble, self._running, others)
            if chosen is not None:
                self._pending = self._decision(now, trouble, chosen)
                return [self._pending]
        return []

    def executed(self, now: float, decision: str) -> Decision:
        """See Manager.executed."""
        return replace(self._ended(now, decision), state=EXECUTED, stamp_executed=now)

    def failed(self, now: float, decision: str, reason: str) -> Decision:
        """See Manager.failed: it waits as after a change, and chooses anew."""
        ended = self._ended(now, decision)
        self._waits_until = now + COOL_DOWN_S
        words = f"{ended.explanation}; failed: {reason}"
        return replace(ended, state=FAILED, explanation=words, stamp_executed=now)

    def _ended(self, now: float, decision: str) -> Decision:
        """Let limits rest for a while, and return the decision that has ended."""
        pending, self._pending = self._pending, None
        if pending is None or pending.id != decision:
            raise ValueError(f"no decision {decision!r} is under way")
        self._calm_until = now + COOL_DOWN_S
        self._violations.forget()
        return pending

    def _hindrances(self, variant: str) -> list[Trouble]:
        """Return why a variant can't work now, failed components first."""
        design, known = self._designs[variant], self._surroundings
        troubles = [Trouble(component=component) for component in sorted(design.components & self._failed)]
        unsuited = ((n, n.lack(known[n.attribute])) for n in design.needs if n.attribute in known)
        return troubles + [Trouble(surroundings=need.attribute, words=words) for need, words in unsuited if words]

    def _troubles(self, now: float) -> list[Trouble]:
        """Return what is wrong, the reasons why the running variant can't work first."""
        troubles = self._hindrances(self._running)
        if now >= self._calm_until:
            troubles += [Trouble(quality=quality) for quality in self._violations.found(now)]
        return troubles

    def _decision(self, now: float, trouble: Trouble, chosen: str) -> Decision:
        self._count += 1
        return Decision(
            id=f"{self._name}-{self._count}",
            state=DECIDED,
            objective=self._objective.name,
            trigger=trouble.trigger,
            from_configuration=self._running,
            to_configuration=chosen,
            causes=(str(trouble),),
            reasons=(Cause(now, trouble.trigger, str(trouble), quality=trouble.quality),),
            explanation=f"{trouble}: {self._running} -> {chosen}, chosen by {self._name}",
            stamp_monitored=now,
            stamp_analysed=now,
            stamp_planned=now,
        )


def at_random(seed: int) -> Choose:
    """Return a choice among the variants that can run, each as likely as another."""
    rng = np.random.default_rng([seed, 11])
    return lambda _trouble, _running, others: str(rng.choice(others)) if others else None
