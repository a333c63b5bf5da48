"""What is raised when a model, or a file that belongs to it, can't be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.metamodel import Position


class ModelError(Exception):
    """A model can't be read, written or used; the text is one line that says what, where and what to do.

    Args:
        message: what is wrong.
        position: where in a file, if it is known; it opens the text as `file:line:column: `.
        others: what else is wrong in the same file, in the order of the file.
    """

    def __init__(self, message: str, position: Position | None = None, others: Iterable[ModelError] = ()) -> None:
        super().__init__(printable(message if position is None else f"{position}: {message}"))
        self.message = message
        self.position = position
        self.others = tuple(others)

    @property
    def all(self) -> tuple[ModelError, ...]:
        """This error and the others, in the order of the file."""
        return (self, *self.others)


def printable(text: str) -> str:
    """Return a text on one line: what is quoted may span lines, command a terminal, or be no character at all."""
    if text.isprintable():
        return text
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)


def first_of(errors: Iterable[ModelError]) -> ModelError:
    """Return the error that comes first in the file, with the rest as its others; errors that say the same are one."""
    ordered = sorted(
        {str(error): error for error in errors}.values(),
        key=lambda error: (error.position.line, error.position.column) if error.position else (0, 0),
    )
    first, *others = ordered
    return ModelError(first.message, first.position, others)
