"""Work for one thread, left by others."""

from __future__ import annotations

import queue
from concurrent.futures import Future
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Inbox:
    """Threads leave work; one thread does it, in the order in which it came."""

    def __init__(self) -> None:
        """Holds nothing yet."""
        self._work: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()

    def put(self, work: Callable[[], object]) -> None:
        """Leaves work; from any thread. What it raises comes up where it is done."""
        self._work.put(work)

    def call(self, work: Callable[[], object], patience_s: float) -> None:
        """Leaves work and waits until it is done; from any other thread than the one that does it.

        Raises:
            TimeoutError: it was not done within so many wall seconds.
            Exception: what the work raises, here and not where it is done.
        """
        future: Future[object] = Future()

        def do() -> None:
            try:
                future.set_result(work())
            except Exception as error:  # the caller's
                future.set_exception(error)

        self.put(do)
        future.result(patience_s)

    def drain(self, wait_s: float = 0.0) -> None:
        """Does what was left; waits for the first so many wall seconds."""
        try:
            self._work.get(timeout=wait_s)() if wait_s else self._work.get_nowait()()
            while True:
                self._work.get_nowait()()
        except queue.Empty:
            return
