"""A reasoner whose process outlives its mission: the next mission in this process takes it over.

To start Pellet costs more than a second of a processor, a quarter of a mission in lockstep.
"""

from __future__ import annotations

import atexit
from contextlib import contextmanager
from typing import TYPE_CHECKING

from mros1_reasoner.pellet.process import PelletWithFallback, make_reasoner

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from mros1_reasoner.knowledge.reasoner import Assertion, Reasoner

_idle: list[tuple[Reasoner, str]] = []
"""Reasoners that no mission uses, each with the ontology that it holds."""


class WarmReasoner:
    """A Reasoner that is kept when it is closed, unless it has failed."""

    def __init__(self) -> None:
        """Take over one that is kept, else start one.

        Raises:
            NoJavaError: there is no Java runtime.
        """
        self._reasoner, self._ontology = _idle.pop() if _idle else (make_reasoner(), "")
        self._failed = self._closed = False

    def load(self, ontology: str) -> None:
        """See Reasoner.load. An ontology that it holds already need not be read and checked again."""
        if ontology == self._ontology:
            return
        self._ontology = ""
        with self._watched():
            self._reasoner.load(ontology)
        self._ontology = ontology

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """See Reasoner.infer."""
        with self._watched():
            return self._reasoner.infer(facts, properties)

    def close(self) -> None:
        """Leave it to the next mission; it ends with this process."""
        if self._closed:
            return
        self._closed = True
        if self._failed or not isinstance(self._reasoner, PelletWithFallback) or self._reasoner.fallen_back:
            self._reasoner.close()
        else:
            _idle.append((self._reasoner, self._ontology))

    @contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._failed = True
            raise


@atexit.register
def close_idle() -> None:
    """End the processes that no mission uses."""
    while _idle:
        _idle.pop()[0].close()
