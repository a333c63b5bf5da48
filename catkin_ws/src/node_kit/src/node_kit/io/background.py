"""Work that waits for others, in threads that keep nobody from ending."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


class NoThreadError(OSError):
    """The system gives no thread now, such as for want of memory."""

    def __init__(self, error: Exception) -> None:
        """Note what Python has raised."""
        super().__init__(f"no thread could be started: {error}")


def start_thread(work: Callable[[], Any], name: str) -> None:
    """Do work in a daemon thread of its own.

    Args:
        work: may hang for ever.
        name: of the thread.

    Raises:
        NoThreadError: it could not be started.
    """
    try:
        threading.Thread(target=work, name=name, daemon=True).start()
    except RuntimeError as error:
        raise NoThreadError(error) from error


def in_background(work: Callable[[], Any], name: str) -> Future[Any]:
    """Do work in a daemon thread of its own, and return what comes of it: NoThreadError where none could be started.

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

    try:
        start_thread(do, name)
    except NoThreadError as error:
        future.set_exception(error)
    return future
