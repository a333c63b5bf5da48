"""The journal that a manipulator leaves for the next one: what was deployed, and which change was under way.

It is a parameter with a heartbeat, so that the next manipulator can tell a recent journal from an old one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

MAX_AGE = 30.0
"""Seconds after its last heartbeat at which a journal is too old to be used. A respawned manipulator is back within
2 s, on an overloaded computer within 15 s."""

HEARTBEAT_PERIOD = 2.0  # s, wall

MAX_ATTEMPTS = 2
"""How often a change is begun that ends with the manipulator's death and without an error. A manipulator may be killed
by anybody, so the change is begun once more; twice in a row, the change is the likely cause."""


@dataclass(frozen=True)
class Journal:
    """What a manipulator has deployed, and what it is doing.

    Attributes:
        configurations: the last good configuration of each function.
        wanted: the configuration that is being deployed; empty: no change is under way.
        alive: wall time of the last heartbeat, s since the epoch.
        ended: whether the manipulator has ended because it was told to.
        attempts: how often the wanted configuration was begun, by this manipulator and those before it.
        error: the error of the change under way that has ended the manipulator; empty: none has.
        failures: why nothing runs for a function, for each function that has failed, even if it was released since.
        supervisor: who has started the manipulator, and starts it again when it ends; empty: nobody is known.
    """

    configurations: Mapping[str, str] = field(default_factory=dict)
    wanted: str = ""
    alive: float = 0.0
    ended: bool = False
    attempts: int = 0
    error: str = ""
    failures: Mapping[str, str] = field(default_factory=dict)
    supervisor: str = ""

    def noted(
        self,
        configurations: Mapping[str, str],
        now: float,
        wanted: str | None = None,
        ended: bool = False,
        failures: Mapping[str, str] | None = None,
    ) -> Journal:
        """Return the journal as it is at `now`; one that has ended or has an error does not change any more.

        Args:
            configurations: the last good configuration of each function.
            now: wall time, s since the epoch.
            wanted: the configuration that is being deployed; empty: none is; None: as before.
            ended: whether the manipulator ends because it was told to.
            failures: why nothing runs, for each function that has failed.
        """
        if self.ended or self.error:
            return self
        attempts = self.attempts
        if wanted is not None:  # a change begins, or has ended
            attempts = (self.attempts if wanted == self.wanted else 1) if wanted else 0
        return replace(
            self,
            configurations=dict(configurations),
            wanted=self.wanted if wanted is None else wanted,
            alive=now,
            ended=ended,
            attempts=attempts,
            failures=dict(failures or {}),
        )

    def broken(self, error: str, now: float) -> Journal:
        """Return the journal of a manipulator that an error of the change under way ends."""
        return replace(self, alive=now, error=error)

    @property
    def refusal(self) -> str:
        """Why the change under way is not begun again; empty: it may be."""
        if not self.wanted or self.ended:
            return ""
        if self.error:
            return f"it has ended the manipulator: {self.error}"
        if self.attempts >= MAX_ATTEMPTS:
            return f"the manipulator has ended {self.attempts} times while it deployed it"
        return ""

    def is_over(self, supervisor: str) -> bool:
        """Tell whether the whole system was ended: somebody told the manipulator to, and then started another one.

        A node of the same name or a signal may have ended it, too. Then its supervisor starts it again.

        Args:
            supervisor: who has started the next manipulator.
        """
        return self.ended and not (supervisor and supervisor == self.supervisor)

    def needs_heartbeat(self, now: float) -> bool:
        """Tell whether a heartbeat is due: the last one is old, or the clock was set back since."""
        return not 0.0 <= now - self.alive <= HEARTBEAT_PERIOD

    def as_parameter(self) -> dict[str, Any]:
        """Return the value of the parameter."""
        return {
            "configurations": dict(self.configurations),
            "wanted": self.wanted,
            "alive": self.alive,
            "ended": self.ended,
            "attempts": self.attempts,
            "error": self.error,
            "failures": dict(self.failures),
            "supervisor": self.supervisor,
        }


def parse_journal(value: object) -> Journal:
    """Read the parameter; return an empty journal where it has another form."""
    if not isinstance(value, Mapping):
        return Journal()
    empty = Journal().as_parameter()
    if not all(type(value.get(key)) is type(default) for key, default in empty.items()):
        return Journal()
    texts = (text for key in ("configurations", "failures") for pair in value[key].items() for text in pair)
    if not all(isinstance(text, str) for text in texts):
        return Journal()
    return Journal(**{key: value[key] for key in empty})


@dataclass(frozen=True)
class Resumption:
    """How a manipulator begins with one function.

    Attributes:
        deploy: the configuration to deploy; empty: none.
        running: the configuration that runs already and is left as it is; empty: none.
        last_good: the configuration that came up last; it is restored if another one fails; empty: none.
        keep_goal: whether the pending goal that an earlier manipulator left is kept.
        attempts: how often `deploy` was begun before.
        refused: the configuration whose change was under way and is not begun again; empty: there is none.
        reason: why it is not.
        failure: why nothing runs; empty: something does, or nothing has failed.
    """

    deploy: str = ""
    running: str = ""
    last_good: str = ""
    keep_goal: bool = False
    attempts: int = 0
    refused: str = ""
    reason: str = ""
    failure: str = ""


def begin_journal(resumptions: Iterable[Resumption], supervisor: str) -> Journal:
    """Return the journal with which a manipulator begins; it counts the first of its changes as begun.

    Args:
        resumptions: how it begins with each function.
        supervisor: see Journal.
    """
    begun = next((resumption for resumption in resumptions if resumption.deploy), None)
    journal = Journal(supervisor=supervisor)
    return replace(journal, wanted=begun.deploy, attempts=begun.attempts + 1) if begun else journal


def resume(
    journal: Journal,
    known: Mapping[str, str],
    function: str,
    launched: str,
    failed: bool,
    initial: str,
    now: float,
    supervisor: str,
) -> Resumption:
    """Decide how to begin with a function.

    Args:
        journal: the journal of the last manipulator.
        known: the function of each configuration.
        function: its name.
        launched: the configuration that the launcher runs for it; empty: none.
        failed: whether the launcher has given that configuration up.
        initial: the configuration to begin with where nothing is left to resume; empty: none.
        now: wall time, s since the epoch.
        supervisor: who has started the manipulator that begins.
    """
    over = journal.is_over(supervisor)
    fresh = 0.0 <= now - journal.alive <= MAX_AGE
    last_good = journal.configurations.get(function, "")
    last_good = last_good if known.get(last_good) == function else ""
    wanted = journal.wanted if known.get(journal.wanted) == function else ""
    attempts = journal.attempts if wanted else 0
    if fresh and wanted and journal.refusal:
        return _without_the_change(wanted, last_good, journal.refusal, "" if failed else launched, initial)
    if launched and not failed:
        if fresh and wanted:  # it was killed during a change: finish that
            return Resumption(deploy=wanted, last_good=last_good, keep_goal=True, attempts=attempts)
        return Resumption(running=launched, keep_goal=fresh)
    if fresh and not over and (wanted or last_good):  # manipulator and launcher died
        return Resumption(
            deploy=wanted or last_good,
            last_good=last_good,  # in the next journal, too: this manipulator may die before its turn comes
            keep_goal=True,
            attempts=attempts,
        )
    failure = journal.failures.get(function, "") if fresh and not over and not initial else ""
    return Resumption(deploy=initial, failure=failure)


def _without_the_change(wanted: str, last_good: str, reason: str, launched: str, initial: str) -> Resumption:
    """Decide how to begin when the change under way is refused: with what runs, or with what ran before."""
    former = last_good if last_good != wanted else ""
    begun = Resumption(keep_goal=True, refused=wanted, reason=reason)
    if launched and not (former and launched == wanted):
        return replace(begun, running=launched)
    return replace(begun, deploy=former or (initial if initial != wanted else ""))
