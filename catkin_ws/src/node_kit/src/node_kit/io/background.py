"""Work that waits for others, in threads that keep nobody from ending."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


def in_background(work: Callable[[], Any], name: str) -> Future[Any]:
    """Do work in a daemon thread of its own, and return what comes of it.

    Args:
        work: may hang for ever.
        name: of the thread.
    """
    future: Future[Any] = Future()

    def do() -> None:
        try:
            future.set_result(work())
        except Exception as error:
            future.set_exception(error)

    threading.Thread(target=do, name=name, daemon=True).start()
    return future
