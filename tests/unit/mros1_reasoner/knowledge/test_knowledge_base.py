import socket
import urllib.request

import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Direction, Facts
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from reasoner_helpers import HEAD, OBJECTIVE, application, value

RULE = """
<swrl:Variable rdf:about="urn:x#fd"/><swrl:Variable rdf:about="urn:x#o"/>
<swrl:Imp><rdfs:label>{label}</rdfs:label>
 <swrl:body><swrl:AtomList><rdf:first><swrl:ClassAtom><swrl:classPredicate rdf:resource="http://metacontrol.org/tomasys#{body}"/>
  <swrl:argument1 rdf:resource="urn:x#o"/></swrl:ClassAtom></rdf:first>
  <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></swrl:AtomList></swrl:body>
 <swrl:head><swrl:AtomList><rdf:first><swrl:DatavaluedPropertyAtom>
  <swrl:propertyPredicate rdf:resource="http://metacontrol.org/tomasys#{head}"/><swrl:argument1 rdf:resource="urn:x#o"/>
  <swrl:argument2 rdf:datatype="http://www.w3.org/2001/XMLSchema#string">{value}</swrl:argument2>
 </swrl:DatavaluedPropertyAtom></rdf:first>
 <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></swrl:AtomList></swrl:head></swrl:Imp>
"""


def test_designs_come_with_levels_and_components(knowledge_base):
    design = knowledge_base.designs["camera_slow"]
    assert design.function == "f_move"
    assert design.expected == {"safety": 0.3, "energy": 0.4, "performance": 0.2}
    assert design.components == {"camera", "base"}


def test_missing_file_is_named(tmp_path):
    with pytest.raises(KnowledgeBaseError, match=r"nowhere\.owl: No such file"):
        read_knowledge_base([tmp_path / "nowhere.owl"])


@pytest.mark.parametrize("text", ["", "just words\n", "<html><body/></html>", "<rdf:RDF", "\x00\x01", '{"a": 1}'])
def test_file_that_is_not_owl_is_named(load, text):
    with pytest.raises(KnowledgeBaseError, match=r"app\.owl: ") as caught:
        load(text)
    assert "\n" not in str(caught.value)


def test_model_without_function_is_refused(load):
    with pytest.raises(KnowledgeBaseError, match="no individual of class Function"):
        load(HEAD + '<t:Component rdf:about="#laser"/></rdf:RDF>')


def test_design_without_function_is_named(load):
    with pytest.raises(KnowledgeBaseError, match="FunctionDesign lost solves no Function"):
        load(application(extra='<t:FunctionDesign rdf:about="#lost"/>'))


def test_design_without_levels_is_named(load, caplog):
    load(
        application(extra='<t:FunctionDesign rdf:about="#bare"><t:solvesF rdf:resource="#f_move"/></t:FunctionDesign>')
    )
    assert "bare has no expected quality levels" in caplog.text


def test_functions_that_require_each_other_are_refused(load):
    extra = '<rdf:Description rdf:about="#scan_slow"><t:requiresF rdf:resource="#f_move"/></rdf:Description>'
    with pytest.raises(KnowledgeBaseError, match=r"f_move -> \(scan_slow\) -> f_move"):
        load(application(extra=extra))


def test_two_individuals_of_one_name_are_refused(load):
    with pytest.raises(KnowledgeBaseError, match="two individuals are called f_move"):
        load(application(extra='<t:Function rdf:about="http://other.org/x#f_move"/>'))


def test_required_by_of_the_models_own_namespace_counts(load, pellet):
    own = (
        '<t:Component rdf:about="#sonar"><requiredBy rdf:resource="#scan_slow"/></t:Component>'
        '<owl:ObjectProperty rdf:about="#requiredBy"/>'
    )
    knowledge_base = load(application(extra=own))
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, components={"sonar": "FALSE"})
    assert knowledge_base.analyse(facts, pellet).unrealisable == {"scan_slow": ("sonar",)}


