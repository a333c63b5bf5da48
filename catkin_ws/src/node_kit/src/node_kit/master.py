"""Decides from the master's answers, and from their times, whether the ROS master is there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

PERIOD = 0.3
"""Wall s between two questions to a master that is there."""
SECOND_LOOK = 0.15
"""Wall s after a refusal to the question that confirms it."""
_APART = 0.1
"""Wall s between the first refusal and the one that confirms it, at least."""
TIMEOUT = 1.2
"""Wall s for an answer: with a period before it, silence is told within 2 s."""
LONG_TIMEOUT = 4.0
"""The same for a master that is silent: it may be overloaded, and answer late."""
PATIENCE = 10.0
"""Wall s for which the silence of the master is borne."""
_SHORTEST_TIMEOUT = 0.1


@dataclass(frozen=True)
class Answer:
    """The master has answered."""

    pid: int
    """Its process id, which tells it from another master at its address."""


@dataclass(frozen=True)
class Refusal:
    """Nothing listens at the master's address."""


@dataclass(frozen=True)
class Silence:
    """There was no answer, or one that makes no sense."""

    reason: str


class Standing(Enum):
    """The state of the master, as the node sees it."""

    UNKNOWN = "unknown"
    THERE = "there"
    REFUSED = "refused, to be confirmed"
    SILENT = "silent, and borne so far"
    GONE = "gone"
    ANOTHER = "another one"
    MUTE = "silent for too long"


LOST = frozenset({Standing.GONE, Standing.ANOTHER, Standing.MUTE})


@dataclass(frozen=True)
class View:
    """The node's view of the master after all answers so far."""

    standing: Standing = Standing.UNKNOWN
    pid: int | None = None
    """None before the first answer."""
    reason: str = ""
    """Why there was no answer."""
    refused_at: float | None = None
    silent_since: float | None = None

    @property
    def lost(self) -> bool:
        """Tell whether the node has to end, because a new master would not know it."""
        return self.standing in LOST

    @property
    def pause(self) -> float:
        """Return the wall s until the next question."""
        return SECOND_LOOK if self.standing is Standing.REFUSED else PERIOD

    def timeout(self, now: float, patience: float = PATIENCE) -> float:
        """Return the wall s in which a question that is asked now must be answered."""
        if self.silent_since is None:
            return TIMEOUT
        return max(_SHORTEST_TIMEOUT, min(LONG_TIMEOUT, self.silent_since + patience - now))

    def after(self, came: Answer | Refusal | Silence, asked: float, now: float, patience: float = PATIENCE) -> View:
        """Return the view after a question.

        Args:
            came: what came of it.
            asked: when it was put, monotonic wall s.
            now: when that came.
            patience: wall s for which silence is borne.
        """
        if isinstance(came, Answer):
            if self.pid in (None, came.pid):
                return View(Standing.THERE, came.pid)
            return replace(self, standing=Standing.ANOTHER)
        if isinstance(came, Refusal):
            if self.refused_at is None:
                return replace(self, standing=Standing.REFUSED, refused_at=asked)
            standing = Standing.GONE if asked - self.refused_at >= _APART else Standing.REFUSED
            return replace(self, standing=standing)
        since = asked if self.silent_since is None else self.silent_since
        standing = Standing.MUTE if now - since >= patience else Standing.SILENT
        return replace(self, standing=standing, reason=came.reason, refused_at=None, silent_since=since)

    def text(self, uri: str, consequence: str, patience: float = PATIENCE) -> str:
        """Return the line that says that the master does not answer or is lost."""
        if self.standing is Standing.SILENT:
            return f"ROS master {uri} does not answer ({self.reason}): it ends if that lasts for {patience:g} s"
        if self.standing is Standing.MUTE:
            return f"ROS master {uri} does not answer ({self.reason}): {consequence}"
        if self.standing is Standing.ANOTHER:
            return f"ROS master {uri} is another one, which knows nothing of this node: {consequence}"
        if self.pid is None:
            return f"no ROS master answers at {uri}: start roscore or set ROS_MASTER_URI"
        return f"ROS master {uri} is gone: {consequence}"
