"""Logs that leave out a line where it can't be written, as the handlers of `logging` do.

rospy's handler raises in whoever logs: a full disk, or a pipe that nobody reads any more, would end the node.
"""

from __future__ import annotations

import contextlib
import logging


def forgive() -> None:
    """Have no handler that any logger has raise an error because it can't write."""
    loggers = [logging.root, *logging.root.manager.loggerDict.values()]
    handlers = {handler for logger in loggers if isinstance(logger, logging.Logger) for handler in logger.handlers}
    for handler in handlers:
        if not isinstance(handler.emit, _Forgiving):
            handler.emit = _Forgiving(handler)  # type: ignore[method-assign]


class _Forgiving:
    def __init__(self, handler: logging.Handler) -> None:
        self._emit = handler.emit

    def __call__(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError, ValueError):  # ValueError: the stream is closed
            self._emit(record)
