"""The journal that a manipulator leaves for the next one: which configuration was deployed, which change was under way.

It is a parameter with a heartbeat, so that the next manipulator can tell a recent journal from an old one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

MAX_AGE = 30.0
"""Seconds after its last heartbeat at which a journal is too old to be used. A respawned manipulator is back within
2 s, on an overloaded computer within 15 s."""

HEARTBEAT_PERIOD = 2.0  # s, wall


@dataclass(frozen=True)
class Journal:
    """What a manipulator has deployed, and what it is doing.

    Attributes:
        configuration: the last good configuration; empty: there is none.
        wanted: the configuration that is being deployed; empty: no change is under way.
        alive: wall time of the last heartbeat, s since the epoch.
        ended: whether the manipulator has ended by itself.
    """

    configuration: str = ""
    wanted: str = ""
    alive: float = 0.0
    ended: bool = False

    def noted(self, configuration: str, now: float, wanted: str | None = None, ended: bool = False) -> Journal:
        """Return the journal as it is at `now`; one that has ended does not change any more.

        Args:
            configuration: the last good configuration; empty: there is none.
            now: wall time, s since the epoch.
            wanted: the configuration that is being deployed; empty: none is; None: as before.
            ended: whether the manipulator ends by itself.
        """
        if self.ended:
            return self
        return replace(
            self,
            configuration=configuration,
            wanted=self.wanted if wanted is None else wanted,
            alive=now,
            ended=ended,
        )

    def needs_heartbeat(self, now: float) -> bool:
        """Tell whether the last heartbeat is so old that another one is due."""
        return now - self.alive > HEARTBEAT_PERIOD

    def as_parameter(self) -> dict[str, Any]:
        """Return the value of the parameter."""
        return {
            "configuration": self.configuration,
            "wanted": self.wanted,
            "alive": self.alive,
            "ended": self.ended,
        }


def parse_journal(value: object) -> Journal:
    """Read the parameter; return an empty journal where it has another form."""
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
        deploy: the configuration to deploy; empty: none.
        running: the configuration that runs already and is left as it is; empty: none.
        last_good: the configuration to restore if `deploy` fails; empty: none.
        keep_goal: whether the pending goal that an earlier manipulator left is kept.
    """

    deploy: str = ""
    running: str = ""
    last_good: str = ""
    keep_goal: bool = False


def resume(journal: Journal, launched: str, failed: bool, initial: str, now: float) -> Resumption:
    """Decide how to begin.

    Args:
        journal: the journal of the last manipulator.
        launched: the configuration that the launcher runs; empty: none.
        failed: whether the launcher has given that configuration up.
        initial: the configuration to begin with where nothing is left to resume; empty: none.
        now: wall time, s since the epoch.
    """
    fresh = 0.0 <= now - journal.alive <= MAX_AGE
    if launched and not failed:
        if fresh and journal.wanted:  # it was killed during a change: finish that
            return Resumption(deploy=journal.wanted, last_good=journal.configuration, keep_goal=True)
        return Resumption(running=launched, keep_goal=fresh)
    if fresh and not journal.ended and (journal.wanted or journal.configuration):  # manipulator and launcher died
        return Resumption(
            deploy=journal.wanted or journal.configuration,
            last_good=journal.configuration if journal.wanted else "",
            keep_goal=True,
        )
    return Resumption(deploy=initial)
