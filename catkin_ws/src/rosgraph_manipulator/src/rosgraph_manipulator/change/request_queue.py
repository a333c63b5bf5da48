"""What happens to a request that arrives while another one is carried out."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Policy(enum.Enum):
    """What a new request does while another one is carried out."""

    WAIT = "wait"  # it waits for its turn
    REPLACE = "replace"  # it replaces all others: the running one is interrupted at once
    REFUSE = "refuse"  # it is refused


@dataclass(frozen=True)
class Arrival:
    """What happens when a request arrives.

    Attributes:
        accepted: whether it will be carried out.
        dropped: waiting requests that will not be carried out.
        interrupts: whether the running request must be interrupted.
    """

    accepted: bool
    dropped: tuple[str, ...] = ()
    interrupts: bool = False


class RequestQueue:
    """The ids of requests: one runs, others may wait."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._running: str | None = None
        self._waiting: list[str] = []

    @property
    def running(self) -> str | None:
        """The request that is carried out; None: none is."""
        return self._running

    def arrive(self, request: str) -> Arrival:
        """Add a new request, and return what happens."""
        if self._policy is Policy.REFUSE and (self._running or self._waiting):
            return Arrival(accepted=False)
        dropped: tuple[str, ...] = ()
        if self._policy is Policy.REPLACE:
            dropped, self._waiting = tuple(self._waiting), []
        self._waiting.append(request)
        return Arrival(True, dropped, interrupts=self._policy is Policy.REPLACE and self._running is not None)

    def take_back(self, request: str) -> bool:
        """Remove a waiting request; return False where it does not wait."""
        if request not in self._waiting:
            return False
        self._waiting.remove(request)
        return True

    def next(self) -> str | None:
        """Begin the next request where none runs, and return it; None where there is nothing to begin."""
        if self._running is None and self._waiting:
            self._running = self._waiting.pop(0)
            return self._running
        return None

    def finish(self) -> None:
        """Note that the running request has ended."""
        self._running = None
