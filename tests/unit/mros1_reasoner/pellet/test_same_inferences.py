"""Pellet in its child process infers what owlready2's own call of Pellet infers, over models made at random."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from reasoner_helpers import HEAD, value

COMPONENTS = ("laser", "camera", "base")
QUALITIES = ("safety", "energy")
OPERATORS = ("&gt;", "&gt;=", "&lt;", "&lt;=")
LEVELS = st.sampled_from([0.1, 0.6, 0.61, 0.9])
NAMES = tuple("abcdef")


@st.composite
def models(draw):
    """Draw (text of a model, facts that fit it): designs of two functions, one of which may require the other."""
    parts = [HEAD, '<t:Function rdf:about="#f_up"/><t:Function rdf:about="#f_down"/>']
    for quality in QUALITIES:
        operator = draw(st.sampled_from(OPERATORS))
        parts.append(
            f'<t:QualityAttributeType rdf:about="#{quality}">'
            f"<t:qa_comparison_operator>{operator}</t:qa_comparison_operator></t:QualityAttributeType>"
        )
    ups = draw(st.lists(st.sampled_from(NAMES), unique=True, min_size=1, max_size=3))
    downs = draw(st.lists(st.sampled_from([name.upper() for name in NAMES]), unique=True, min_size=1, max_size=3))
    requiring = [name for name in ups if draw(st.booleans())]
    has_role = draw(st.sampled_from([*ups, *downs]))
    for name in (*ups, *downs):
        links = '<t:requiresF rdf:resource="#f_down"/>' if name in requiring else ""
        links += '<t:roles rdf:resource="#seeing"/>' if name == has_role else ""
        level = f"<t:hasQAestimation>{value(f'{name}_energy', 'energy', draw(LEVELS))}</t:hasQAestimation>"
        function = "f_up" if name in ups else "f_down"
        parts.append(
            f'<t:FunctionDesign rdf:about="#{name}"><t:solvesF rdf:resource="#{function}"/>{links}{level}'
            "</t:FunctionDesign>"
        )
    for component in COMPONENTS:
        required_by = [name for name in (*ups, *downs) if draw(st.booleans())]
        links = "".join(f'<m:requiredBy rdf:resource="#{name}"/>' for name in required_by)
        parts.append(f'<t:Component rdf:about="#{component}">{links}</t:Component>')
    unique = str(draw(st.booleans())).lower()
    parts.append(
        '<t:ComponentClass rdf:about="#eyes"><t:cc_unique rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">'
        f"{unique}</t:cc_unique></t:ComponentClass>"
        '<t:Role rdf:about="#seeing"><t:roleDef rdf:resource="#spec"/></t:Role>'
        '<t:ComponentSpecification rdf:about="#spec"><t:typeC rdf:resource="#eyes"/></t:ComponentSpecification>'
        '<t:ComponentState rdf:about="#eye"><t:typeC rdf:resource="#eyes"/></t:ComponentState></rdf:RDF>'
    )
    return "\n".join(parts), draw(facts(ups, downs, requiring))


@st.composite
def facts(draw, ups, downs, requiring):
    """Draw facts: an objective above and one below, what runs for them, levels, statuses."""
    limits = draw(st.dictionaries(st.sampled_from(QUALITIES), LEVELS))
    objectives = (Objective("o_up", "f_up", limits), Objective("o_down", "f_down", {"safety": 0.6}))
    groundings = {"o_up": draw(st.sampled_from(ups))}
    if draw(st.booleans()):
        groundings["o_down"] = draw(st.sampled_from(downs))
    keys = [(name, quality) for name in groundings for quality in QUALITIES]
    statuses = st.sampled_from(["TRUE", "FALSE", "RECOVERED"])
    return Facts(
        objectives=objectives,
        groundings=groundings,
        levels=draw(st.dictionaries(st.sampled_from(keys), LEVELS)),
        components=draw(st.dictionaries(st.sampled_from([*COMPONENTS, "eye"]), statuses, min_size=1)),
        broken=frozenset(name for name in groundings if draw(st.booleans())),
        failed=frozenset(name for name in groundings if draw(st.booleans())),
        requires={"o_up": ("o_down",)} if groundings["o_up"] in requiring else {},
    )


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(drawn=models())
def test_child_infers_what_owlready2_infers(load, pellet, reference, drawn):
    text, known = drawn
    knowledge_base = load(text)
    pellet.load(knowledge_base.ontology)
    reference.load(knowledge_base.ontology)
    assertions = knowledge_base.assertions(known)
    assert pellet.infer(assertions, v.CONCLUSIONS) == reference.infer(assertions, v.CONCLUSIONS)
