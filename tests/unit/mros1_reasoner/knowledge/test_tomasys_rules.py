"""Every rule, and every pair of causes at once."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import pytest
from mros1_reasoner.io.ontology_files import own_ontologies, read_triples
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts
from mros1_reasoner.knowledge.reasoner import Assertion
from reasoner_helpers import DESIGNS, OBJECTIVE, application

FACTS = Facts(objectives=(OBJECTIVE,), groundings={"o_move": "scan_slow"})
APP = "http://example.org/app#"
# A design by roles: seen_role needs what spec_eye specifies, which is of class eyes; a binding fills it with eye.
ROLES = """
<t:ComponentClass rdf:about="#eyes"><t:cc_unique rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">true</t:cc_unique>
</t:ComponentClass>
<t:ComponentSpecification rdf:about="#spec_eye"><t:typeC rdf:resource="#eyes"/></t:ComponentSpecification>
<t:Role rdf:about="#seeing"><t:roleDef rdf:resource="#spec_eye"/></t:Role>
<rdf:Description rdf:about="#camera_slow"><t:roles rdf:resource="#seeing"/></rdf:Description>
<t:ComponentState rdf:about="#eye">{eye_class}</t:ComponentState>
<t:Binding rdf:about="#sees"><t:binding_role rdf:resource="#seeing"/>{bound}</t:Binding>
<t:Objective rdf:about="#o_move"><t:typeF rdf:resource="#f_move"/></t:Objective>
<t:FunctionGrounding rdf:about="#fg_camera"><t:solvesO rdf:resource="#o_move"/><t:typeFD rdf:resource="#camera_slow"/>
<t:hasBindings rdf:resource="#sees"/></t:FunctionGrounding>
"""
BOUND = '<t:binding_component rdf:resource="#eye"/>'
OF_CLASS = '<t:typeC rdf:resource="#eyes"/>'


def outcome(knowledge_base, reasoner, facts):
    return knowledge_base.analyse(facts, reasoner)


def test_published_labels_are_there():
    texts = " ".join(Path(path).read_text() for path in own_ontologies())
    labels = re.findall(r"<swrl:Imp>\s*<rdfs:label>(\w+)</rdfs:label>", texts)
    expected = [
        "QA",
        "QA_reached",
        "S9",
        "compError",
        "compErrFG",
        "compRecov",
        "S1a",
        "S1b",
        "S2",
        "S3",
        "S4",
        "S5",
        "S6a",
        "S6b",
        "S10",
        "S11",
        "E1",
        "E2",
        "E3",
        "B1",
        "B2",
        "B3",
        "B4",
        "B5",
        "B6",
        "F1",
        "F2",
        "F3",
        "F4",
        "realisable",
        "updatable",
        "updatable_too",
    ]
    assert sorted(labels) == sorted(expected)


def test_everything_that_is_declared_has_a_label_and_a_comment():
    owl, rdfs = "http://www.w3.org/2002/07/owl#", "http://www.w3.org/2000/01/rdf-schema#"
    triples = [triple for path in own_ontologies() for triple in read_triples(path)]
    kinds = {f"<{owl}{kind}>" for kind in ("Class", "ObjectProperty", "DatatypeProperty")}
    declared = {s for s, p, o in triples if p == f"<{v.RDF_TYPE}>" and o in kinds and s.startswith("<")}
    assert len(declared) > 40
    for predicate in ("label", "comment"):
        assert declared <= {s for s, p, _ in triples if p == f"<{rdfs}{predicate}>"}


def test_nothing_wrong_is_in_progress(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, FACTS)
    assert result.objectives["o_move"].status == v.IN_PROGRESS
    assert not result.unrealisable
    assert not result.tried


def test_no_grounding_is_ungrounded(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, Facts(objectives=(OBJECTIVE,)))
    assert result.objectives["o_move"].status == v.UNGROUNDED


@pytest.mark.parametrize("quality", ["safety", "energy"])
def test_qa_level_above_the_limit_is_an_nfr_error_and_s9_logs_the_design(knowledge_base, reasoner, quality):
    facts = replace(FACTS, levels={("o_move", quality): 0.63})
    result = outcome(knowledge_base, reasoner, facts)
    assert result.objectives["o_move"].status == v.IN_ERROR_NFR
    assert result.objectives["o_move"].violated == (quality,)
    assert result.tried == {("scan_slow", "o_move")}


def test_qa_level_at_the_limit_is_fine(knowledge_base, reasoner):
    facts = replace(FACTS, levels={("o_move", "safety"): 0.6})
    assert outcome(knowledge_base, reasoner, facts).objectives["o_move"].status == v.IN_PROGRESS


@pytest.mark.parametrize(("level", "status"), [(0.4, v.IN_ERROR_NFR), (0.6, v.IN_PROGRESS)])
def test_qa_where_higher_is_better_must_not_fall_below(knowledge_base, reasoner, level, status):
    objective = replace(OBJECTIVE, limits={"performance": 0.5})
    facts = Facts((objective,), {"o_move": "scan_slow"}, {("o_move", "performance"): level})
    assert outcome(knowledge_base, reasoner, facts).objectives["o_move"].status == status


@pytest.mark.parametrize(
    ("operator", "level", "status"),
    [
        (">", 0.6, v.IN_PROGRESS),
        (">=", 0.6, v.IN_ERROR_NFR),
        (">=", 0.59, v.IN_PROGRESS),
        ("<=", 0.6, v.IN_ERROR_NFR),
        ("<=", 0.61, v.IN_PROGRESS),
        ("<", 0.6, v.IN_PROGRESS),
        ("<", 0.59, v.IN_ERROR_NFR),
    ],
)
def test_qa_of_a_type_with_a_comparison_operator_compares_by_it(load, pellet, operator, level, status):
    text = f"<t:qa_comparison_operator>{operator.replace('<', '&lt;')}</t:qa_comparison_operator>"
    knowledge_base = load(application(extra=f'<rdf:Description rdf:about="#safety">{text}</rdf:Description>'))
    pellet.load(knowledge_base.ontology)
    assert knowledge_base.qualities["safety"].violates(level, 0.6) == (status == v.IN_ERROR_NFR)
    facts = replace(FACTS, levels={("o_move", "safety"): level})
    assert outcome(knowledge_base, pellet, facts).objectives["o_move"].status == status


def test_comp_error_makes_the_laser_designs_unrealisable(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, replace(FACTS, components={"laser": "FALSE"}))
    assert result.unrealisable == {name: ("laser",) for name in DESIGNS if name.startswith("scan")}


def test_comp_err_fg_and_s1a_put_grounding_and_objective_in_error(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, replace(FACTS, components={"laser": "FALSE"}))
    assert result.objectives["o_move"].grounding_status == v.IN_ERROR_COMPONENT
    assert result.objectives["o_move"].status == v.IN_ERROR_COMPONENT


def test_failure_of_a_component_that_the_grounding_does_not_require_is_no_error(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, replace(FACTS, components={"camera": "FALSE"}))
    assert result.objectives["o_move"].status == v.IN_PROGRESS


def test_comp_recov_makes_the_objective_updatable(knowledge_base, reasoner):
    result = outcome(knowledge_base, reasoner, replace(FACTS, components={"camera": "RECOVERED"}))
    assert result.objectives["o_move"].status == v.UPDATABLE


def test_s1b_takes_the_quality_error_of_the_grounding_over(load, pellet):
    knowledge_base = load(application())
    pellet.load(knowledge_base.ontology)
    grounding = next(a.subject for a in knowledge_base.assertions(FACTS) if a.property == v.SOLVES_O)
    facts = [*knowledge_base.assertions(FACTS)]
    facts.append(
        facts[0]._replace(subject=grounding, property=v.FG_CAUSE, value=v.IN_ERROR_NFR, datatype=v.XSD + "string")
    )
    assert v.IN_ERROR_NFR in {a.value for a in pellet.infer(facts, [v.O_CAUSE])}


@pytest.mark.parametrize("cause", [v.IN_ERROR_NFR, v.IN_ERROR_COMPONENT])
def test_s6_errors_climb_the_hierarchy(load, pellet, cause):
    leaf = replace(OBJECTIVE, name="o_leaf")
    knowledge_base = load(application())
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE, leaf), {"o_move": "camera_slow", "o_leaf": "scan_slow"})
    if cause == v.IN_ERROR_NFR:
        facts = replace(facts, levels={("o_leaf", "safety"): 0.9})
    else:
        facts = replace(facts, components={"laser": "FALSE"})
    assertions = knowledge_base.assertions(facts)
    requires = Assertion(v.RUNTIME + "fg/o_move/camera_slow", v.TOMASYS + "requiresO", v.RUNTIME + "o_leaf")
    found = {(a.subject, a.value) for a in pellet.infer([*assertions, requires], [v.O_CAUSE])}
    assert (v.RUNTIME + "o_move", cause) in found


def test_s2_s3_component_of_a_binding_breaks_the_grounding(load, pellet):
    knowledge_base = load(application(extra=ROLES.format(eye_class="", bound=BOUND)))
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "camera_slow"}, components={"eye": "FALSE"})
    result = knowledge_base.analyse(facts, pellet)
    assert result.objectives["o_move"].grounding_status == v.IN_ERROR_COMPONENT


def test_s10_s11_component_of_a_binding_makes_its_specification_unavailable(load, pellet):
    knowledge_base = load(application(extra=ROLES.format(eye_class="", bound=BOUND)))
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, components={"eye": "FALSE"})
    assert knowledge_base.analyse(facts, pellet).unrealisable == {"camera_slow": ("eye",)}


def test_s4_s5_class_without_a_spare_makes_its_designs_unrealisable(load, pellet):
    knowledge_base = load(application(extra=ROLES.format(eye_class=OF_CLASS, bound="")))
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, components={"eye": "FALSE"})
    assert knowledge_base.analyse(facts, pellet).unrealisable == {"camera_slow": ("spec_eye",)}


CAUSES = {
    "safety": {"levels": {("o_move", "safety"): 0.9}},
    "energy": {"levels": {("o_move", "energy"): 0.9}},
    "laser": {"components": {"laser": "FALSE"}},
    "base": {"components": {"base": "FALSE"}},
    "camera": {"components": {"camera": "FALSE"}},
    "recovered": {"components": {"spare": "RECOVERED"}},
    "broken": {"broken": frozenset({"o_move"})},
    "task": {"failed": frozenset({"o_move"})},
}
CONCLUDED = {
    "safety": {v.IN_ERROR_NFR},
    "energy": {v.IN_ERROR_NFR},
    "laser": {v.IN_ERROR_COMPONENT},
    "base": {v.IN_ERROR_COMPONENT},
    "camera": set(),
    "recovered": {v.UPDATABLE},
    "broken": {v.IN_ERROR_COMPONENT},
    "task": {v.IN_ERROR_NFR},
}


@pytest.mark.parametrize("count", [2, 3])
def test_several_causes_at_once_stay_consistent_and_are_all_found(load, pellet, count):
    knowledge_base = load(application(extra='<t:Component rdf:about="#spare"/>'))
    pellet.load(knowledge_base.ontology)
    for names in itertools.combinations(CAUSES, count):
        known = {"levels": {}, "components": {}, "broken": frozenset(), "failed": frozenset()}
        for name in names:
            for kind, value in CAUSES[name].items():
                known[kind] = known[kind] | value
        facts = replace(FACTS, **known)
        result = knowledge_base.analyse(facts, pellet).objectives["o_move"]
        assert result.causes == set().union(*(CONCLUDED[name] for name in names)), names
