"""What happens to a request that arrives while another one is carried out."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Policy(enum.Enum):
    """What a new request does while another one of the same function is carried out or waits."""

    WAIT = "wait"  # it waits for its turn
    REPLACE = "replace"  # it replaces the others: the running one is interrupted at once
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
    """The ids of requests: one runs, others may wait. Requests of different functions do not concern each other."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._running: str | None = None
        self._functions: dict[str, str] = {}  # by request
        self._waiting: list[str] = []

    @property
    def running(self) -> str | None:
        """The request that is carried out; None: none is."""
        return self._running

    def arrive(self, request: str, function: str) -> Arrival:
        """Add a new request for a function, and return what happens."""
        runs = self._running is not None and self._functions[self._running] == function
        rivals = [waiting for waiting in self._waiting if self._functions[waiting] == function]
        if self._policy is Policy.REFUSE and (runs or rivals):
            return Arrival(accepted=False)
        dropped: tuple[str, ...] = ()
        if self._policy is Policy.REPLACE:
            dropped = tuple(rivals)
            for rival in rivals:
                self.take_back(rival)
        self._functions[request] = function
        self._waiting.append(request)
        return Arrival(True, dropped, interrupts=self._policy is Policy.REPLACE and runs)

    def take_back(self, request: str) -> bool:
        """Remove a waiting request; return False where it does not wait."""
        if request not in self._waiting:
            return False
        self._waiting.remove(request)
        del self._functions[request]
        return True

    def next(self) -> str | None:
        """Begin the next request where none runs, and return it; None where there is nothing to begin."""
        if self._running is None and self._waiting:
            self._running = self._waiting.pop(0)
            return self._running
        return None

    def finish(self) -> None:
        """Note that the running request has ended."""
        if self._running is not None:
            del self._functions[self._running]
        self._running = None
