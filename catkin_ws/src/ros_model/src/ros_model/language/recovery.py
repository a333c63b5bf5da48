"""Finds what to leave out of a text with an error, so that the errors after it can be found, too."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Set

_TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)|(?P<mark>[{}(),])|'(?:[^'\\]|\\.)*+'|"(?:[^"\\]|\\.)*+"|(?:(?!/\*)[^\s{}(),'"])++""",
    re.DOTALL,
)
_CLOSED_BY = {"{": "}", "(": ")"}
_NO_NEWLINE = re.compile(r"[^\n]+")


class _Token(NamedTuple):
    """A word, string or mark, and where it is in the text."""

    text: str
    start: int
    end: int


class Recovery:
    """Leaves out the wrong statements of a text, one after the other.

    What is left out grows from the rest of a statement over the statement to the block that holds it, as long as the
    error that comes next is at its end and so may only be its consequence. Where the brackets of the text do not match
    each other, nothing can be said of what belongs together, and nothing is tried.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[_Token] | None = None
        self._partners: dict[int, int] = {}  # of brackets, by index, both ways
        self._removed: tuple[int, int] | None = None  # the range of tokens that was left out last

    def is_consequence(self, offset: int) -> bool:
        """Return whether an error at that offset may follow from the part left out last, if that was a fragment."""
        if self._removed is None or self._index(offset) != self._removed[1]:
            return False
        start, end = self._removed
        return self._head(start) < start or (self._tokens or [])[end - 1].text not in {",", "}", ")"}

    def without(self, offset: int, expected: Set[str]) -> str | None:
        """Return the text without the statement in which an error is, at the same lines and columns; None if it can't.

        Args:
            offset: where the error is.
            expected: words that could stand there; the next of them starts another statement.
        """
        if self._tokens is None and not self._scan():
            return None
        index = self._index(offset)
        if self._removed and self.is_consequence(offset):
            removed = self._grown(*self._removed)
        elif self._is_inside(index):
            removed = self._rest(index, expected)
        else:
            return None
        if removed is None:
            return None
        self._removed = removed
        self._text = self._blanked(*removed)
        return self._text

    def _scan(self) -> bool:
        """Split the text into tokens; whether all brackets have their partners and all strings their ends."""
        self._tokens = []
        open_brackets: list[int] = []
        position = 0
        while position < len(self._text):
            match = _TOKEN.match(self._text, position)
            if match is None:
                return False
            position = match.end()
            if match["skip"] is not None:
                continue
            index = len(self._tokens)
            self._tokens.append(_Token(match[0], match.start(), match.end()))
            if match[0] in _CLOSED_BY:
                open_brackets.append(index)
            elif match[0] in {"}", ")"}:
                if not open_brackets or _CLOSED_BY[self._tokens[open_brackets[-1]].text] != match[0]:
                    return False
                partner = open_brackets.pop()
                self._partners[partner], self._partners[index] = index, partner
        return not open_brackets

    def _index(self, offset: int) -> int:
        """Return the index of the token that is at the offset, or is the next."""
        tokens = self._tokens or []
        low, high = 0, len(tokens)
        while low < high:
            middle = (low + high) // 2
            if tokens[middle].end <= offset:
                low = middle + 1
            else:
                high = middle
        return low

    def _is_inside(self, index: int) -> bool:
        """Return whether a token is within the first bracket of the text: outside of it, nothing can be left out."""
        first = next((number for number, token in enumerate(self._tokens or ()) if token.text in _CLOSED_BY), None)
        return first is not None and first < index < self._partners[first]

    def _rest(self, index: int, expected: Set[str]) -> tuple[int, int] | None:
        """Return the range from a token to the end of its statement."""
        tokens = self._tokens or []
        end = index
        while end < len(tokens):
            text = tokens[end].text
            if text in {"}", ")"}:
                break
            if text == ",":
                return index, end + (end == index or self._head(index) == index)
            if end > index and text in expected:
                break
            if text in _CLOSED_BY:
                end = self._partners[end] + 1
                if not (end < len(tokens) and tokens[end].text == ","):
                    break
                continue
            end += 1
        return (index, end) if end > index else self._grown(index, end)

    def _grown(self, start: int, end: int) -> tuple[int, int] | None:
        """Return a larger range: from the head of its statement, else the statement with the block that it is in."""
        tokens = self._tokens or []
        head = self._head(start)
        if head < start:
            return head, self._with_comma(end)
        opening = head - 1
        while opening >= 0 and tokens[opening].text not in _CLOSED_BY:
            opening = self._partners.get(opening, opening) - 1
        if opening <= 0 or self._head(opening) == 0:
            return None
        return self._head(opening), self._with_comma(self._partners[opening] + 1)

    def _with_comma(self, end: int) -> int:
        """Return the end of a range of whole statements, the comma after them included."""
        tokens = self._tokens or []
        return end + (end < len(tokens) and tokens[end].text == ",")

    def _head(self, index: int) -> int:
        """Return where the statement of a token begins: after the mark before it, be it a bracket or a comma."""
        tokens = self._tokens or []
        while index > 0 and tokens[index - 1].text not in {"{", "}", "(", ")", ","}:
            index -= 1
        return index

    def _blanked(self, start: int, end: int) -> str:
        tokens = self._tokens or []
        first, last = tokens[start].start, tokens[end - 1].end
        blank = _NO_NEWLINE.sub(lambda match: " " * len(match[0]), self._text[first:last])
        return self._text[:first] + blank + self._text[last:]
