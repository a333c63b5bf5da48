"""The managers `mros` and `as_published`: the reasoner's loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, LevelFact, StaleFact

from metacontrol_experiments.managers.manager import Manager

if TYPE_CHECKING:
    from metacontrol_bags.decision import Decision
    from mros1_reasoner.knowledge.reasoner import Reasoner
    from mros1_reasoner.loop.entries import Fact
    from mros1_reasoner.loop.mape import Mape


class MrosManager(Manager):
    """Lets the reasoner's loop decide."""

    observes = True

    def __init__(self, loop: Mape, reasoner: Reasoner) -> None:
        """Take the loop, and the reasoner that analyses for it."""
        self._loop = loop
        self._reasoner = reasoner

    def take(self, now: float, fact: Fact) -> None:
        """See Manager.take."""
        match fact:
            case LevelFact():
                self._loop.observe_level(now, fact.quality, fact.level, fact.grounding, stamp=now)
            case StaleFact():
                self._loop.observe_stale(fact.quality)
            case ComponentFact():
                self._loop.observe_component(now, fact.component, fact.status, stamp=now)
            case ActiveFact():
                self._loop.observe_active(now, fact.function, fact.configuration, fact.state)

    def step(self, now: float, *, heartbeat: bool) -> list[Decision]:
        """See Manager.step.

        Raises:
            ReasonerError: the analysis failed.
        """
        return self._loop.step(now, heartbeat=heartbeat)

    def executed(self, now: float, decision: str) -> Decision:
        """See Manager.executed."""
        return self._reported(now, decision, True)

    def failed(self, now: float, decision: str, reason: str) -> Decision:
        """See Manager.failed."""
        return self._reported(now, decision, False, reason)

    def _reported(self, now: float, decision: str, ok: bool, reason: str = "") -> Decision:
        outcome = self._loop.report(now, decision, ok, reason)
        assert outcome is not None  # noqa: S101 - only changes are reported, and no repairs
        return outcome

    def close(self) -> None:
        """End the reasoner's process."""
        self._reasoner.close()


class AsPublishedManager(MrosManager):
    """Lets the reasoner's loop decide, whose settings are those of the published reasoner."""

    reconfiguration_s = 4.3
    """Mean of the published manipulator, which restarts move_base at each (paper, RQ2)."""
