import errno
import importlib.util
import os
import signal
import sqlite3
import subprocess
import sys
from itertools import pairwise

import pytest
from helpers.waiting import wait_for
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, ReasonerError
from mros1_reasoner.pellet import owlready
from mros1_reasoner.pellet import process as pellet_module
from mros1_reasoner.pellet.owlready import OwlreadyReasoner
from mros1_reasoner.pellet.process import (
    FIRST_RETRY,
    LONGEST_RETRY,
    ChildLostError,
    PelletReasoner,
    PelletWithFallback,
    make_reasoner,
)
from mros1_reasoner.pellet.spawning import NoJavaError
from ontology_text import APP, OWL, typed
from reasoner_helpers import DESIGNS, OBJECTIVE, application


def test_facts_of_one_analysis_do_not_stay_for_the_next(knowledge_base, reasoner):
    wrong = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, {("o_move", "safety"): 0.9}, {"laser": "FALSE"})
    fine = Facts((OBJECTIVE,), {"o_move": "camera_slow"})
    first = knowledge_base.analyse(wrong, reasoner)
    assert not knowledge_base.analyse(fine, reasoner).unrealisable
    assert knowledge_base.analyse(wrong, reasoner) == first


@pytest.mark.parametrize(
    ("written", "text"),
    [
        ('"\u00e9"', "é"),
        (r'"\u00e9\t\n\"\\"', 'é\t\n"\\'),
        (r'"\U0001F600"', "\U0001f600"),
        ('"\U0001f600"', "\U0001f600"),
        (r'"\\U0001F600"', r"\U0001F600"),
        ('"a . b"@en-GB', "a . b"),
    ],
)
def test_text_comes_back_however_it_is_written(pellet, written, text):
    says = typed(f"{APP}says", f"{OWL}DatatypeProperty") + typed(f"{APP}Part", f"{OWL}Class")
    pellet.load(f"{says}{typed(f'{APP}ï', f'{APP}Part')}<{APP}ï> <{APP}says> {written} .\n")
    assert [(a.subject, a.value) for a in pellet.infer([], [f"{APP}says"])] == [(f"{APP}ï", text)]


def test_killed_child_is_replaced_and_the_analysis_repeated(knowledge_base):
    reasoner = PelletReasoner()
    try:
        reasoner.load(knowledge_base.ontology)
        first = reasoner.pid
        os.kill(first, signal.SIGKILL)
        result = knowledge_base.analyse(Facts((OBJECTIVE,), components={"laser": "FALSE"}), reasoner)
        assert set(result.unrealisable) == {name for name in DESIGNS if name.startswith("scan")}
        assert reasoner.pid != first
    finally:
        reasoner.close()


def test_hanging_child_is_replaced_after_the_deadline(knowledge_base):
    reasoner = PelletReasoner(deadline=6.0)
    try:
        reasoner.load(knowledge_base.ontology)
        first = reasoner.pid
        os.kill(first, signal.SIGSTOP)
        knowledge_base.analyse(Facts((OBJECTIVE,)), reasoner)
        assert reasoner.pid != first
        assert not os.path.exists(f"/proc/{first}")
    finally:
        reasoner.close()


