"""What is raised when a model, or a file that belongs to it, can't be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ros_model.metamodel import Position


class ModelError(Exception):
    """A model can't be read, written or used; the text is one line that says what, where and what to do.

    Args:
        message: what is wrong.
        position: where in a file, if it is known; it opens the text as `file:line:column: `.
    """

    def __init__(self, message: str, position: Position | None = None) -> None:
        message = message.replace("\n", "\\n")  # what it quotes may span lines
        super().__init__(message if position is None else f"{position}: {message}")
        self.message = message
        self.position = position
