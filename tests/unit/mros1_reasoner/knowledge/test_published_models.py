"""Models written for the published system load beside our vocabulary as they are."""

import logging
import socket

import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Direction, Facts, Objective

# As Protege saves it: named individuals with rdf:type, floats and decimals, absolute IRIs, a namespace of its own.
NAVIGATION = """<?xml version="1.0"?>
<rdf:RDF xmlns="http://ros/navigation#" xml:base="http://ros/navigation"
  xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
  xmlns:mros="http://ros/mros#" xmlns:tomasys="http://metacontrol.org/tomasys#" xmlns:swrl="http://www.w3.org/2003/11/swrl#"
  xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#">
 <owl:Ontology rdf:about="http://ros/navigation">
  <owl:imports rdf:resource="http://metacontrol.org/tomasys"/><owl:imports rdf:resource="http://ros/mros"/>
  {imports}
 </owl:Ontology>
 <owl:NamedIndividual rdf:about="http://ros/navigation#f_navigate">
  <rdf:type rdf:resource="http://metacontrol.org/tomasys#Function"/></owl:NamedIndividual>
 {individuals}
</rdf:RDF>
"""
SPLIT = """<rdf:RDF xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
  xmlns:tomasys="http://metacontrol.org/tomasys#"><owl:Ontology rdf:about="http://ros/navigation_domain"/>
 <owl:NamedIndividual rdf:about="http://ros/mros#safety">
  <rdf:type rdf:resource="http://metacontrol.org/tomasys#QualityAttributeType"/></owl:NamedIndividual>
</rdf:RDF>
"""
FLOAT, DECIMAL = "http://www.w3.org/2001/XMLSchema#float", "http://www.w3.org/2001/XMLSchema#decimal"
STATUS_RULE = """
 <rdf:Description rdf:about="urn:swrl#o"><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#Variable"/></rdf:Description>
 <rdf:Description rdf:about="urn:swrl#q"><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#Variable"/></rdf:Description>
 <rdf:Description><rdfs:label>qa_safety_rule</rdfs:label><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#Imp"/>
  <swrl:body><rdf:Description><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#AtomList"/>
   <rdf:first><rdf:Description><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#IndividualPropertyAtom"/>
    <swrl:propertyPredicate rdf:resource="http://metacontrol.org/tomasys#hasNFR"/>
    <swrl:argument1 rdf:resource="urn:swrl#o"/><swrl:argument2 rdf:resource="urn:swrl#q"/></rdf:Description></rdf:first>
   <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></rdf:Description></swrl:body>
  <swrl:head><rdf:Description><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#AtomList"/>
   <rdf:first><rdf:Description><rdf:type rdf:resource="http://www.w3.org/2003/11/swrl#DatavaluedPropertyAtom"/>
    <swrl:propertyPredicate rdf:resource="http://metacontrol.org/tomasys#o_status"/>
    <swrl:argument1 rdf:resource="urn:swrl#o"/><swrl:argument2>INTERNAL_ERROR</swrl:argument2></rdf:Description>
   </rdf:first>
   <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></rdf:Description></swrl:head>
 </rdf:Description>
"""


def individual(name, kind, links=(), values=()):
    body = "".join(f'<{link} rdf:resource="{target}"/>' for link, target in links)
    body += "".join(f'<{link} rdf:datatype="{datatype}">{text}</{link}>' for link, datatype, text in values)
    return (
        f'<owl:NamedIndividual rdf:about="http://ros/navigation#{name}">'
        f'<rdf:type rdf:resource="http://metacontrol.org/tomasys#{kind}"/>{body}</owl:NamedIndividual>'
    )


def navigation(required_by="mros:requiredBy", quality="http://ros/mros#safety", extra="", imports=""):
    nav = "http://ros/navigation#"
    parts = []
    for name, level, datatype in (("f1_v1_r1", "0.32", DECIMAL), ("f3_v3_r1", "0.72", FLOAT)):
        links = [("tomasys:solvesF", nav + "f_navigate"), ("tomasys:hasQAestimation", f"{nav}{name}_qa")]
        parts.append(individual(name, "FunctionDesign", links))
        parts.append(
            individual(
                f"{name}_qa", "QAvalue", [("tomasys:isQAtype", quality)], [("tomasys:hasValue", datatype, level)]
            )
        )
    parts.append(individual("laser_resender", "Component", [(required_by, nav + "f3_v3_r1")]))
    return NAVIGATION.format(individuals="\n".join(parts) + extra, imports=imports)


