"""The error of a model, or of a file that belongs to it, that can't be used."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from node_kit.one_line import one_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ros_model.language.metamodel import Position


_TOLD = 20
"""Errors that are told at once, as many as of a model."""


class ModelError(Exception):
    """A model can't be read, written or used; the text is one line that says what, where and what to do.

    Args:
        message: what is wrong.
        position: where in a file, if it is known; it opens the text as `file:line:column: `.
        others: what else is wrong in the same file, in the order of the file.
        rule: of `rosmodel check`, that the content of a readable file breaks; "": the file can't be read.
    """

    def __init__(
        self, message: str, position: Position | None = None, others: Iterable[ModelError] = (), rule: str = ""
    ) -> None:
        super().__init__(one_line(message if position is None else f"{position}: {message}"))
        self.message = message
        self.position = position
        self.others = tuple(others)
        self.rule = rule

    @property
    def all(self) -> tuple[ModelError, ...]:
        """This error and the others, in the order of the file."""
        return (self, *self.others)


def printable(text: str) -> str:
    """Return a text on one line, safe for a terminal: quoted text may have line breaks or control characters."""
    return one_line(text, sys.maxsize)


def short(text: str) -> str:
    """Return a text as a message can quote it."""
    return text if len(text) <= 40 else f"{text[:37]}..."


def first_of(errors: Iterable[ModelError]) -> ModelError:
    """Return the error that comes first in the file, with the rest as its others; errors that say the same are one."""
    first, *others = sorted({str(error): error for error in errors}.values(), key=_place)
    return ModelError(first.message, first.position, others, first.rule)


def _place(error: ModelError) -> tuple[str, int, int]:
    where = error.position
    return (where.file, where.line, where.column) if where else ("", 0, 0)


class Gathered:
    """Gathers errors of independent steps, to report all of them at once."""

    def __init__(self) -> None:
        self._errors: list[ModelError] = []

    @contextmanager
    def step(self) -> Iterator[None]:
        """Go on after an error."""
        try:
            yield
        except ModelError as error:
            self._errors += error.all

    def add(self, errors: Iterable[ModelError]) -> None:
        """Add errors that were not raised."""
        self._errors += errors

    def tell(self) -> None:
        """Raise what was gathered, the first 20.

        Raises:
            ModelError: there is something.
        """
        if self._errors:
            first = first_of(self._errors)
            raise ModelError(first.message, first.position, first.others[: _TOLD - 1], first.rule)
