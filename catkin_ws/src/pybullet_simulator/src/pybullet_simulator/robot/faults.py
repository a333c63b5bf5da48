"""Faults of devices while their driver keeps running: data that repeat, stamps that jump."""

from __future__ import annotations

from enum import Enum
from typing import Any

JUMP_S = 10.0
"""So far ahead of the clock are stamps that have jumped."""


class Fault(Enum):
    """What is wrong with a device."""

    REPEAT = "repeat"
    JUMP = "jump"


class Outlet:
    """The outlet of a driver's messages, which applies the fault.

    Attributes:
        fault: REPEAT: the last message is sent again and again. JUMP: every other stamp is ahead of its time.
    """

    def __init__(self) -> None:
        """Begin without a fault."""
        self.fault: Fault | None = None
        self._last: Any = None
        self._ahead = False

    def pass_on(self, message: Any) -> Any:
        """Return the message to send in place of a message with a header."""
        if self.fault is Fault.REPEAT and self._last is not None:
            return self._last
        self._last = message
        if self.fault is Fault.JUMP:
            self._ahead = not self._ahead
            if self._ahead:
                stamp = message.header.stamp
                message.header.stamp = type(stamp)(stamp.secs + int(JUMP_S), stamp.nsecs)
        return message
