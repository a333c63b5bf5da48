"""When a node that died is started again, and when that is given up."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True)
class RestartPolicy:
    """Erlang's supervisors, with back-off.

    Attributes:
        intensity: this many deaths are made good within `period`; one more, and the configuration has failed.
        period: s.
        first_delay: from a death to the restart, s; doubled with every further death of the node within `period`.
        longest_delay: s.
    """

    intensity: int = 3
    period: float = 30.0
    first_delay: float = 0.1
    longest_delay: float = 5.0


class Supervisor:
    """Counts the deaths of one configuration's nodes."""

    def __init__(self, policy: RestartPolicy) -> None:
        self._policy = policy
        self._deaths: deque[tuple[float, str]] = deque()

    def reset(self) -> None:
        """Forget all deaths, for another configuration."""
        self._deaths.clear()

    def died(self, node: str, now: float) -> float | None:
        """Take in a death at `now` (s).

        Returns:
            The time at which to start the node again (s); None: there were too many deaths, give up.
        """
        while self._deaths and now - self._deaths[0][0] > self._policy.period:
            self._deaths.popleft()
        before = sum(name == node for _, name in self._deaths)
        self._deaths.append((now, node))
        if len(self._deaths) > self._policy.intensity:
            return None
        return now + min(self._policy.first_delay * 2**before, self._policy.longest_delay)
