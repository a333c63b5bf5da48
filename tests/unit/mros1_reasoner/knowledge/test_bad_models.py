"""Models that make no sense are refused, or what makes none is left out, with a line that names the individual."""

import pytest
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import InconsistentError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import DECIMAL, OBJECTIVE, application, value

BOOLEAN = "http://www.w3.org/2001/XMLSchema#boolean"


def about(name, body):
    return f'<rdf:Description rdf:about="#{name}">{body}</rdf:Description>'


def test_requirement_of_a_missing_function_is_refused(load):
    extra = about("scan_slow", '<t:requiresF rdf:resource="#f_fly"/>')
    with pytest.raises(KnowledgeBaseError, match="scan_slow requires f_fly, which is no Function"):
        load(application(extra=extra))


def test_function_that_nothing_solves_is_told(load, caplog):
    extra = '<t:Function rdf:about="#f_fly"/>' + about("scan_slow", '<t:requiresF rdf:resource="#f_fly"/>')
    assert load(application(extra=extra)).solving("f_fly") == ()
    assert "Function f_fly can't be fulfilled: no FunctionDesign solves it" in caplog.text


def test_design_that_requires_what_nothing_solves_is_not_chosen(load, pellet):
    extra = '<t:Function rdf:about="#f_fly"/>' + about("scan_slow", '<t:requiresF rdf:resource="#f_fly"/>')
    knowledge_base = load(application(extra=extra))
    pellet.load(knowledge_base.ontology)
    core = Mape(knowledge_base, pellet, [OBJECTIVE], Settings(start_grace=0.0))
    (decision,) = core.step(0.0)
    assert decision.to_configuration == "scan_slower"
    refused = {c.name: c.refused_because for c in decision.candidates}
    assert refused["scan_slow"] == "requires f_fly, which no design can provide now"


def test_cycle_of_requirements_is_told_with_its_designs(load):
    extra = (
        '<t:Function rdf:about="#f_see"/><t:FunctionDesign rdf:about="#look"><t:solvesF rdf:resource="#f_see"/>'
        '<t:requiresF rdf:resource="#f_move"/></t:FunctionDesign>'
        + about("scan_slow", '<t:requiresF rdf:resource="#f_see"/>')
    )
    with pytest.raises(KnowledgeBaseError, match=r"f_move -> \(scan_slow\) f_see -> \(look\) -> f_move"):
        load(application(extra=extra))


def test_design_without_levels_is_told_and_not_chosen_where_there_are_limits(load, pellet, caplog):
    extra = '<t:FunctionDesign rdf:about="#bare"><t:solvesF rdf:resource="#f_move"/></t:FunctionDesign>'
    knowledge_base = load(application(extra=extra))
    assert "FunctionDesign bare has no expected quality levels" in caplog.text
    pellet.load(knowledge_base.ontology)
    (decision,) = Mape(knowledge_base, pellet, [OBJECTIVE], Settings(start_grace=0.0)).step(0.0)
    refused = {c.name: c.refused_because for c in decision.candidates}
    assert refused["bare"] == "no energy is expected of it; no safety is expected of it"


@pytest.mark.parametrize("level", ["1.5", "-0.1"])
def test_level_out_of_its_range_is_left_out_and_told(load, caplog, level):
    extra = about(
        "safety",
        f'<t:qa_min rdf:datatype="{DECIMAL}">0</t:qa_min><t:qa_max rdf:datatype="{DECIMAL}">1</t:qa_max>',
    )
    extra += '<t:FunctionDesign rdf:about="#odd"><t:solvesF rdf:resource="#f_move"/><t:hasQAestimation>'
    extra += value("odd_safety", "safety", level) + "</t:hasQAestimation></t:FunctionDesign>"
    assert load(application(extra=extra)).designs["odd"].expected == {}
    assert f"QAvalue odd_safety of odd is left out: {level} is not within the range of safety, 0 to 1" in caplog.text


