"""The reasoners, by the name that a parameter gives."""

from __future__ import annotations

from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.pellet.process import PelletReasoner
from mros1_reasoner.pellet.process import make_reasoner as make_pellet

PELLET, RULES = "pellet", "rules"
NAMES = (PELLET, RULES)


def make_reasoner(name: str = PELLET, early: PelletReasoner | None = None) -> Reasoner:
    """Return a reasoner: Pellet, which knows all of OWL, or the rule engine, which needs no Java.

    Args:
        name: which one.
        early: Pellet, if it has been started already; it is ended if it is not the one.

    Raises:
        ReasonerError: Pellet can't run.
    """
    if name != RULES:
        return make_pellet(early)
    if early:
        early.close()
    return RuleEngine()
