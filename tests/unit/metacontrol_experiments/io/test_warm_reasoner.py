"""Reasoners that are kept for the next mission."""

import os

import pytest
from metacontrol_experiments.io import warm_reasoner
from metacontrol_experiments.io.warm_reasoner import WarmReasoner, close_idle
from mros1_reasoner.knowledge.reasoner import Assertion, ReasonerError
from mros1_reasoner.pellet.process import PelletReasoner, PelletWithFallback

CELL, TYPE, OWL = (
    "http://cell.org/",
    "http://www.w3.org/1999/02/22-rdf-syntax-ns#type",
    "http://www.w3.org/2002/07/owl#",
)
KINDS = {"before": ("ObjectProperty", "TransitiveProperty"), **dict.fromkeys("pqr", ("NamedIndividual", "Thing"))}
ONTOLOGY = "\n".join(f"<{CELL}{name}> <{TYPE}> <{OWL}{kind}> ." for name, kinds in KINDS.items() for kind in kinds)
BEFORE = f"{CELL}before"
FACTS = [Assertion(f"{CELL}{one}", BEFORE, f"{CELL}{other}") for one, other in ("pq", "qr")]


class Fake(PelletWithFallback):
    """Says what it was asked to do."""

    def __init__(self):
        self.done, self.broken = [], False

    @property
    def fallen_back(self):
        return self.broken

    def load(self, ontology):
        self.done.append(f"load {ontology}")
        if ontology == "bad":
            raise ReasonerError("bad")

    def infer(self, facts, properties):
        self.done.append("infer")
        return []

    def close(self):
        self.done.append("close")


@pytest.fixture
def made(monkeypatch):
    """The reasoners that were made, fakes; none is kept from before."""
    found = []
    monkeypatch.setattr(warm_reasoner, "_idle", [])
    monkeypatch.setattr(warm_reasoner, "make_reasoner", lambda: found.append(Fake()) or found[-1])
    return found


def mission(ontology="a"):
    reasoner = WarmReasoner()
    try:
        reasoner.load(ontology)
        reasoner.infer([], [])
    finally:
        reasoner.close()
    return reasoner


def test_next_mission_takes_the_reasoner_over(made):
    for ontology in ("a", "a", "b"):
        mission(ontology)
    assert [one.done for one in made] == [["load a", "infer", "infer", "load b", "infer"]]


def test_missions_at_once_have_one_each(made):
    first, second = WarmReasoner(), WarmReasoner()
    first.close()
    second.close()
    first.close()
    third, fourth = WarmReasoner(), WarmReasoner()
    assert len(made) == 2 and third._reasoner is not fourth._reasoner


def test_reasoner_that_failed_is_not_kept(made):
    mission()
    with pytest.raises(ReasonerError):
        mission("bad")
    assert made[0].done[-1] == "close"
    mission().infer([], [])
    assert len(made) == 2


def test_slower_reasoner_is_not_kept(made):
    reasoner = WarmReasoner()
    made[0].broken = True
    reasoner.close()
    assert made[0].done == ["close"]


def test_kept_reasoners_end_with_the_process(made):
    mission()
    close_idle()
    assert made[0].done[-1] == "close"
    mission()
    assert len(made) == 2


def test_pellet_stays_and_answers_alike(monkeypatch):
    monkeypatch.setattr(warm_reasoner, "_idle", [])
    answers, processes = [], []
    for _ in range(3):
        reasoner = WarmReasoner()
        reasoner.load(ONTOLOGY)
        answers.append(reasoner.infer(FACTS, [BEFORE]))
        child = reasoner._reasoner._child
        assert isinstance(child, PelletReasoner)
        processes.append(child.pid)
        reasoner.close()
    assert Assertion(f"{CELL}p", BEFORE, f"{CELL}r") in answers[0]
    assert answers[0] == answers[1] == answers[2] and len(set(processes)) == 1
    close_idle()
    with pytest.raises(ProcessLookupError):
        os.kill(processes[0], 0)
