"""Reasoning about one of equivalent individuals infers what the whole ontology does, over ontologies of every shape.

Pellet gets each generated ontology twice: once as `PelletReasoner` hands it over, once with all its individuals.
"""

from itertools import product

import pytest
from generated_ontologies import ASKED, BESIDE, INDIVIDUALS, PEER, RIVAL, facts, ontologies
from hypothesis import HealthCheck, given, reject, settings
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import InconsistentError, ReasonerError
from ontology_text import OWL, assertion, rule, typed


@pytest.fixture
def infer(load, pellet, plain):
    """Return a function: what follows from an application's ontology and facts, or that they contradict each other."""
    prefixes = 'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:t="http://metacontrol.org/tomasys#"'
    vocabulary = load(f'<rdf:RDF {prefixes}><t:Function rdf:about="http://example.org/app#f"/></rdf:RDF>').ontology

    def follows(application, known, *, whole=False):
        reasoner = plain if whole else pellet
        try:
            reasoner.load(vocabulary + application)
            return reasoner.infer(known, ASKED)
        except InconsistentError:
            return "contradiction"

    return follows


@settings(max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(application=ontologies(), known=facts())
def test_inferences_are_those_of_the_whole_ontology(infer, application, known):
    try:
        whole = infer(application, known, whole=True)
    except ReasonerError:
        reject()  # Pellet has defects of its own, e.g. "Could not remove fact" where a key makes individuals the same
    assert infer(application, known) == whole


def test_members_of_a_group_are_related_as_in_the_whole_ontology(infer):
    designs, component = INDIVIDUALS["D"], INDIVIDUALS["C"][0]
    lines = [typed(name, OWL + "ObjectProperty") for name in (BESIDE, PEER, RIVAL)]
    lines += [typed(component, v.COMPONENT), *(typed(design, v.FUNCTION_DESIGN) for design in designs)]
    lines += [assertion(component, v.REQUIRED_BY, design) for design in designs]
    lines += [assertion(design, BESIDE, design) for design in designs]
    lines.append(rule([(v.REQUIRED_BY, "?c", "?x"), (v.REQUIRED_BY, "?c", "?y")], [(PEER, "?x", "?y")]))
    lines.append(rule([(BESIDE, "?x", "?y")], [(RIVAL, "?y", "?x")]))
    found = infer("".join(lines), [])
    related = {name: {(a.subject, a.value) for a in found if a.property == name} for name in (PEER, RIVAL)}
    assert related == {PEER: set(product(designs, designs)), RIVAL: set(zip(designs, designs, strict=True))}