@pytest.fixture
def write(tmp_path):
    """Return a function that writes files and returns their paths."""

    def write(**texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.owl").write_text(text)
        return [tmp_path / f"{name}.owl" for name in texts]

    return write


@pytest.fixture(autouse=True)
def no_network(monkeypatch):
    def refuse(*args, **kwargs):
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", refuse)


def causes(knowledge_base, pellet, **facts):
    pellet.load(knowledge_base.ontology)
    objective = Objective("o_navigateA", "f_navigate", {"safety": 0.5})
    result = knowledge_base.analyse(Facts((objective,), {"o_navigateA": "f3_v3_r1"}, **facts), pellet)
    return result.objectives["o_navigateA"].causes


@pytest.mark.parametrize("required_by", ["mros:requiredBy", "requiredBy"])
def test_model_as_protege_saves_it(write, pellet, required_by):
    knowledge_base = read_knowledge_base(write(navigation=navigation(required_by)))
    assert knowledge_base.designs["f1_v1_r1"].expected == {"safety": 0.32}
    assert knowledge_base.designs["f3_v3_r1"].expected == {"safety": 0.72}
    assert knowledge_base.designs["f3_v3_r1"].components == {"laser_resender"}
    facts = {"components": {"laser_resender": "FALSE"}, "levels": {("o_navigateA", "safety"): 0.6}}
    assert causes(knowledge_base, pellet, **facts) == {v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR}


def test_model_in_several_files(write):
    knowledge_base = read_knowledge_base(write(domain=SPLIT, navigation=navigation()))
    assert set(knowledge_base.qualities) == {"safety"}


def test_import_is_found_by_the_iri_of_a_file_of_another_name(write, caplog):
    imports = '<owl:imports rdf:resource="http://ros/navigation_domain"/>'
    files = write(navigation=navigation(imports=imports), elsewhere=SPLIT)
    knowledge_base = read_knowledge_base(files[:1])
    assert "safety" in knowledge_base.qualities
    assert "going on without" not in caplog.text


def test_error_that_a_rule_calls_by_its_former_name_counts(write, pellet, caplog):
    with caplog.at_level(logging.WARNING):
        knowledge_base = read_knowledge_base(write(navigation=navigation(extra=STATUS_RULE)))
    assert "INTERNAL_ERROR" not in knowledge_base.ontology + caplog.text
    assert causes(knowledge_base, pellet) == {v.IN_ERROR_COMPONENT}


def test_quality_that_is_a_degree_takes_its_direction_from_the_setting(write, pellet):
    directions = {"safety": Direction.HIGHER_IS_BETTER}
    knowledge_base = read_knowledge_base(write(navigation=navigation()), (), directions)
    assert causes(knowledge_base, pellet, levels={("o_navigateA", "safety"): 0.4}) == {v.IN_ERROR_NFR}
    assert causes(knowledge_base, pellet, levels={("o_navigateA", "safety"): 0.6}) == set()


def test_published_vocabulary_given_beside_ours_does_no_harm(write, pellet):
    vocabulary = NAVIGATION.format(individuals=STATUS_RULE, imports="").replace(
        '<owl:Ontology rdf:about="http://ros/navigation">', '<owl:Ontology rdf:about="http://metacontrol.org/tomasys">'
    )
    (model, given) = write(navigation=navigation(), tomasys=vocabulary)
    knowledge_base = read_knowledge_base([model], [given])
    assert causes(knowledge_base, pellet, components={"laser_resender": "FALSE"}) == {v.IN_ERROR_COMPONENT}


@pytest.mark.parametrize("iri", ["http://ros_navigation#", "http://models21#", "http://ros/navigation_domain#"])
def test_iris_of_the_model_do_not_matter(write, pellet, iri):
    knowledge_base = read_knowledge_base(
        write(app=navigation(quality=f"{iri}safety").replace("http://ros/navigation#", iri))
    )
    assert causes(knowledge_base, pellet, components={"laser_resender": "FALSE"}) == {v.IN_ERROR_COMPONENT}


def test_objective_asks_to_improve_always(write):
    extra = individual(
        "o_navigateB",
        "Objective",
        [("tomasys:typeF", "http://ros/navigation#f_navigate")],
        [("tomasys:o_always_improve", "http://www.w3.org/2001/XMLSchema#boolean", "true")],
    )
    (objective,) = read_knowledge_base(write(navigation=navigation(extra=extra))).objectives
    assert objective == Objective("o_navigateB", "f_navigate", {}, always_improve=True)
