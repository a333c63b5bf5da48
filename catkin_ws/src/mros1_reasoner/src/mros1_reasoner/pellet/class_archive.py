"""Makes an archive of the classes that Pellet loads: the JVM then takes them ready for use, which saves 0.1 s a start.

`./mros setup` runs this once. Without the archive all goes as with it, a bit slower.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from mros1_reasoner.io.ontology_files import own_ontologies, read_triples
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBaseError
from mros1_reasoner.knowledge.loading import renamed
from mros1_reasoner.knowledge.reasoner import Assertion, ReasonerError
from mros1_reasoner.knowledge.triples import write_ntriples
from mros1_reasoner.pellet.child import RECORDING
from mros1_reasoner.pellet.process import PelletReasoner
from mros1_reasoner.pellet.spawning import ARCHIVE

DEADLINE = 60.0  # s, wall, for the JVM to write the archive

_COMPONENT, _DESIGN = v.RUNTIME + "component", v.RUNTIME + "design"
_FACTS = (
    Assertion(_COMPONENT, v.RDF_TYPE, v.COMPONENT),
    Assertion(_DESIGN, v.RDF_TYPE, v.FUNCTION_DESIGN),
    Assertion(_COMPONENT, v.REQUIRED_BY, _DESIGN),
    Assertion(_COMPONENT, v.C_STATUS, v.FAILED, v.XSD + "string"),
)


class _Recorded(PelletReasoner):
    """Pellet in a JVM that records which classes it loads."""

    def _jvm_options(self) -> list[str]:
        return [f"{RECORDING}{self.temporary}"]

    @property
    def temporary(self) -> Path:
        """Where the JVM writes."""
        return self._jars / f"{ARCHIVE}.{os.getpid()}"

    def make(self) -> Path:
        """Make the archive by an analysis, and return its path."""
        triples = [triple for i, path in enumerate(own_ontologies()) for triple in renamed(read_triples(path), i)]
        self.load(write_ntriples(triples))
        self.infer(_FACTS, v.CONCLUSIONS)
        process = self._process
        if process is not None and process.stdin is not None:
            process.stdin.close()
            process.wait(DEADLINE)
        archive = self._jars / ARCHIVE
        self.temporary.replace(archive)
        return archive


def main() -> None:
    """Make the archive; exit status 1 if that is not possible."""
    try:
        recorded = _Recorded()
        try:
            sys.stdout.write(f"{recorded.make()}\n")
        finally:
            recorded.close()
            recorded.temporary.unlink(missing_ok=True)
    except (KnowledgeBaseError, ReasonerError, OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"no archive of Pellet's classes: {error}")


if __name__ == "__main__":
    main()
