"""What to do about a report of the launcher, and which configuration is restored when another one fails.

Times are arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

import enum

from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport

from rosgraph_manipulator.change.deployment import Outcome, Result
from rosgraph_manipulator.configuration.configurations import Configuration

LAUNCHER_GRACE = 2.0
"""Time after the end of a launcher in which nothing is told, s: a respawned one is back within 2 s, and what it should
run is deployed again at once."""


class Reaction(enum.Enum):
    """What the manipulator does about a report of the launcher."""

    NONE = "none"
    DEPLOY_AGAIN = "deploy again"  # the launcher runs something else: another launcher has started
    GO_BACK = "go back"  # a node died soon after the change: restore what ran before
    BEGIN_RECOVERY = "begin recovery"  # a node died, and the launcher starts it again
    GO_ON_RECOVERING = "go on recovering"  # meanwhile, other nodes have died
    END_RECOVERY = "end recovery"  # the launcher has started all dead nodes again
    GIVE_UP = "give up"  # the launcher has stopped the configuration
    RETURN = "return"  # the hosts are back whose loss has stopped the configuration: deploy it again


class DeployedConfigurations:
    """The configuration that runs for one function, and those before it."""

    def __init__(self, probation: float) -> None:
        """Begin with nothing deployed.

        Args:
            probation: the time after a change in which the death of a node takes the change back, s.
        """
        self._probation = probation
        self._running: Configuration | None = None
        self._last_good: Configuration | None = None
        self._previous: Configuration | None = None  # what the running one has replaced
        self._waiting: Configuration | None = None
        self._recovering = False
        self._dead: frozenset[str] = frozenset()  # the dead nodes of the last report
        self._launcher_ended: float | None = None  # when the launcher was seen to have ended, while it has
        self._told_of_launcher = False
        self._torn: Configuration | None = None
        self._deployed_at = float("-inf")
        self._failure = ""

    @property
    def failure(self) -> str:
        """Why nothing runs, in one line; empty: something does, or nothing has failed. A release leaves it."""
        return "" if self._running else self._failure

    @property
    def waiting(self) -> Configuration | None:
        """The configuration that is deployed again when a lost host is back; None: there is none."""
        return self._waiting

    @property
    def running(self) -> Configuration | None:
        """The configuration that runs; None: none does."""
        return self._running

    @property
    def recovers(self) -> bool:
        """Whether the launcher starts nodes of the running configuration again, or has ended itself."""
        return self._recovering

    @property
    def dead(self) -> frozenset[str]:
        """The nodes that were dead by the last report."""
        return self._dead

    @property
    def last_good(self) -> Configuration | None:
        """The last configuration that came up; None: there is none to go back to."""
        return self._last_good

    @property
    def previous(self) -> Configuration | None:
        """The configuration that the running one has replaced; None: there was none."""
        return self._previous

    @property
    def torn(self) -> Configuration | None:
        """The configuration whose change was given up half-way for another request, with nothing restored; or None."""
        return self._torn

    def resume(self, running: Configuration | None, last_good: Configuration | None, failure: str = "") -> None:
        """Begin with what an earlier manipulator has left."""
        self._running, self._last_good, self._failure = running, running or last_good, failure

    def fallback(self, wanted: Configuration) -> Configuration | None:
        """Return the configuration to restore if the wanted one does not come up; None: there is none."""
        return self._last_good if self._last_good and self._last_good != wanted else self._running

    def refused(self, wanted: Configuration, reason: str) -> Outcome:
        """Return the outcome of a request that failed before anything was touched."""
        if self._running is None:
            return Outcome(Result.GENERAL_ERROR, None, f"{wanted.name}: {reason}")
        message = f"{wanted.name}: {reason}; {self._running.name} runs on"
        return Outcome(Result.FAILED, self._running, message, untouched=True)

    def finished(self, wanted: Configuration, outcome: Outcome, now: float) -> None:
        """Note how a change to a configuration ended."""
        if outcome.untouched:
            return
        self._running, self._waiting, self._recovering = outcome.running, None, False
        self._launcher_is_there()
        self._torn = wanted if outcome.running is None and outcome.result is not Result.GENERAL_ERROR else None
        self._failure = outcome.message if outcome.result is Result.GENERAL_ERROR else ""
        if outcome.running:
            replaces = outcome.result is Result.OK and self._last_good != outcome.running
            self._previous = self._last_good if replaces else None
            self._last_good, self._deployed_at = outcome.running, now

    def lacks_launcher(self, has_ended: bool, now: float) -> bool:
        """Tell, once, that nothing runs because the launcher has ended and does not come back; a recovery has begun.

        Args:
            has_ended: whether it has ended, and no other one has started since.
            now: the time.
        """
        if not has_ended or self._running is None:
            self._launcher_is_there()
            return False
        if self._launcher_ended is None:
            self._launcher_ended = now
        if self._told_of_launcher or now - self._launcher_ended <= LAUNCHER_GRACE:
            return False
        self._told_of_launcher = self._recovering = True
        return True

    def _launcher_is_there(self) -> None:
        self._launcher_ended, self._told_of_launcher = None, False

    def react(self, report: LauncherReport | None, now: float) -> Reaction:
        """Note the dead nodes of a report of the launcher, and return what to do; None: it has made none yet."""
        if report is None or report.state == CHANGING:
            return Reaction.NONE
        others_died = not self._dead.issuperset(report.dead)
        self._dead = frozenset(report.dead)
        if self._running is None:
            return Reaction.RETURN if self._waiting and report.state != FAILED else Reaction.NONE
        if report.configuration != self._running.name:
            return Reaction.DEPLOY_AGAIN
        if report.state == FAILED:
            return Reaction.GIVE_UP
        if report.state == RECOVERING and not self._recovering:
            on_probation = self._previous is not None and now - self._deployed_at < self._probation
            return Reaction.GO_BACK if on_probation else Reaction.BEGIN_RECOVERY
        recovers = self._recovering and not self._told_of_launcher  # else the report is of the one that has ended
        if report.state == STABLE:
            reaction = Reaction.END_RECOVERY
        else:
            reaction = Reaction.GO_ON_RECOVERING if others_died else Reaction.NONE
        return reaction if recovers else Reaction.NONE

    def lost(self) -> None:
        """Note that the running configuration runs no more, though it was the last good one."""
        self._running = None

    def failed(self, reason: str, waits: bool = False) -> None:
        """Note that the running configuration has failed: it is not restored.

        Args:
            reason: why, in one line.
            waits: whether a host was lost, so that it is deployed again when the host is back.
        """
        self._waiting = self._running if waits else None
        self._running = self._last_good = None
        self._recovering = False
        self._failure = reason

    def refuses(self, reason: str) -> None:
        """Note that the change that was under way is not begun again."""
        self._failure = reason

    def wait_for(self, configuration: Configuration) -> None:
        """Note that nothing runs, because a host was lost, and that a configuration is deployed when it is back."""
        self._waiting = configuration

    def released(self) -> None:
        """Note that the function is needed no longer: nothing is restored."""
        self._running = self._last_good = self._previous = self._waiting = None
        self._recovering, self._torn = False, None

    def begin_recovery(self) -> None:
        """Note that the launcher starts dead nodes again."""
        self._recovering = True

    def end_recovery(self) -> None:
        """Note that all nodes run again."""
        self._recovering = False
