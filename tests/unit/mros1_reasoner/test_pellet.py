import os
import signal
import subprocess
import sys
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mros1_reasoner import pellet as pellet_module
from mros1_reasoner import vocabulary as v
from mros1_reasoner.model import Facts, Objective
from mros1_reasoner.owlready_reasoner import OwlreadyReasoner
from mros1_reasoner.pellet import NoJavaError, PelletReasoner, make_reasoner
from mros1_reasoner.reasoner import Assertion, InconsistentError, ReasonerError
from reasoner_helpers import DESIGNS, OBJECTIVE, application

LEVELS = st.sampled_from([0.1, 0.6, 0.61, 0.9])
STATUSES = st.sampled_from(["TRUE", "FALSE", "RECOVERED"])
DEADLINE_S = 20.0


def wait_for(condition):
    until = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True)
@given(
    designs=st.dictionaries(
        st.sampled_from("abcdefgh"),
        st.tuples(st.just({}), st.lists(st.sampled_from(["laser", "camera", "base"]), unique=True, max_size=3)),
        min_size=1,
    ),
    levels=st.dictionaries(st.tuples(st.just("o_move"), st.sampled_from(["safety", "energy"])), LEVELS),
    statuses=st.dictionaries(st.sampled_from(["laser", "camera", "base"]), STATUSES, min_size=1),
    broken=st.booleans(),
)
def test_child_infers_what_owlready2_infers(load, pellet, **drawn):
    designs, levels, statuses = drawn["designs"], drawn["levels"], drawn["statuses"]
    extra = "".join(f'<t:Component rdf:about="#{name}"/>' for name in ("laser", "camera", "base"))
    knowledge_base = load(application(designs, extra))
    facts = Facts(
        (OBJECTIVE,), {"o_move": min(designs)}, levels, statuses, frozenset({"o_move"} if drawn["broken"] else ())
    )
    pellet.load(knowledge_base.ontology)
    reference = OwlreadyReasoner()
    reference.load(knowledge_base.ontology)
    assertions = knowledge_base.assertions(facts)
    assert pellet.infer(assertions, v.CONCLUSIONS) == reference.infer(assertions, v.CONCLUSIONS)


def test_facts_of_one_analysis_do_not_stay_for_the_next(knowledge_base, reasoner):
    wrong = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, {("o_move", "safety"): 0.9}, {"laser": "FALSE"})
    fine = Facts((OBJECTIVE,), {"o_move": "camera_slow"})
    first = knowledge_base.analyse(wrong, reasoner)
    assert not knowledge_base.analyse(fine, reasoner).unrealisable
    assert knowledge_base.analyse(wrong, reasoner) == first


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
    reasoner = PelletReasoner(deadline=2.0)
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
        "import os, sys; from mros1_reasoner.pellet import PelletReasoner; r = PelletReasoner(); "
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

    wait_for(is_gone)


def test_no_java_is_told_with_the_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("JAVA_HOME", raising=False)
    with pytest.raises(NoJavaError, match="no Java runtime found: install openjdk-17-jre-headless"):
        make_reasoner()


def test_child_that_can_not_run_gives_way_to_owlready2_with_a_warning(monkeypatch, caplog):
    monkeypatch.setattr(pellet_module.importlib.util, "find_spec", lambda name: None)
    assert isinstance(make_reasoner(), OwlreadyReasoner)
    assert "JPype1 is missing" in caplog.text


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
