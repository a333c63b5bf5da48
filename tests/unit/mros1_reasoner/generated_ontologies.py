"""Generated ontologies of applications in every shape, and facts that name individuals in every way."""

from itertools import product

from hypothesis import strategies as st
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion
from ontology_text import APP, OWL, RDFS, assertion, axiom, key, rule, typed

OWN = [f"{APP}{name}" for name in ("near", "beside", "peer", "rival", "weight")]
NEAR, BESIDE, PEER, RIVAL, WEIGHT = OWN
ASKED = [*v.CONCLUSIONS, v.REQUIRED_BY, v.SOLVES_F, v.REQUIRES_F, *OWN]
TOMASYS_CLASSES = {
    "F": v.FUNCTION,
    "D": v.FUNCTION_DESIGN,
    "C": v.COMPONENT,
    "E": v.COMPONENT_STATE,
    "S": v.COMPONENT_SPECIFICATION,
    "K": v.TOMASYS + "ComponentClass",
    "R": v.TOMASYS + "Role",
    "B": v.TOMASYS + "Binding",
    "X": f"{APP}Part",
    "Y": f"{APP}Part",
}
COUNTS = {"F": 2, "D": 5, "C": 4, "E": 2, "S": 2, "K": 2, "R": 2, "B": 3, "X": 4, "Y": 2}
INDIVIDUALS = {kind: [f"{APP}{kind}{i}" for i in range(count)] for kind, count in COUNTS.items()}
ALL = [name for names in INDIVIDUALS.values() for name in names]
RELATIONS = [
    (v.REQUIRED_BY, "C", "D"),
    (v.SOLVES_F, "D", "F"),
    (v.REQUIRES_F, "D", "F"),
    (v.TOMASYS + "roles", "D", "R"),
    (v.TOMASYS + "roleDef", "R", "S"),
    (v.TOMASYS + "typeC", "S", "K"),
    (v.TOMASYS + "typeC", "E", "K"),
    (v.TOMASYS + "binding_component", "B", "C"),
    (v.TOMASYS + "binding_role", "B", "R"),
    (NEAR, "X", "X"),
    (NEAR, "X", "D"),
    (NEAR, "C", "X"),
    (BESIDE, "D", "D"),
    (BESIDE, "Y", "X"),
]
PATTERNS = {
    "nothing": lambda i, j: False,
    "everything": lambda i, j: True,
    "each its own": lambda i, j: i == j,
    "all but its own": lambda i, j: i != j,
    "all of the first": lambda i, j: j == 0,
    "the first of all": lambda i, j: i == 0,
    "halves": lambda i, j: i % 2 == j % 2,
}
CHARACTERISTICS = ["Functional", "InverseFunctional", "Symmetric", "Transitive", "Reflexive", "Irreflexive"]
# More than a plain statement about two individuals.
ABOUT_INDIVIDUALS = {
    "different": lambda a, b: [assertion(a, OWL + "differentFrom", b)],
    "same": lambda a, b: [assertion(a, OWL + "sameAs", b)],
    "all different": lambda a, b: [axiom("AllDifferent", {"distinctMembers": sorted({a, b, ALL[0]})})],
    "undeclared property": lambda a, b: [assertion(a, APP + "note", b)],
    "text in a language": lambda a, b: [f'<{a}> <{WEIGHT}> "heavy"@en .\n'],
    "a class by its members": lambda a, b: [
        typed(f"{APP}Chosen", OWL + "Class"),
        axiom("Class", {"oneOf": [a, b]}, of=(f"{APP}Chosen", OWL + "equivalentClass")),
        rule([(f"{APP}Chosen", "?x")], [(PEER, "?x", "?x")]),
    ],
    "a class by a value": lambda a, b: [
        typed(f"{APP}Close", OWL + "Class"),
        axiom("Restriction", {"onProperty": NEAR, "hasValue": a}, of=(f"{APP}Close", OWL + "equivalentClass")),
        rule([(f"{APP}Close", "?x")], [(PEER, "?x", "?x")]),
    ],
    "a class without a name": lambda a, b: [
        axiom("Restriction", {"onProperty": NEAR, "hasValue": b}, of=(a, v.RDF_TYPE))
    ],
    "not so": lambda a, b: [
        axiom("NegativePropertyAssertion", {"sourceIndividual": a, "assertionProperty": NEAR, "targetIndividual": b})
    ],
    "a rule that names somebody": lambda a, b: [rule([(v.REQUIRED_BY, a, "?d")], [(PEER, "?d", b)])],
}
# What holds for all.
GENERAL = {
    "one neighbour at most": lambda: [
        axiom("Restriction", {"onProperty": NEAR, "maxCardinality": 1}, of=(f"{APP}Part", RDFS + "subClassOf"))
    ],
    "a key": lambda: [key(f"{APP}Part", [WEIGHT])],
    "peers": lambda: [rule([(v.REQUIRED_BY, "?c", "?x"), (v.REQUIRED_BY, "?c", "?y")], [(PEER, "?x", "?y")])],
    "own peers": lambda: [rule([(NEAR, "?x", "?y"), (BESIDE, "?y", "?y")], [(PEER, "?y", "?y")])],
    # Pellet branches at each pair that may differ, so there are few.
    "rivals": lambda: [
        rule(
            [(v.REQUIRES_F, "?d", "?x"), (v.REQUIRES_F, "?d", "?y"), (OWL + "differentFrom", "?x", "?y")],
            [(RIVAL, "?x", "?y")],
        )
    ],
    "the same by a rule": lambda: [rule([(BESIDE, "?x", "?y")], [(OWL + "sameAs", "?x", "?y")])],
}