def test_child_dies_with_its_parent():
    code = (
        "import os, sys; from mros1_reasoner.pellet.process import PelletReasoner; r = PelletReasoner(); "
        "print(r.pid, flush=True); sys.stdin.read()"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    assert os.path.exists(f"/proc/{child}")
    parent.kill()
    parent.communicate()

    def is_gone():
        try:
            with open(f"/proc/{child}/stat") as file:
                return file.read().rsplit(")", 1)[1].split()[0] == "Z"
        except (FileNotFoundError, ProcessLookupError):
            return True

    wait_for(is_gone, "the child has ended")


def test_no_java_is_told_with_the_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("JAVA_HOME", raising=False)
    with pytest.raises(NoJavaError, match="no Java runtime found: install openjdk-17-jre-headless"):
        make_reasoner()


def test_child_that_can_not_run_gives_way_to_owlready2_with_a_warning(monkeypatch, caplog):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert isinstance(make_reasoner(), OwlreadyReasoner)
    assert "JPype1 is missing" in caplog.text


class Broken:
    """A child that can't be kept running."""

    def __init__(self):
        self.calls = 0

    def load(self, ontology):
        self.infer(ontology, ())

    def infer(self, facts, properties):
        self.calls += 1
        raise ChildLostError("Pellet's process has died, twice in a row")


def test_child_that_is_lost_gives_way_to_owlready2_and_is_tried_again_later(knowledge_base, caplog):
    now = [0.0]
    child = Broken()
    steady = PelletWithFallback(child, clock=lambda: now[0])
    steady.load(knowledge_base.ontology)
    assert caplog.text.count("going on with a new JVM for every analysis") == 1
    facts = Facts((OBJECTIVE,), components={"laser": "FALSE"})
    result = knowledge_base.analyse(facts, steady)
    assert set(result.unrealisable) == {name for name in DESIGNS if name.startswith("scan")}
    assert child.calls == 1
    now[0] = FIRST_RETRY
    knowledge_base.analyse(facts, steady)
    assert child.calls == 2


def test_lost_child_that_works_again_gets_its_ontology_back(knowledge_base, pellet):
    now = [0.0]
    child = Broken()
    steady = PelletWithFallback(child, clock=lambda: now[0])
    steady.load(knowledge_base.ontology)
    pellet.load("")
    steady._child, now[0] = pellet, FIRST_RETRY
    result = knowledge_base.analyse(Facts((OBJECTIVE,), components={"laser": "FALSE"}), steady)
    assert len(result.unrealisable) == 3


class Flaky:
    """A reasoner that is lost as long as the test says; each of its tries takes some time."""

    def __init__(self):
        self.now, self.tries, self.is_lost, self.lasts = 0.0, [], True, 0.0

    def load(self, _):
        self.tries.append(self.now)
        self.now += self.lasts
        if self.is_lost:
            raise ChildLostError("Pellet's process has died, twice in a row")

    def infer(self, _facts, _properties):
        self.load("")
        return []


class Slow:
    """A reasoner that always works."""

    def load(self, _):
        pass

    def infer(self, _facts, _properties):
        return []


def waits(child, steady, until):
    """Have an analysis each second; return the s between the tries of the child."""
    child.tries.clear()
    until += child.now
    while child.now < until:
        steady.infer((), ())
        child.now += 1.0
    return [round(later - earlier) for earlier, later in pairwise(child.tries)]


def test_lost_child_is_tried_again_soon_and_ever_more_rarely():
    child = Flaky()
    steady = PelletWithFallback(child, Slow, lambda: child.now)
    assert waits(child, steady, 1200.0) == [2, 4, 8, 16, 32, 64, 128, 256, LONGEST_RETRY, LONGEST_RETRY]
    child.is_lost = False
    child.now += LONGEST_RETRY
    steady.infer((), ())
    assert not steady.fallen_back
    child.is_lost = True
    assert waits(child, steady, 20.0) == [2, 4, 8], "the waits begin anew after a success"


def test_child_that_hangs_takes_half_of_the_time_at_most():
    child = Flaky()
    child.lasts = 80.0
    steady = PelletWithFallback(child, Slow, lambda: child.now)
    assert waits(child, steady, 500.0) == [160, 240]


def test_jvm_of_the_fallback_that_hangs_is_ended_after_its_deadline(knowledge_base, monkeypatch, tmp_path):
    java = tmp_path / "java"
    java.write_text("#!/bin/sh\nexec sleep 600\n")
    java.chmod(0o755)
    monkeypatch.setattr(owlready.owlready2, "JAVA_EXE", str(java))
    assert owlready.owlready2.reasoning._subprocess_kargs["timeout"] == owlready.DEADLINE
    monkeypatch.setitem(owlready.owlready2.reasoning._subprocess_kargs, "timeout", 0.2)
    reasoner = OwlreadyReasoner()
    reasoner.load(knowledge_base.ontology)
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(owlready.tempfile, "tempdir", str(folder))
    with pytest.raises(ReasonerError, match=r"does not answer within 0\.2 s"):
        reasoner.infer([], v.CONCLUSIONS)
    assert os.listdir(folder) == [], "owlready2 has left its file"


@pytest.mark.parametrize(
    "error",
    [
        owlready.owlready2.OwlReadyOntologyParsingError("Cannot parse"),
        OSError(24, "Too many open files"),
        MemoryError(),
        sqlite3.OperationalError("unable to open database file"),
    ],
)
def test_fallback_that_lacks_descriptors_or_memory_fails_as_a_reasoner(knowledge_base, failing, error):
    failing(owlready.owlready2.Ontology, "load", error, times=1)
    reasoner = OwlreadyReasoner()
    reasoner.load(knowledge_base.ontology)
    with pytest.raises(ReasonerError, match=r"owlready2 could not run Pellet: .*[a-z]"):
        reasoner.infer([], v.CONCLUSIONS)


def test_child_that_runs_out_of_memory_is_replaced_and_then_given_up(load, caplog):
    designs = {f"d{i}": ({}, ["laser", f"sensor{i}"]) for i in range(3000)}  # no two alike
    knowledge_base = load(application(designs))
    reasoner = PelletReasoner(deadline=120.0, heap_mb=16)  # it takes its time to run out on a loaded machine
    try:
        with pytest.raises(ChildLostError, match="has died, twice in a row"):
            reasoner.load(knowledge_base.ontology)
        assert "starting it again" in caplog.text
    finally:
        reasoner.close()


def test_jvm_that_cannot_be_started_again_counts_as_lost(knowledge_base, monkeypatch):
    def refused(*_words, **_options):
        raise OSError(errno.EMFILE, "Too many open files")

    reasoner = PelletReasoner()
    reasoner.close()
    monkeypatch.setattr(pellet_module, "spawn", refused)
    with pytest.raises(ChildLostError, match=r"can't be started again: .*Too many open files"):
        reasoner.load(knowledge_base.ontology)


def test_jvm_that_does_not_start_is_told(knowledge_base):
    reasoner = PelletReasoner(heap_mb=0)  # -Xmx0m is refused
    try:
        with pytest.raises(ChildLostError, match=r"Pellet's process (does not start|has died)"):
            reasoner.load(knowledge_base.ontology)
    finally:
        reasoner.close()


def test_contradiction_is_an_error_of_its_own_and_the_next_analysis_works(knowledge_base, reasoner):
    facts = knowledge_base.assertions(Facts((OBJECTIVE,), components={"laser": "FALSE"}))
    contradiction = facts[-1]._replace(value="TRUE")
    with pytest.raises(InconsistentError, match="contradicts itself"):
        reasoner.infer([*facts, contradiction], v.CONCLUSIONS)
    assert reasoner.infer(facts, v.CONCLUSIONS)


def test_unknown_property_is_refused(reasoner):
    with pytest.raises(ReasonerError, match="unknown"):
        reasoner.infer([Assertion("http://a#x", "http://a#p", "http://a#y")], v.CONCLUSIONS)


def test_ontology_that_is_no_ntriples_is_refused(pellet):
    with pytest.raises(ReasonerError):
        pellet.load("this is no triple")


def test_objectives_are_kept_apart(load, pellet):
    knowledge_base = load()
    pellet.load(knowledge_base.ontology)
    other = Objective("o_other", "f_move", {"safety": 0.9})
    levels = {("o_move", "safety"): 0.7, ("o_other", "safety"): 0.7}
    facts = Facts((OBJECTIVE, other), {"o_move": "scan_slow", "o_other": "camera_slow"}, levels)
    result = knowledge_base.analyse(facts, pellet)
    assert result.objectives["o_move"].violated == ("safety",)
    assert result.objectives["o_other"].violated == ()
