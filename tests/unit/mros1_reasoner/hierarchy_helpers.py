"""The model of a dual-arm mobile manipulator that builds a pyramid (D1): functions that require functions."""

from mros1_reasoner.knowledge.model import Objective
from reasoner_helpers import HEAD, value

# design -> (function, performance, functions that it requires)
D1 = {
    "FD2": ("F0", 1.0, ()),
    "FD1": ("F0", 0.5, ("F1",)),
    "FD1.1": ("F1", 0.5, ("F2",)),
    "FD2.1": ("F2", 0.9, ()),
    "FD2.2": ("F2", 0.8, ()),
}
COMPONENTS = {"left_arm": ("FD2",), "right_arm": ("FD2", "FD1"), "base": ("FD1", "FD1.1"), "rgbd": ("FD2.1", "FD2.2")}
PICK_AND_PLACE = Objective("o_build", "F0")


def model(designs=D1, components=COMPONENTS, extra=""):
    """Return an application model as RDF/XML."""
    text = [HEAD, '<t:QualityAttributeType rdf:about="#performance"/><t:QualityAttributeType rdf:about="#error"/>']
    text += [f'<t:Function rdf:about="#{name}"/>' for name in sorted({function for function, _, _ in designs.values()})]
    for name, (function, performance, requires) in designs.items():
        links = "".join(f'<t:requiresF rdf:resource="#{required}"/>' for required in requires)
        text.append(
            f'<t:FunctionDesign rdf:about="#{name}"><t:solvesF rdf:resource="#{function}"/>{links}'
            f"<t:hasQAestimation>{value(f'{name}_use', 'performance', performance)}</t:hasQAestimation>"
            f"<t:hasQAestimation>{value(f'{name}_error', 'error', 0.2)}</t:hasQAestimation></t:FunctionDesign>"
        )
    for name, required_by in components.items():
        links = "".join(f'<m:requiredBy rdf:resource="#{design}"/>' for design in required_by)
        text.append(f'<t:Component rdf:about="#{name}">{links}</t:Component>')
    return "\n".join([*text, extra, "</rdf:RDF>"])
