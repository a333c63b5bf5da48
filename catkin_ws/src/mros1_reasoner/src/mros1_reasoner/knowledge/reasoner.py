"""The interface of a reasoner, so that another one can replace Pellet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class ReasonerError(Exception):
    """A reasoner can't do its work."""


class InconsistentError(ReasonerError):
    """The ontology contradicts itself; the message names the contradiction."""


class Assertion(NamedTuple):
    """A property value of an individual: IRIs, and for a literal the lexical form and the datatype's IRI."""

    subject: str
    property: str
    value: str
    datatype: str = ""  # empty: the value is an IRI


class Reasoner(Protocol):
    """Infers property values from an ontology that stays and facts that change."""

    def load(self, ontology: str) -> None:
        """Load the ontology, as N-Triples; it stays until the next load.

        Raises:
            ReasonerError: it can't be read; InconsistentError: it contradicts itself.
        """

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """Return every value, asserted or inferred, of the properties, with the facts added to the ontology.

        The facts hold for this call only.

        Raises:
            ReasonerError: the reasoner failed; InconsistentError: ontology and facts contradict each other.
        """

    def close(self) -> None:
        """Release processes and files."""