# What rules alone can say: nobody is concluded to be the same as another one.
FUNCTIONAL = [v.SOLVES_F, *(v.TOMASYS + name for name in ("roleDef", "binding_component", "binding_role"))]
ONE_VALUE_AT_MOST = ["nothing", "each its own", "all of the first"]
OF_RULES = {
    "characteristics": ["Symmetric", "Transitive"],
    "about individuals": [
        "different",
        "all different",
        "undeclared property",
        "text in a language",
        "a rule that names somebody",
    ],
    "general": ["peers", "own peers", "rivals"],
}
OF_ALL = {
    "characteristics": CHARACTERISTICS,
    "about individuals": sorted(ABOUT_INDIVIDUALS),
    "general": sorted(GENERAL),
}

individuals = st.sampled_from(ALL)


@st.composite
def ontologies(draw, of_rules=False):
    """Draw an application's ontology: individuals, and for each relation who has whom.

    Args:
        draw: given by hypothesis.
        of_rules: whether to draw only what rules can say.
    """
    kinds = OF_RULES if of_rules else OF_ALL
    lines = [typed(f"{APP}Part", OWL + "Class"), typed(WEIGHT, OWL + "DatatypeProperty")]
    lines += [typed(name, OWL + "ObjectProperty") for name in OWN[:4]]
    for kind, names in INDIVIDUALS.items():
        lines += [typed(name, TOMASYS_CLASSES[kind]) for name in names]
    for predicate, subjects, values in RELATIONS:
        is_single = of_rules and predicate in FUNCTIONAL
        related = PATTERNS[draw(st.sampled_from(ONE_VALUE_AT_MOST if is_single else sorted(PATTERNS)))]
        every_pair = product(enumerate(INDIVIDUALS[subjects]), enumerate(INDIVIDUALS[values]))
        pairs = {(s, o) for (i, s), (j, o) in every_pair if related(i, j)}
        if not is_single and draw(st.integers(0, 3)) == 0:
            pairs ^= {(draw(st.sampled_from(INDIVIDUALS[subjects])), draw(st.sampled_from(INDIVIDUALS[values])))}
        lines += [assertion(s, predicate, o) for s, o in sorted(pairs)]
    for name in draw(st.lists(st.sampled_from(INDIVIDUALS["K"]), unique=True)):
        lines.append(assertion(name, v.TOMASYS + "cc_unique", "true", v.XSD + "boolean"))
    for name, weight in draw(st.dictionaries(individuals, st.sampled_from(["1", "2"]), max_size=4)).items():
        lines.append(assertion(name, WEIGHT, weight, v.XSD + "decimal"))
    lines += [typed(name, v.OWL_NAMED_INDIVIDUAL) for name in draw(st.lists(individuals, max_size=3))]
    for predicate in (NEAR, BESIDE):
        for characteristic in draw(st.lists(st.sampled_from(kinds["characteristics"]), max_size=1)):
            lines.append(typed(predicate, f"{OWL}{characteristic}Property"))
    lines += [assertion(draw(individuals), v.RDFS_LABEL, "label", v.XSD + "string")]
    for name in draw(st.lists(st.sampled_from(kinds["about individuals"]), max_size=2, unique=True)):
        lines += ABOUT_INDIVIDUALS[name](*draw(st.lists(individuals, min_size=2, max_size=2, unique=True)))
    for name in draw(st.lists(st.sampled_from(kinds["general"]), max_size=2, unique=True)):
        lines += GENERAL[name]()
    return "".join(lines)


@st.composite
def facts(draw):
    """Draw what is known at one moment: statuses, a grounding with bindings, and what else may name individuals."""
    found = []
    statuses = st.sampled_from(["TRUE", "FALSE", "FALSE", "RECOVERED"])
    parts = st.sampled_from(INDIVIDUALS["C"] + INDIVIDUALS["E"])
    for name, status in draw(st.dictionaries(parts, statuses, max_size=3)).items():
        found.append(Assertion(name, v.C_STATUS, status, v.XSD + "string"))
    objective, grounding = v.RUNTIME + "o", v.RUNTIME + "fg"
    found.append(Assertion(objective, v.RDF_TYPE, v.OBJECTIVE))
    if draw(st.booleans()):
        found.append(Assertion(grounding, v.RDF_TYPE, v.FUNCTION_GROUNDING))
        found.append(Assertion(grounding, v.SOLVES_O, objective))
        found.append(Assertion(grounding, v.TYPE_FD, draw(st.sampled_from(INDIVIDUALS["D"]))))
        bindings = draw(st.lists(st.sampled_from(INDIVIDUALS["B"]), max_size=2, unique=True))
        found += [Assertion(grounding, v.TOMASYS + "hasBindings", binding) for binding in bindings]
        if draw(st.booleans()):
            found.append(Assertion(objective, v.O_CAUSE, v.IN_ERROR_NFR, v.XSD + "string"))
    for subject, target in draw(st.lists(st.tuples(individuals, individuals), max_size=2)):
        found.append(Assertion(subject, draw(st.sampled_from([NEAR, BESIDE])), target))
    return found
