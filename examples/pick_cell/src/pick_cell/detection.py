"""Two ways to find parts in an image: a sharp one that needs light, and a coarse one that does not."""

from __future__ import annotations

import numpy as np

WINDOW = 9
"""Pixels; about the size of a part."""
BLOCK = 20
"""Pixels; edge of the squares of the coarse way."""


def find_sharply(image: np.ndarray, brightness: float) -> list[tuple[float, float]]:
    """Return the centres (x, y) of all spots that are as large as a part and brighter than a value from 0 to 255."""
    sums = np.pad(image.astype(np.int64), ((1, 0), (1, 0))).cumsum(0).cumsum(1)
    size = WINDOW
    means = (sums[size:, size:] - sums[:-size, size:] - sums[size:, :-size] + sums[:-size, :-size]) / size**2
    found = []
    while means.max() > brightness:
        row, column = (int(index) for index in np.unravel_index(means.argmax(), means.shape))
        found.append((column + size / 2, row + size / 2))
        means[max(row - size, 0) : row + size + 1, max(column - size, 0) : column + size + 1] = 0.0
    return found


def find_coarsely(image: np.ndarray, contrast: float) -> list[tuple[float, float]]:
    """Return the centres (x, y) of the squares that are brighter than most by a factor, and than those beside."""
    height, width = image.shape
    squares = image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).mean(axis=(1, 3))
    padded = np.pad(squares, 1)
    beside = [padded[y : y + len(squares), x : x + squares.shape[1]] for y in range(3) for x in range(3)]
    is_spot = (squares > contrast * np.median(squares)) & (squares == np.max(beside, axis=0))
    return [((column + 0.5) * BLOCK, (row + 0.5) * BLOCK) for row, column in np.argwhere(is_spot)]