@pytest.mark.parametrize("number", ["NaN", "INF", "much"])
def test_level_that_is_no_finite_number_is_left_out_and_told(load, caplog, number):
    extra = '<t:FunctionDesign rdf:about="#odd"><t:solvesF rdf:resource="#f_move"/><t:hasQAestimation>'
    extra += value("odd_safety", "safety", number).replace(DECIMAL, "http://www.w3.org/2001/XMLSchema#string")
    assert load(application(extra=extra + "</t:hasQAestimation></t:FunctionDesign>")).designs["odd"].expected == {}
    assert "QAvalue odd_safety of odd is left out" in caplog.text


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<t:qa_comparison_operator>!=</t:qa_comparison_operator>", "qa_comparison_operator of safety: '!=' is no"),
        (f'<t:qa_sign rdf:datatype="{DECIMAL}">3</t:qa_sign>', "qa_sign of safety must be one value"),
        ("<t:qa_max>high</t:qa_max>", "qa_max of safety must be one finite number"),
    ],
)
def test_quality_type_that_makes_no_sense_is_refused(load, body, message):
    with pytest.raises(KnowledgeBaseError, match=message):
        load(application(extra=about("safety", body)))


@pytest.mark.parametrize(
    ("extra", "name"),
    [
        ('<t:Component rdf:about="#scan_slow"/>', "scan_slow"),
        ('<t:Component rdf:about="#sonar"><m:requiredBy rdf:resource="#f_move"/></t:Component>', "f_move"),
        (
            f'<t:ComponentClass rdf:about="#eyes"><t:cc_unique rdf:datatype="{BOOLEAN}">true</t:cc_unique>'
            f'<t:cc_unique rdf:datatype="{BOOLEAN}">false</t:cc_unique></t:ComponentClass>',
            "eyes",
        ),
    ],
)
def test_inconsistent_ontology_is_refused_with_the_individual(load, pellet, extra, name):
    knowledge_base = load(application(extra=extra))
    with pytest.raises(InconsistentError, match=f"contradicts itself: .*#{name} "):
        pellet.load(knowledge_base.ontology)


# A rule of the model's own gives a laser that works a second mode, which is a contradiction once it is seen to work.
QUARREL = f"""
<owl:DatatypeProperty rdf:about="#mode"><rdf:type rdf:resource="{v.OWL_FUNCTIONAL_PROPERTY}"/></owl:DatatypeProperty>
<rdf:Description rdf:about="#laser"><mode rdf:datatype="{v.XSD}string">far</mode></rdf:Description>
<swrl:Imp><rdfs:label>quarrel</rdfs:label><swrl:body><swrl:AtomList><rdf:first><swrl:DatavaluedPropertyAtom>
 <swrl:propertyPredicate rdf:resource="{v.C_STATUS}"/>
 <swrl:argument1 rdf:resource="#laser"/><swrl:argument2>TRUE</swrl:argument2></swrl:DatavaluedPropertyAtom></rdf:first>
 <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></swrl:AtomList></swrl:body>
 <swrl:head><swrl:AtomList><rdf:first><swrl:DatavaluedPropertyAtom>
 <swrl:propertyPredicate rdf:resource="http://example.org/app#mode"/>
 <swrl:argument1 rdf:resource="#laser"/><swrl:argument2 rdf:datatype="{v.XSD}string">near</swrl:argument2>
 </swrl:DatavaluedPropertyAtom></rdf:first>
 <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></swrl:AtomList></swrl:head></swrl:Imp>
"""


def test_contradiction_at_run_time_names_the_individual_and_the_loop_goes_on(load, pellet):
    knowledge_base = load(application(extra=QUARREL))
    pellet.load(knowledge_base.ontology)
    core = Mape(knowledge_base, pellet, [OBJECTIVE], Settings())
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    for component in ("camera", "laser"):
        core.observe_component(0.0, component, "TRUE")
    with pytest.raises(InconsistentError, match=r"#laser has more than one value for the functional property .*mode"):
        core.step(0.0)
    core.observe_component(1.0, "laser", "FALSE")
    (decision,) = core.step(1.0)
    assert decision.to_configuration == "camera_slow"
