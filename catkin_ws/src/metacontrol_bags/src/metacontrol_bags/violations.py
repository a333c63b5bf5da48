"""Violations of limits: when a level was above its limit, how long until relief, and where the robot was.

A *piece* is a time for which the level stays above the limit. Levels are noisy: a violation that lasts has many pieces.
Pieces that are less than `CALM_S` apart belong to one *violation*; its *relief* is the end of its last piece.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from metacontrol_bags.record import Samples

CALM_S = 5.0
"""s: a level that kept its limit for this long is calm; what comes then is another violation."""

CELL_M = 0.5
"""m: width of the square cells in which places of violations are counted, about half the robot's length."""

Piece = tuple[float, float]
"""Start and end of a time above the limit, stamps in s."""


@dataclass(frozen=True)
class Violation:
    """Pieces that belong together.

    Attributes:
        start: stamp in s.
        relief: stamp in s from which on the level kept its limit; None where it was above it to the end.
        above_s: time above the limit, s.
        pieces: how many.
    """

    start: float
    relief: float | None
    above_s: float
    pieces: int


def describe(
    samples: Samples, poses: NDArray[np.float64], limit: float, start: float, end: float
) -> tuple[list[dict[str, Any]] | None, list[list[float]] | None]:
    """Return the violations of a limit within [start, end], and their places, as a summary has them.

    Returns:
        The violations, None where the level is not known; and cells [i, j, seconds], None where it or the way is not
        known.
    """
    pieces = pieces_above(samples, limit, start, end)
    if pieces is None:
        return None, None
    listed = [
        {
            "stamp_s": round(found.start - start, 4),
            "relief_s": None if found.relief is None else round(found.relief - found.start, 4),
            "above_s": round(found.above_s, 4),
            "pieces": found.pieces,
        }
        for found in violations(pieces, end)
    ]
    if not len(poses):
        return listed, None
    return listed, [[i, j, round(seconds, 2)] for (i, j), seconds in places(pieces, poses, end).items()]


def pieces_above(samples: Samples, limit: float, start: float, end: float) -> list[Piece] | None:
    """Return the pieces within [start, end], in the order of time; a sample holds until the next one.

    Returns:
        The pieces; None where no sample tells anything of that time.
    """
    if not samples or end <= start or samples[0][0] >= end:
        return None
    stamps = [max(stamp, start) for stamp, _ in samples]
    found: list[Piece] = []
    for begin, until, (_, level) in zip(stamps, [*stamps[1:], end], samples, strict=True):
        last = min(until, end)
        if level <= limit or begin >= last:
            continue
        first = found.pop()[0] if found and found[-1][1] == begin else begin
        found.append((first, last))
    return found


def violations(pieces: Sequence[Piece], end: float) -> list[Violation]:
    """Return the violations that pieces make up, given the end of the mission (stamp in s)."""
    groups: list[list[Piece]] = []
    for piece in pieces:
        if groups and piece[0] - groups[-1][-1][1] < CALM_S:
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return [
        Violation(
            start=group[0][0],
            relief=group[-1][1] if group[-1][1] < end else None,
            above_s=sum(until - begin for begin, until in group),
            pieces=len(group),
        )
        for group in groups
    ]


def places(pieces: Sequence[Piece], poses: NDArray[np.float64], end: float) -> dict[tuple[int, int], float]:
    """Return for how many s the level was above the limit in each cell.

    Args:
        pieces: of a mission.
        poses: (n, 3) array of stamp in s, x and y in m, in the order of time; a pose holds until the next one.
        end: of the mission, stamp in s.

    Returns:
        Seconds by cell (i, j), which covers x from i to i + 1 and y from j to j + 1 times `CELL_M`, in the map frame.
    """
    if not len(poses) or not pieces:
        return {}
    stamps = np.append(poses[:, 0], max(end, poses[-1, 0]))
    lengths = np.diff(np.array(pieces), axis=1)[:, 0]
    above = np.cumsum(lengths)  # s above the limit until the end of each piece
    spent = np.diff(np.interp(stamps, np.ravel(pieces), np.ravel(np.column_stack((above - lengths, above)))))
    found: dict[tuple[int, int], float] = {}
    for index in np.flatnonzero(spent > 0.0):
        i, j = np.floor(poses[index, 1:] / CELL_M)
        cell = int(i), int(j)
        found[cell] = found.get(cell, 0.0) + float(spent[index])
    return dict(sorted(found.items()))
