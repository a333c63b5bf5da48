"""When a node that ended is started again, and when its configuration is given up."""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass

from rosgraph_launcher.description import NodeDescription

_MOST_DOUBLINGS = 1000  # of a delay; a float holds no more than 1023


class Meaning(enum.Enum):
    """What the end of a node means."""

    FINISHED = "finished"  # it has done its work
    TURN = "turn"  # it has done its work for this time, and its launch file wants it again
    DEATH = "death"  # it should run on
    FAILURE = "failure"  # its configuration is nothing without it


class Verdict(enum.Enum):
    """What follows from the end of a node."""

    FINISHED = "finished"  # it has done its work
    RESTART = "restart"  # it is started again after a delay
    GIVE_UP = "give up"  # at least one function is stopped


@dataclass(frozen=True)
class Ending:
    """The end of a node.

    Attributes:
        verdict: what follows.
        text: a line for the operator.
        stopped: the nodes to end: a function that needs them is given up and no other one does, or they are started
            again together with the node that ended.
    """

    verdict: Verdict
    text: str
    stopped: tuple[str, ...] = ()


def meaning_of_end(node: NodeDescription, status: int | None, serves: bool, replaced: bool) -> Meaning:
    """Return what the end of a node means.

    Args:
        node: how it was started.
        status: its exit status, negative for a signal.
        serves: whether it had topics or services of its own.
        replaced: whether somebody else's node has taken its name, so that the master told it to end.
    """
    if node.required and not replaced:
        return Meaning.FAILURE
    if status != 0 or replaced:
        return Meaning.DEATH
    if node.respawn:
        return Meaning.TURN
    return Meaning.DEATH if serves else Meaning.FINISHED


@dataclass(frozen=True)
class RestartPolicy:
    """How many deaths are tolerated, as in Erlang's supervisors, and how long a restart is delayed.

    Attributes:
        intensity: the most deaths within `period` after which nodes are still restarted.
        period: length of the window in which deaths are counted, s.
        first_delay: time from a node's first death to its restart, s. It doubles with each further death of the same
            node within `period`.
        longest_delay: upper limit of the delay, s.
    """

    intensity: int = 3
    period: float = 30.0
    first_delay: float = 0.1
    longest_delay: float = 5.0


class DeathCounter:
    """Counts the deaths of one configuration's nodes."""

    def __init__(self, policy: RestartPolicy) -> None:
        self._policy = policy
        self._deaths: deque[tuple[float, str]] = deque()

    def reset(self) -> None:
        """Forget all deaths, because another configuration begins."""
        self._deaths.clear()

    def count(self, node: str, now: float) -> float | None:
        """Count the death of a node at `now` (s).

        Returns:
            The time at which to start the node again (s), or None where the configuration has had too many deaths.
        """
        while self._deaths and now - self._deaths[0][0] > self._policy.period:
            self._deaths.popleft()
        before = sum(name == node for _, name in self._deaths)
        self._deaths.append((now, node))
        if len(self._deaths) > self._policy.intensity:
            return None
        return now + min(self._policy.first_delay * 2.0 ** min(before, _MOST_DOUBLINGS), self._policy.longest_delay)
