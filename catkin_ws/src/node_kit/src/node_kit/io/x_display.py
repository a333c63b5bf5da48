"""The X display, for nodes and commands that open a window."""

from __future__ import annotations

import ctypes
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


class DisplayError(RuntimeError):
    """No window can open; the message says why, and what to do."""


@contextmanager
def held_display() -> Iterator[None]:
    """Keep a connection to the X display that DISPLAY names, until something else has one.

    A server such as Xvfb resets when its last client leaves, and refuses who comes in that moment.

    Raises:
        DisplayError: no display answers, or its library is missing.
    """
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError as error:
        raise DisplayError("a window needs libX11: ./mros setup --gui") from error
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if not display:
        raise DisplayError("a window needs an X display, and none answers: set DISPLAY, or do without the window")
    try:
        yield
    finally:
        x11.XCloseDisplay(ctypes.c_void_p(display))
