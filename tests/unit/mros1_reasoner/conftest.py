"""Fixtures of the reasoner's tests: one warm Pellet for all of them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from helpers.rosmodel_command import run  # noqa: F401
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge.model import Direction
from mros1_reasoner.pellet.owlready import OwlreadyReasoner
from mros1_reasoner.pellet.process import PelletReasoner
from reasoner_helpers import application

DIRECTIONS = {"performance": Direction.HIGHER_IS_BETTER}


@pytest.fixture(scope="session")
def pellet():
    reasoner = PelletReasoner()
    yield reasoner
    reasoner.close()


class PlainPellet(PelletReasoner):
    """Pellet with the ontology as it is, and with all individuals."""

    def load(self, ontology):
        self._load("whole", ontology)

    def infer(self, facts, properties):
        return sorted(self._ask_child("whole", facts, properties))


@pytest.fixture(scope="session")
def plain():
    reasoner = PlainPellet()
    yield reasoner
    reasoner.close()


@pytest.fixture
def reference(monkeypatch):
    """Return the reasoner that starts a JVM for each analysis, which ends before a second stage of compilation pays."""
    monkeypatch.setenv("JDK_JAVA_OPTIONS", "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC")
    return OwlreadyReasoner()


@pytest.fixture
def load(tmp_path):
    """Return a function that makes a knowledge base of the text of a model."""

    def make(text=None, vocabularies=(), *, spares=True, **files):
        path = tmp_path / "app.owl"
        path.write_text(text if text is not None else application())
        for name, content in files.items():
            (tmp_path / f"{name}.owl").write_text(content)
        return read_knowledge_base([path], vocabularies, DIRECTIONS, spares=spares)

    return make


@pytest.fixture
def knowledge_base(load):
    return load()


@pytest.fixture
def reasoner(pellet, knowledge_base):
    pellet.load(knowledge_base.ontology)
    return pellet
