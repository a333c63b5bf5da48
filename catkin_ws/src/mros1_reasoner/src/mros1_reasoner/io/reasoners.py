"""The reasoners, by the name that a parameter gives."""

from __future__ import annotations

from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.pellet.process import make_reasoner as make_pellet

PELLET, RULES = "pellet", "rules"
NAMES = (PELLET, RULES)


def make_reasoner(name: str = PELLET) -> Reasoner:
    """Return a reasoner: Pellet, which knows all of OWL, or the rule engine, which needs no Java.

    Raises:
        ReasonerError: Pellet can't run.
    """
    return RuleEngine() if name == RULES else make_pellet()
