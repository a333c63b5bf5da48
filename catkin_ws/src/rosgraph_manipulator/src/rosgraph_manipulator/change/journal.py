"""What a manipulator leaves for the one that comes after it: what was deployed, and what was under way.

It stands on the parameter server with a heartbeat, so that nothing of another day comes back to life.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

MAX_AGE = 30.0
"""Seconds after its last heartbeat at which a journal is history: a respawned manipulator is back within 2, on a
computer that is overloaded within 15."""


@dataclass(frozen=True)
class Journal:
    """Where a manipulator stands.

    Attributes:
        configuration: the last good one; empty: none.
        wanted: the one that is being deployed; empty: no change is under way.
        alive: wall time of the last sign of life, s since the epoch.
        ended: whether the manipulator has ended by itself.
    """

    configuration: str = ""
    wanted: str = ""
    alive: float = 0.0
    ended: bool = False

    def as_parameter(self) -> dict[str, Any]:
        """Return the form in which it stands on the parameter server."""
        return {
            "configuration": self.configuration,
            "wanted": self.wanted,
            "alive": self.alive,
            "ended": self.ended,
        }


def parse_journal(value: object) -> Journal:
    """Read the parameter; an empty journal where it has another form."""
    if not isinstance(value, Mapping):
        return Journal()
    texts = [value.get(key) for key in ("configuration", "wanted")]
    alive, ended = value.get("alive"), value.get("ended")
    if not all(isinstance(text, str) for text in texts) or not isinstance(alive, float) or not isinstance(ended, bool):
        return Journal()
    return Journal(str(texts[0]), str(texts[1]), alive, ended)


@dataclass(frozen=True)
class Resumption:
    """How a manipulator begins.

    Attributes:
        deploy: the configuration to deploy; empty: none, what runs is taken over or nothing is to run.
        running: the configuration that runs as it should; empty: none.
        last_good: where to go back to should `deploy` fail; empty: nowhere.
        keep_goal: whether the pending goal that was left is taken over.
    """

    deploy: str = ""
    running: str = ""
    last_good: str = ""
    keep_goal: bool = False


def resume(journal: Journal, launched: str, failed: bool, initial: str, now: float) -> Resumption:
    """Decide how to begin.

    Args:
        journal: what the last manipulator left.
        launched: the configuration whose processes the launcher has; empty: none.
        failed: whether the launcher has given it up.
        initial: what the operator wants at a start; empty: nothing.
        now: wall time, s since the epoch.
    """
    fresh = 0.0 <= now - journal.alive <= MAX_AGE
    if launched and not failed:
        if fresh and journal.wanted:  # it was killed in the middle of a change, which is finished now
            return Resumption(deploy=journal.wanted, last_good=journal.configuration, keep_goal=True)
        return Resumption(running=launched, keep_goal=fresh)
    if fresh and not journal.ended and (journal.wanted or journal.configuration):  # manipulator and launcher died
        return Resumption(
            deploy=journal.wanted or journal.configuration,
            last_good=journal.configuration if journal.wanted else "",
            keep_goal=True,
        )
    return Resumption(deploy=initial)
