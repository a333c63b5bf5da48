"""Random errors of a robot's parts, each with a seeded generator of its own, so that one does not disturb another."""

from __future__ import annotations

import math

import numpy as np

_BLOCK = 1000


class Normals:
    """Standard normal random numbers, drawn in blocks for speed."""

    def __init__(self, seed: int, stream: int) -> None:
        """Start the stream of numbers that belongs to a seed."""
        self._generator = np.random.default_rng([seed, stream])
        self._numbers: list[float] = []

    def next(self) -> float:
        """Return the next number."""
        if not self._numbers:
            self._numbers = self._generator.standard_normal(_BLOCK).tolist()
        return self._numbers.pop()


class Wander:
    """An error that wanders about zero (first-order Gauss-Markov process), as slip and localisation errors do."""

    def __init__(self, deviation: float, correlation: float, normals: Normals) -> None:
        """Start at a random error.

        Args:
            deviation: standard deviation, in the unit of the error.
            correlation: s after which 1/e of an error is left.
            normals: source of chance.
        """
        self._deviation = deviation
        self._correlation = correlation
        self._normals = normals
        self.error = deviation * normals.next()

    def advance(self, duration: float) -> float:
        """Return the error after a further time in s."""
        kept = math.exp(-duration / self._correlation)
        self.error = kept * self.error + math.sqrt(1.0 - kept * kept) * self._deviation * self._normals.next()
        return self.error
