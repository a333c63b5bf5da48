"""Individuals of which the same is said are reasoned about once."""

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.triples import parse_ntriples
from mros1_reasoner.pellet.equivalence import EquivalentIndividuals
from mros1_reasoner.pellet.owlready import OwlreadyReasoner
from reasoner_helpers import DESIGNS, OBJECTIVE, application

APP = "http://example.org/app#"
TYPE, LABEL = f"<{v.RDF_TYPE}>", f"<{v.RDFS_LABEL}>"


def names(triples):
    return {s.removeprefix(f"<{APP}").rstrip(">") for s, _, _ in triples if s.startswith(f"<{APP}")}


def test_designs_with_the_same_components_are_one(knowledge_base):
    reduced = EquivalentIndividuals(list(parse_ntriples(knowledge_base.ontology))).reduced
    assert names(reduced) & set(DESIGNS) == {"scan_fast", "camera_fast"}


def test_labels_make_no_difference_but_other_statements_do():
    triples = [("<a>", TYPE, "<C>"), ("<b>", TYPE, "<C>"), ("<c>", TYPE, "<C>"), ("<b>", LABEL, '"b"')]
    assert {s for s, _, _ in EquivalentIndividuals(triples).reduced} == {"<a>"}
    triples += [("<x>", "<p>", "<c>"), ("<p>", TYPE, "<http://www.w3.org/2002/07/owl#ObjectProperty>")]
    assert {s for s, _, _ in EquivalentIndividuals(triples).reduced} == {"<a>", "<c>", "<x>", "<p>"}


def test_who_has_a_property_that_a_fact_cannot_have_is_left_as_it_is():
    triples = [(f"<{name}>", TYPE, "<C>") for name in "ab"] + [(f"<{name}>", "<note>", '"x"') for name in "ab"]
    assert EquivalentIndividuals(triples).reduced == triples


def test_classes_and_rules_are_no_twins():
    owl = "http://www.w3.org/2002/07/owl#"
    triples = [("<A>", TYPE, f"<{owl}Class>"), ("<B>", TYPE, f"<{owl}Class>")]
    triples += [("_:1", TYPE, f"<{v.SWRL}Imp>"), ("_:2", TYPE, f"<{v.SWRL}Imp>")]
    assert EquivalentIndividuals(triples).reduced == triples


def test_what_a_fact_mentions_stands_for_itself():
    triples = [(f"<{name}>", TYPE, "<C>") for name in "abcd"]
    facts, expand = EquivalentIndividuals(triples).split([Assertion("x", "p", "a"), Assertion("c", "p", "1", "t")])
    assert {fact.subject for fact in facts if fact.property == v.RDF_TYPE} == {"b", "c"}
    found = expand([Assertion("a", "q", "y"), Assertion("b", "q", "y"), Assertion("z", "q", "b")])
    assert found == {
        Assertion("a", "q", "y"),
        Assertion("b", "q", "y"),
        Assertion("d", "q", "y"),
        Assertion("z", "q", "b"),
        Assertion("z", "q", "d"),
    }


def test_everybody_mentioned_needs_no_deputy():
    triples = [(f"<{name}>", TYPE, "<C>") for name in "ab"]
    facts, expand = EquivalentIndividuals(triples).split([Assertion("a", "p", "b")])
    assert facts[1:] == [Assertion("b", v.RDF_TYPE, "C")]
    assert expand.groups == ()


def test_named_individuals_that_facts_mention_are_told_to_pellet(load, pellet):
    text = application().replace("</rdf:RDF>", "")
    for name in DESIGNS:
        text += f'<owl:NamedIndividual rdf:about="#{name}"/>'
    knowledge_base = load(text + "</rdf:RDF>")
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slower"}, components={"laser": "FALSE"})
    assert knowledge_base.analyse(facts, pellet).objectives["o_move"].status == v.IN_ERROR_COMPONENT


def test_inferences_are_those_of_the_whole_ontology_whichever_design_runs(load, pellet):
    designs = {f"d{i}": ({}, [["laser"], ["camera"], ["laser", "base"]][i % 3]) for i in range(12)}
    knowledge_base = load(application(designs))
    pellet.load(knowledge_base.ontology)
    reference = OwlreadyReasoner()
    reference.load(knowledge_base.ontology)
    for design in ("d0", "d11"):
        facts = Facts(
            (OBJECTIVE,), {"o_move": design}, {("o_move", "safety"): 0.9}, {"laser": "FALSE", "camera": "RECOVERED"}
        )
        assertions = knowledge_base.assertions(facts)
        inferred = pellet.infer(assertions, v.CONCLUSIONS)
        assert inferred == reference.infer(assertions, v.CONCLUSIONS)
        assert len([a for a in inferred if a.property == v.FD_UNREALISABLE_BY]) == 8
