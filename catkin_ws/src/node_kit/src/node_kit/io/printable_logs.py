"""Log records that control no terminal, whatever names of others they quote."""

from __future__ import annotations

import logging

from node_kit.one_line import printable


class PrintableRecord(logging.LogRecord):
    """A record whose text has its control characters as escapes, but for the ends of lines."""

    def getMessage(self) -> str:  # noqa: N802 - logging's name
        """Return the text."""
        return printable(super().getMessage())


def print_safely() -> None:
    """Have all loggers of this process make such records."""
    logging.setLogRecordFactory(PrintableRecord)
