"""Errors that are told in one line, whatever names and values they quote."""

from __future__ import annotations

LONGEST = 1000
"""Characters of a line. What is longer loses its middle: the place is at the beginning, the remedy at the end."""


class OneLineError(Exception):
    """An error whose text is one line, safe for a terminal and not long."""

    def __init__(self, message: object = "") -> None:
        super().__init__(one_line(str(message)))


def printable(text: str) -> str:
    """Return a text that controls no terminal: control characters are escapes, but for the ends of lines."""
    if text.isprintable():
        return text
    return "".join(
        mark if mark.isprintable() or mark in "\n\t" else mark.encode("unicode_escape").decode() for mark in text
    )


def one_line(text: str, longest: int = LONGEST) -> str:
    """Return a text in one line, safe for a terminal, and without its middle where it is long."""
    half = longest // 2
    if len(text) > longest:
        text = f"{text[:half]} ... {text[-half:]}"
    if text.isprintable():
        return text
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)
