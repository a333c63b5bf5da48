"""What becomes of a request that comes while another one is carried out."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Policy(enum.Enum):
    """What a new request does."""

    WAIT = "wait"  # its turn comes
    REPLACE = "replace"  # it takes the place of all others: the running one is given up at once
    REFUSE = "refuse"  # it is refused while another one runs


@dataclass(frozen=True)
class Arrival:
    """What a new request does to itself and to others.

    Attributes:
        accepted: whether it will be carried out.
        dropped: requests that waited and will not be carried out any more.
        interrupts: whether the running one is to be given up.
    """

    accepted: bool
    dropped: tuple[str, ...] = ()
    interrupts: bool = False


class RequestQueue:
    """Requests by their ids: one runs, others may wait."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._running: str | None = None
        self._waiting: list[str] = []

    @property
    def running(self) -> str | None:
        """The request that is carried out."""
        return self._running

    def arrive(self, request: str) -> Arrival:
        """Take in a new request."""
        if self._policy is Policy.REFUSE and (self._running or self._waiting):
            return Arrival(accepted=False)
        dropped: tuple[str, ...] = ()
        if self._policy is Policy.REPLACE:
            dropped, self._waiting = tuple(self._waiting), []
        self._waiting.append(request)
        return Arrival(True, dropped, interrupts=self._policy is Policy.REPLACE and self._running is not None)

    def take_back(self, request: str) -> bool:
        """Take a request back that waits; return False where it does not wait (any more)."""
        if request not in self._waiting:
            return False
        self._waiting.remove(request)
        return True

    def next(self) -> str | None:
        """Begin with the next request, when none runs; return it, or None."""
        if self._running is None and self._waiting:
            self._running = self._waiting.pop(0)
            return self._running
        return None

    def finish(self) -> None:
        """Note that the running request is done with."""
        self._running = None
