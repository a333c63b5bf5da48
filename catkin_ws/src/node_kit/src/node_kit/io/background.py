"""Work that waits for others, in threads that keep nobody from ending."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

_log = logging.getLogger(__name__)

PAUSE = 0.1
"""Wall s after an error that nobody foresaw, such as for want of memory."""


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


def again_and_again(step: Callable[[], object], lasts: Callable[[], bool]) -> None:
    """Do a step as long as something lasts. An error that nobody foresaw is logged, and costs no more than that step.

    Args:
        step: what a thread does that must not end; it waits itself for what is to be done.
        lasts: tells whether it is to go on.
    """
    while lasts():
        try:
            step()
        except Exception:
            with suppress(Exception):
                _log.exception("thread %s goes on", threading.current_thread().name)
            time.sleep(PAUSE)
