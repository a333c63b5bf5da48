"""The reasoners, by the name that a parameter gives."""

from __future__ import annotations

from subprocess import Popen

from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.pellet.process import make_reasoner as make_pellet
from mros1_reasoner.pellet.spawning import end

PELLET, RULES = "pellet", "rules"
NAMES = (PELLET, RULES)


def make_reasoner(name: str = PELLET, early: Popen[bytes] | None = None) -> Reasoner:
    """Return a reasoner: Pellet, which knows all of OWL, or the rule engine, which needs no Java.

    Args:
        name: its name.
        early: Pellet's process, if it has been started already; it is ended if it is not needed.

    Raises:
        ReasonerError: Pellet can't run.
    """
    if name != RULES:
        return make_pellet(early)
    if early is not None:
        end(early)
    return RuleEngine()