def test_other_rules_of_a_model_stay(load, pellet):
    extra = RULE.format(label="eager", body="Objective", head="o_cause", value="UPDATABLE")
    knowledge_base = load(application(extra=extra))
    pellet.load(knowledge_base.ontology)
    result = knowledge_base.analyse(Facts((OBJECTIVE,)), pellet)
    assert result.objectives["o_move"].causes == {v.UPDATABLE}


def test_asserted_statuses_are_lifted(load, pellet):
    extra = (
        '<t:Objective rdf:about="#o_move"><t:typeF rdf:resource="#f_move"/>'
        "<t:o_status>UPDATABLE</t:o_status></t:Objective>"
        '<rdf:Description rdf:about="#laser"><t:c_status>FALSE</t:c_status></rdf:Description>'
        '<rdf:Description rdf:about="#scan_slow">'
        '<t:fd_realisability rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">true</t:fd_realisability>'
        "</rdf:Description>"
    )
    knowledge_base = load(application(extra=extra))
    pellet.load(knowledge_base.ontology)
    assert knowledge_base.component_statuses == {"laser": "FALSE"}
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, components=knowledge_base.component_statuses)
    result = knowledge_base.analyse(facts, pellet)
    assert result.objectives["o_move"].status == v.IN_ERROR_COMPONENT
    assert "scan_slow" in result.unrealisable


def test_objectives_of_the_model_bring_their_limits(load):
    extra = (
        '<t:Objective rdf:about="#o_go"><t:typeF rdf:resource="#f_move"/>'
        f"<t:hasNFR>{value('n', 'safety', 0.5)}</t:hasNFR></t:Objective>"
    )
    assert load(application(extra=extra)).objectives[0].limits == {"safety": 0.5}


def test_direction_comes_from_the_model_unless_set(load):
    extra = '<rdf:Description rdf:about="#safety"><t:qa_sign>-1</t:qa_sign></rdf:Description>'
    qualities = load(application(extra=extra)).qualities
    assert qualities["safety"].direction is Direction.HIGHER_IS_BETTER
    assert qualities["energy"].direction is Direction.LOWER_IS_BETTER


def test_imports_are_read_from_the_models_folder_never_from_the_network(load, monkeypatch, caplog):
    asked = []

    def no_network(*words, **_):
        asked.append(words)
        raise OSError("there is no network")

    for place, name in ((socket.socket, "connect"), (socket, "getaddrinfo"), (urllib.request, "urlopen")):
        monkeypatch.setattr(place, name, no_network)
    text = application().replace(
        '<owl:Ontology rdf:about="http://example.org/app"/>',
        '<owl:Ontology rdf:about="http://example.org/app"><owl:imports rdf:resource="http://example.org/parts"/>'
        '<owl:imports rdf:resource="http://example.org/unknown"/><owl:imports rdf:resource="http://ros/mros"/></owl:Ontology>',
    )
    parts = HEAD.replace("example.org/app", "example.org/parts") + '<t:Component rdf:about="#wheel"/></rdf:RDF>'
    knowledge_base = load(text, parts=parts)
    assert "wheel" in knowledge_base.components
    assert "http://example.org/unknown" in caplog.text
    assert "http://ros/mros>" not in caplog.text
    assert asked == []


def test_saved_knowledge_base_loads_again(load, pellet, tmp_path):
    knowledge_base = load()
    pellet.load(knowledge_base.ontology)
    facts = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, {("o_move", "safety"): 0.7}, {"laser": "FALSE"})
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, facts, knowledge_base.analyse(facts, pellet))
    again = read_knowledge_base([tmp_path / "saved.owl"])
    assert again.designs.keys() == knowledge_base.designs.keys()
    assert again.designs["scan_slow"].expected == knowledge_base.designs["scan_slow"].expected
    assert again.objectives[0].limits == OBJECTIVE.limits
    pellet.load(again.ontology)
    assert again.analyse(facts, pellet) == knowledge_base.analyse(facts, pellet)


def test_expected_levels_are_not_handed_over(knowledge_base):
    assert "scan_slow_safety" not in knowledge_base.ontology


def test_knowledge_bases_do_not_share_a_world(load):
    import owlready2

    load()
    assert not list(owlready2.default_world.individuals())
