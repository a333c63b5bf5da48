"""Comments of models: those at the top of a file are its header, the others belong to the elements beside them."""

from __future__ import annotations

import bisect
import dataclasses
import re
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

from ros_model.language import notation
from ros_model.language.metamodel import (
    Component,
    ComponentStack,
    Connection,
    Port,
    RosParameter,
    RosSystem,
    SystemParameter,
)
from ros_model.language.packages import Artifact, Node, Package, ParameterDeclaration, PortDeclaration, Spec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.language.packages import PackageSet

_ELEMENTS = (  # what has a line of its own in the canonical form
    RosSystem,
    Component,
    ComponentStack,
    Port,
    RosParameter,
    Connection,
    SystemParameter,
    Package,
    Artifact,
    Node,
    PortDeclaration,
    ParameterDeclaration,
    Spec,
)
_COMMENT = re.compile(r"\s*(?://(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/)", re.DOTALL)
_TOKEN = re.compile(
    r"""(?P<comment>//(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/)|'(?:[^'\\]|\\.)*+'|"(?:[^"\\]|\\.)*+"|[{}(),]"""
    r"""|(?:(?!/\*)[^\s{}(),'"])++""",
    re.DOTALL,
)


_OPENING, _CLOSING, _NAME = {"{", "("}, {"}", ")"}, {"Name", "name"}


class _Place(NamedTuple):
    """A line and a column, from 1."""

    line: int
    column: int


_END = _Place(0, 0)  # behind all elements


def header(text: str) -> str:
    """Return the comments at the top of a file, without their marks."""
    lines: list[str] = []
    end = 0
    while match := _COMMENT.match(text, end):
        end = match.end()
        lines += _lines(match)
    return "\n".join(lines)


def with_comments(text: str, model: RosSystem | PackageSet, formatted: str, again: RosSystem | PackageSet) -> str:
    """Return a formatted text with the comments of the text that it comes from, each above its element.

    A comment belongs to the element that it follows on its line, else to the next one in the same braces, else to the
    one before it. Those of the file's outermost element stand above its first line inside, those behind it at the end.

    Args:
        text: what was read.
        model: what it says.
        formatted: the same model in the canonical form.
        again: the model that this reads as, with its positions.
    """
    places = {old: new for old, new in zip(_places(model), _places(again), strict=True) if old.line and new.line}
    outermost = next(_places(model)) if isinstance(model, RosSystem) else None
    inside = len(notation.comments(again.header)) + 2
    formatted_lines = formatted.split("\n")
    above: dict[int, list[str]] = defaultdict(list)
    for owner, lines in _owned(text, sorted(places), outermost):
        if owner is _END:
            above[len(formatted_lines)] += lines
        else:
            above[places[owner].line if owner and owner != outermost else inside] += lines
    result: list[str] = []
    for number, line in enumerate(formatted_lines, start=1):
        indent = line[: len(line) - len(line.lstrip())]
        result += [f"{indent}// {comment}".rstrip() for comment in above.get(number, ())]
        result.append(line)
    return "\n".join(result)


def _owned(text: str, elements: list[_Place], named: _Place | None) -> Iterator[tuple[_Place | None, list[str]]]:
    """Yield the comments that are not at the top, each with the place of its element; None before the first one.

    Args:
        text: what was read.
        elements: where the elements are, in order.
        named: where the outermost element is, if it has a name inside.
    """
    start = 0
    while match := _COMMENT.match(text, start):
        start = match.end()
    line, line_start, looked_at = 1, 0, 0
    previous, previous_line, depth = "", 0, 0
    pending: list[tuple[_Place, list[str]]] = []  # comments that belong to the next element, if it is in these braces
    for match in _TOKEN.finditer(text):
        if breaks := text.count("\n", looked_at, match.start()):
            line, line_start = line + breaks, text.rfind("\n", looked_at, match.start()) + 1
        looked_at = match.start()
        place = _Place(line, match.start() - line_start + 1)
        if match["comment"] is None:
            depth += (match[0] in _OPENING) - (match[0] in _CLOSING)
            at = named if depth == 1 and match[0] in _NAME else place if place in _known(elements, place) else None
            if pending and (at or match[0] in _CLOSING):
                for comment, lines in pending:
                    yield at or _before(elements, comment), lines
                pending = []
            previous, previous_line = match[0], line + match[0].count("\n")
        elif match.start() >= start:
            if depth == 0 and previous in _CLOSING:
                yield _END, _lines(match)
            elif previous_line == line and previous not in _OPENING:
                yield _before(elements, place), _lines(match)
            else:
                pending.append((place, _lines(match)))
    for comment, lines in pending:
        yield _before(elements, comment), lines


def _known(elements: list[_Place], place: _Place) -> list[_Place]:
    index = bisect.bisect_left(elements, place)
    return elements[index : index + 1]


def _before(elements: list[_Place], place: _Place) -> _Place | None:
    index = bisect.bisect_left(elements, place)
    return elements[index - 1] if index else None


def _places(model: object) -> Iterator[_Place]:
    """Yield where the elements of a model are, in the order of the model."""
    if isinstance(model, _ELEMENTS):
        yield _Place(model.position.line, model.position.column)
    for field in dataclasses.fields(model):  # type: ignore[arg-type]
        value = getattr(model, field.name)
        if isinstance(value, tuple):
            for item in value:
                if isinstance(item, _ELEMENTS):
                    yield from _places(item)


def _lines(match: re.Match[str]) -> list[str]:
    if match["line"] is not None:
        return [match["line"].removeprefix(" ").rstrip()]
    block = [line.strip().removeprefix("*").removeprefix(" ").rstrip() for line in match["block"].splitlines()]
    return "\n".join(block).strip("\n").split("\n")
