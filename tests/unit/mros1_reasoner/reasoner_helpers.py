"""A small application model, and a reasoner that the tests share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mros1_reasoner.knowledge.model import Objective

DECIMAL = "http://www.w3.org/2001/XMLSchema#decimal"
HEAD = """<rdf:RDF xml:base="http://example.org/app" xmlns="http://example.org/app#"
  xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#"
  xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:swrl="http://www.w3.org/2003/11/swrl#"
  xmlns:t="http://metacontrol.org/tomasys#" xmlns:m="http://ros/mros#">
<owl:Ontology rdf:about="http://example.org/app"/>
"""
# design -> (expected levels, components that it requires)
DESIGNS = {
    "scan_fast": ({"safety": 0.7, "energy": 0.7, "performance": 1.0}, ["laser", "base"]),
    "scan_slow": ({"safety": 0.3, "energy": 0.4, "performance": 0.7}, ["laser", "base"]),
    "scan_slower": ({"safety": 0.2, "energy": 0.3, "performance": 0.6}, ["laser", "base"]),
    "camera_fast": ({"safety": 0.7, "energy": 0.7, "performance": 0.9}, ["camera", "base"]),
    "camera_slow": ({"safety": 0.3, "energy": 0.4, "performance": 0.2}, ["camera", "base"]),
    "camera_slower": ({"safety": 0.3, "energy": 0.3, "performance": 0.1}, ["camera", "base"]),
}
OBJECTIVE = Objective("o_move", "f_move", {"safety": 0.6, "energy": 0.62})


def application(
    designs: Mapping[str, tuple[Mapping[str, float], Sequence[str]]] = DESIGNS,
    extra: str = "",
    function: str = "f_move",
) -> str:
    """Return an application model as RDF/XML."""
    text = [HEAD, f'<t:Function rdf:about="#{function}"/>']
    text += [f'<t:QualityAttributeType rdf:about="#{q}"/>' for q in ("safety", "energy", "performance")]
    for name, (expected, _) in designs.items():
        text.append(f'<t:FunctionDesign rdf:about="#{name}"><t:solvesF rdf:resource="#{function}"/>')
        for quality, level in expected.items():
            text.append(f"<t:hasQAestimation>{value(f'{name}_{quality}', quality, level)}</t:hasQAestimation>")
        text.append("</t:FunctionDesign>")
    for component in sorted({c for _, components in designs.values() for c in components}):
        required = [name for name, (_, components) in designs.items() if component in components]
        links = "".join(f'<m:requiredBy rdf:resource="#{name}"/>' for name in required)
        text.append(f'<t:Component rdf:about="#{component}">{links}</t:Component>')
    return "\n".join([*text, extra, "</rdf:RDF>"])


def value(name: str, quality: str, level: float) -> str:
    """Return a QAvalue as RDF/XML."""
    return (
        f'<t:QAvalue rdf:about="#{name}"><t:isQAtype rdf:resource="#{quality}"/>'
        f'<t:hasValue rdf:datatype="{DECIMAL}">{level}</t:hasValue></t:QAvalue>'
    )
