"""Individuals of which the same is said are reasoned about once."""

import pytest
from generated_ontologies import ABOUT_INDIVIDUALS, INDIVIDUALS, PEER, WEIGHT, facts, ontologies
from hypothesis import given, settings
from hypothesis import strategies as st
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.triples import assertion_triple, parse_ntriples
from mros1_reasoner.pellet.equivalence import EquivalentIndividuals
from ontology_text import APP, OWL, assertion, typed
from reasoner_helpers import DESIGNS, OBJECTIVE, application

OBJECT_PROPERTY, DATATYPE_PROPERTY = f"{OWL}ObjectProperty", f"{OWL}DatatypeProperty"
TYPE, LABEL = f"<{v.RDF_TYPE}>", f"<{v.RDFS_LABEL}>"


def names(triples):
    return {s.removeprefix(f"<{APP}").rstrip(">") for s, _, _ in triples if s.startswith(f"<{APP}")}


def expansion(text):
    return EquivalentIndividuals(list(parse_ntriples(text))).split([])[1]


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
    triples = [("<A>", TYPE, f"<{OWL}Class>"), ("<B>", TYPE, f"<{OWL}Class>")]
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
    assert expand.members == {}


def test_named_individuals_that_facts_mention_are_told_to_pellet(load, pellet):
    text = application().replace("</rdf:RDF>", "")
    for name in DESIGNS:
        text += f'<owl:NamedIndividual rdf:about="#{name}"/>'
    knowledge_base = load(text + "</rdf:RDF>")
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slower"}, components={"laser": "FALSE"})
    assert knowledge_base.analyse(facts, pellet).objectives["o_move"].status == v.IN_ERROR_COMPONENT


@pytest.mark.parametrize("name", sorted(ABOUT_INDIVIDUALS))
def test_who_is_named_by_more_than_plain_statements_is_in_no_group(name):
    individuals = INDIVIDUALS["X"]
    text = "".join(typed(individual, f"{APP}Part") for individual in individuals)
    text += typed(PEER, OBJECT_PROPERTY) + typed(WEIGHT, DATATYPE_PROPERTY)
    groups = {frozenset(members) for members in expansion(text).members.values()}
    assert groups == {frozenset(individuals)}
    more = "".join(ABOUT_INDIVIDUALS[name](*individuals[:2]))
    groups = {frozenset(members) for members in expansion(text + more).members.values()}
    named = {individual for individual in individuals if f"<{individual}>" in more}
    assert named
    assert groups == {frozenset(individuals) - named}


@pytest.mark.parametrize("predicate", [v.RDFS_LABEL, v.SWRL + "argument1"])
def test_property_of_the_language_makes_no_plain_statement_though_it_is_declared(predicate):
    kind = DATATYPE_PROPERTY if predicate == v.RDFS_LABEL else OBJECT_PROPERTY
    text = "".join(typed(APP + name, f"{APP}Part") for name in "abcd") + typed(predicate, kind)
    value = ("a", v.XSD + "string") if predicate == v.RDFS_LABEL else (APP + "d",)
    text += assertion(APP + "a", predicate, *value) + assertion(APP + "b", predicate, *value)
    members = {member for group in expansion(text).members.values() for member in group}
    assert not members & {APP + "a", APP + "b"}


def test_what_is_typed_as_a_class_or_used_as_a_property_is_no_individual():
    text = "".join(typed(APP + name, f"{APP}Part") for name in "abcde")
    text += typed(APP + "a", f"{OWL}Class") + typed(f"{APP}x", APP + "b")
    text += assertion(f"{APP}x", APP + "c", f"{APP}y")
    assert expansion(text).members == {APP + "d": (APP + "d", APP + "e")}


@settings(max_examples=150, deadline=None, derandomize=True)
@given(text=ontologies(), known=facts(), deputies=st.sampled_from([1, 2]))
def test_pellet_gets_every_statement_but_those_that_name_somebody_left_out(text, known, deputies):
    triples = list(parse_ntriples(text))
    equivalent = EquivalentIndividuals(triples)
    added, expand = equivalent.split(known, deputies)
    mentioned = {name for fact in known for name in (fact.subject, fact.value)}
    left_out = {f"<{m}>" for members in expand.members.values() for m in members if m not in expand.members}
    assert not left_out & {f"<{name}>" for name in mentioned}
    handed_over = {*equivalent.reduced, *map(assertion_triple, added[len(known) :])}
    notes = {triple for triple in triples if triple[1] == LABEL or triple[2] == f"<{v.OWL_NAMED_INDIVIDUAL}>"}
    assert handed_over - notes == {triple for triple in triples if left_out.isdisjoint(triple)} - notes


def test_inferences_are_those_of_the_whole_ontology_whichever_design_runs(load, pellet, reference):
    designs = {f"d{i}": ({}, [["laser"], ["camera"], ["laser", "base"]][i % 3]) for i in range(12)}
    knowledge_base = load(application(designs))
    pellet.load(knowledge_base.ontology)
    reference.load(knowledge_base.ontology)
    for design in ("d0", "d11"):
        facts = Facts(
            (OBJECTIVE,), {"o_move": design}, {("o_move", "safety"): 0.9}, {"laser": "FALSE", "camera": "RECOVERED"}
        )
        assertions = knowledge_base.assertions(facts)
        inferred = pellet.infer(assertions, v.CONCLUSIONS)
        assert inferred == reference.infer(assertions, v.CONCLUSIONS)
        assert len([a for a in inferred if a.property == v.FD_UNREALISABLE_BY]) == 8
