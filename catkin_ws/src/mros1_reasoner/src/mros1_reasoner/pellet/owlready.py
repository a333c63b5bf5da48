"""Calls Pellet through owlready2. This is slow: every analysis starts a new JVM (1.1 to 3 s)."""

from __future__ import annotations

import io
import logging
import os
import sqlite3
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import owlready2

from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, ReasonerError
from mros1_reasoner.knowledge.triples import assertion_triple, iri_of, literal_of, parse_ntriples
from mros1_reasoner.knowledge.vocabulary import XSD

_log = logging.getLogger(__name__)

DEADLINE = 60.0  # s, wall, for Pellet in a new JVM, which takes 1.1 to 3 s on a machine that has nothing else to do
owlready2.reasoning._subprocess_kargs["timeout"] = DEADLINE  # of its subprocess.run; it has no public option for that


class OwlreadyReasoner:
    """A Reasoner by `owlready2.sync_reasoner_pellet`: the fallback, and the reference in tests and benchmarks."""

    def __init__(self) -> None:
        self._ontology = ""

    def load(self, ontology: str) -> None:
        """See Reasoner.load."""
        self._ontology = ontology

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """See Reasoner.infer."""
        with _failing_as_reasoner():
            world = owlready2.World()
            try:
                return self._infer(world, facts, properties)
            finally:
                world.close()

    def close(self) -> None:
        """See Reasoner.close."""

    def _infer(self, world: owlready2.World, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        text = self._ontology + "".join(f"{' '.join(assertion_triple(fact))} .\n" for fact in facts)
        ontology = world.get_ontology("http://metacontrol.org/analysis#")
        ontology.load(fileobj=io.BytesIO(text.encode()), format="ntriples")
        run_pellet(world)
        saved = io.BytesIO()
        world.save(saved, format="ntriples")
        wanted = set(properties)
        found: set[Assertion] = set()
        for subject, predicate, value in parse_ntriples(saved.getvalue().decode()):
            name = iri_of(predicate)
            if name in wanted:
                literal = literal_of(value)
                if literal is None:
                    found.add(Assertion(iri_of(subject), name, iri_of(value)))
                else:
                    found.add(Assertion(iri_of(subject), name, literal[0], _datatype(literal[1])))
        return sorted(found)


def _datatype(iri: str) -> str:
    """Return the datatype's IRI; plain text has that of xsd:string."""
    return XSD + "string" if not iri or iri.endswith("#PlainLiteral") else iri


def run_pellet(world: owlready2.World) -> None:
    """Run owlready2's call of Pellet over a world; the conclusions are added to it.

    Raises:
        InconsistentError: the ontology contradicts itself.
        ReasonerError: Java or Pellet failed, or took too long.
    """
    with _failing_as_reasoner(), _Temporary.taking_away():
        owlready2.sync_reasoner_pellet(world, infer_property_values=True, infer_data_property_values=True, debug=0)


@contextmanager
def _failing_as_reasoner() -> Iterator[None]:
    """Raise errors of owlready2, also for want of descriptors or memory, as those of a reasoner."""
    try:
        yield
    except owlready2.OwlReadyInconsistentOntologyError as error:
        raise InconsistentError(" ".join(str(error).split())) from error
    except subprocess.TimeoutExpired as error:
        raise ReasonerError(f"Pellet in a JVM of its own does not answer within {error.timeout:g} s") from error
    except (owlready2.base.OwlReadyError, OSError, MemoryError, sqlite3.Error) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise ReasonerError(f"owlready2 could not run Pellet: {said}") from error


class _Temporary:
    """Stands for the module `tempfile` in owlready2, which leaves its file where Pellet fails."""

    _made = threading.local()

    @classmethod
    def NamedTemporaryFile(cls, *arguments: Any, **options: Any) -> Any:  # noqa: N802, as in that module
        """Make a file, and note it."""
        file = tempfile.NamedTemporaryFile(*arguments, **options)  # noqa: SIM115
        cls._made.path = file.name
        return file

    @classmethod
    @contextmanager
    def taking_away(cls) -> Iterator[None]:
        """Delete the file in the end, if it is still there."""
        cls._made.path = ""
        try:
            yield
        finally:
            with suppress(FileNotFoundError):
                os.unlink(cls._made.path)


owlready2.reasoning.tempfile = _Temporary
