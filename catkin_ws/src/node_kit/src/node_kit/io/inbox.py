"""A queue of work that other threads leave for one thread.

No queue.SimpleQueue: in CPython 3.7 to 3.11 its timed get can wait for ever. After a signal it computes the time that
is left (`_queue_SimpleQueue_get_impl` in Modules/_queuemodule.c), and where the deadline has passed, that is negative,
which the lock below takes for "no limit". CPython's present source checks it; Debian 12 has 3.11.2. Measured there,
gets that only a later put ended:

| signal | SimpleQueue | Queue |
|---|---|---|
| its handler outlasts the deadline | 10 of 10 | 0 of 10 |
| an empty handler, within 0.1 ms of the deadline (2 ms) | 7 of 400 | 0 of 4,000 |
| an empty handler, 4 ms before the deadline, two other threads compute | 3 of 100 | 0 of 100 |
| sent to a waiting thread that is not the main thread, every 0.3 ms, deadline 3 ms | 38 of 400 | 0 of 400 |

threading.Condition, on which Queue and this class are built, gives such a wait up.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections import deque
from concurrent.futures import CancelledError, Future, InvalidStateError
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class ClosedError(Exception):
    """The inbox is closed: its thread does nothing more."""


class Inbox:
    """A queue of calls: any thread adds one, and one thread makes them in their order."""

    def __init__(self, wake: Callable[[], object] | None = None) -> None:
        """Make an empty inbox.

        Args:
            wake: called after each put, from the thread that puts; for a thread that waits for something else as well.
        """
        self._wake = wake
        self._work: deque[Callable[[], object]] = deque()
        self._news = threading.Condition()
        self._calls: set[Future[Any]] = set()  # those that somebody waits for
        self._closed = ""

    def __len__(self) -> int:
        """Return how many pieces of work wait."""
        return len(self._work)

    # From any thread

    def put(self, work: Callable[[], object], at_most: float = math.inf) -> bool:
        """Leave work. If it raises an exception, the thread that does it gets that.

        Args:
            work: what is to be done.
            at_most: nothing is left where so many pieces of work wait already.

        Returns:
            Whether it was left.
        """
        with self._news:
            if len(self._work) >= at_most:
                return False
            self._work.append(work)
            self._news.notify()
        if self._wake:
            self._wake()
        return True

    def call(self, work: Callable[[], T], patience_s: float | None = None) -> T:
        """Leave work, wait until it is done and return its result; from any other thread than the one that does it.

        Args:
            work: what is to be done.
            patience_s: wall s; None is as long as it takes.

        Raises:
            TimeoutError: it was not done in time. Where it had not begun, it is not done any more.
            ClosedError: the inbox is closed, or was closed meanwhile.
            Exception: what the work raises, here and not where it is done.
        """
        future: Future[T] = Future()

        def do() -> None:
            if not future.set_running_or_notify_cancel():
                return  # nobody waits any more
            try:
                result = work()
            except Exception as error:  # the caller's
                with contextlib.suppress(InvalidStateError):  # closed meanwhile
                    future.set_exception(error)
            else:
                with contextlib.suppress(InvalidStateError):
                    future.set_result(result)

        with self._news:
            if self._closed:
                raise ClosedError(self._closed)
            self._calls.add(future)
        try:
            self.put(do)
            return future.result(patience_s)
        except CancelledError:
            raise ClosedError(self._closed) from None
        except FutureTimeoutError:  # before Python 3.11 this is not the built-in one
            if future.done():  # just now, or that was an error of the work
                return future.result()
            future.cancel()
            raise TimeoutError(f"the call got no answer within {patience_s:g} s") from None
        finally:
            with self._news:
                self._calls.discard(future)

    def close(self, reason: str) -> None:
        """Raise a ClosedError with a reason in all calls that wait, and in all later calls."""
        with self._news:
            self._closed = self._closed or reason
            calls = list(self._calls)
        for future in calls:
            with contextlib.suppress(InvalidStateError):  # done just now
                future.cancel() or future.set_exception(ClosedError(reason))  # type: ignore[func-returns-value]

    # From the thread that does the work

    def wait(self, longest_s: float) -> bool:
        """Wait until there is work, for a given number of wall s at most; return whether there is."""
        with self._news:
            return self._news.wait_for(lambda: bool(self._work), longest_s)

    def do_next(self, wait_s: float = 0.0) -> bool:
        """Wait for work, for a given number of wall s at most; do the first piece, and return whether there was one."""
        if not self._work and not (wait_s and self.wait(wait_s)):
            return False
        self._work.popleft()()
        return True

    def drain(self, wait_s: float = 0.0) -> None:
        """Do the work that waits now; if there is none, wait for some. Later work stays in the queue."""
        if not self._work and wait_s:
            self.wait(wait_s)
        for _ in range(len(self._work)):
            self._work.popleft()()
