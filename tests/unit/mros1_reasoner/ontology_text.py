"""Statements of OWL and SWRL as N-Triples."""

import re
from itertools import count

from mros1_reasoner.knowledge import vocabulary as v

APP = "http://example.org/app#"
OWL = "http://www.w3.org/2002/07/owl#"
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"

BUILT_INS = (
    "add",
    "subtract",
    "stringConcat",
    "greaterThan",
    "lessThan",
    "greaterThanOrEqual",
    "lessThanOrEqual",
    "equal",
    "multiply",
)
DATA_PROPERTIES = ("hasValue", "status", "cause", "realisability", "qa_sign", "updatable", "weight", "stamp")

_numbers = count()


def assertion(subject, predicate, value, datatype=""):
    """Return a statement about an individual."""
    target = f'"{value}"^^<{datatype}>' if datatype else _term(value)
    return f"{_term(subject)} <{predicate}> {target} .\n"


def typed(subject, kind):
    return assertion(subject, v.RDF_TYPE, kind)


def axiom(kind, parts, *, of=None):
    """Return what a blank node says, in the terms of OWL, and by which (subject, predicate) it is referred to."""
    node = _blank()
    lines = [typed(node, OWL + kind)]
    if of:
        lines.append(assertion(of[0], of[1], node))
    for name, value in parts.items():
        if isinstance(value, int):
            lines.append(assertion(node, OWL + name, value, v.XSD + "nonNegativeInteger"))
        elif isinstance(value, str):
            lines.append(assertion(node, OWL + name, value))
        else:
            head, statements = listed(value)
            lines += [assertion(node, OWL + name, head), statements]
    return "".join(lines)


def key(kind, properties):
    """Return that individuals of a class that have the same values of the properties are the same."""
    head, statements = listed(properties)
    return assertion(kind, OWL + "hasKey", head) + statements


def listed(items, kind=RDF + "List"):
    """Return the first node of a list, and the statements that make it."""
    nodes = [_blank() for _ in items]
    lines = []
    for node, item, rest in zip(nodes, items, [*nodes[1:], RDF + "nil"], strict=True):
        lines += [typed(node, kind), assertion(node, RDF + "first", item), assertion(node, RDF + "rest", rest)]
    return nodes[0], "".join(lines)


def rule(body, head):
    """Return a rule. An atom is (class, term) or (property, term, term); a term is an IRI, or ?x for a variable."""
    node, lines = _blank(), []
    for name, atoms in (("body", body), ("head", head)):
        nodes = []
        for predicate, *terms in atoms:
            atom = _blank()
            nodes.append(atom)
            if predicate in (OWL + "differentFrom", OWL + "sameAs"):
                kind = "DifferentIndividualsAtom" if predicate.endswith("From") else "SameIndividualAtom"
                lines.append(typed(atom, v.SWRL + kind))
            elif len(terms) == 1:
                lines += [typed(atom, v.SWRL + "ClassAtom"), assertion(atom, v.SWRL + "classPredicate", predicate)]
            else:
                lines.append(typed(atom, v.SWRL + "IndividualPropertyAtom"))
                lines.append(assertion(atom, v.SWRL + "propertyPredicate", predicate))
            for number, term in enumerate(terms, 1):
                iri = f"urn:swrl:var#{term[1:]}" if term.startswith("?") else term
                lines.append(assertion(atom, f"{v.SWRL}argument{number}", iri))
                if iri != term:
                    lines.append(typed(iri, v.SWRL + "Variable"))
        first, statements = listed(nodes, v.SWRL + "AtomList")
        lines += [statements, assertion(node, v.SWRL + name, first)]
    return "".join([typed(node, v.SWRL + "Imp"), *lines])


def swrl(text, label=""):
    """Return a rule such as `solvesO(?fg, ?o), fg_status(?fg, 'IN_ERROR_NFR') -> o_status(?o, 'IN_ERROR_NFR')`.

    A name is of TOMASys, of SWRL's built-ins, or with a prefix: `app:near`, `mros:requiredBy`. Text stands in quotes;
    true and false are booleans, numbers decimals.
    """
    node, lines = _blank(), []
    for name, part in zip(("body", "head"), text.split("->"), strict=True):
        nodes = []
        for predicate, arguments in re.findall(r"([\w:]+)\(([^)]*)\)", part):
            atom, terms = _blank(), [term.strip() for term in arguments.split(",")]
            nodes.append(atom)
            lines += _atom(atom, predicate, terms)
        first, statements = listed(nodes, v.SWRL + "AtomList")
        lines += [statements, assertion(node, v.SWRL + name, first)]
    lines += [assertion(node, v.RDFS_LABEL, label, v.XSD + "string")] if label else []
    return "".join([typed(node, v.SWRL + "Imp"), *lines])


def _atom(node, predicate, terms):
    """Yield the statements of an atom."""
    is_value = terms[-1][0] != "?" and _value(terms[-1]) is not None
    if predicate in BUILT_INS:
        yield typed(node, v.SWRL + "BuiltinAtom")
        yield assertion(node, v.SWRL + "builtin", v.SWRLB + predicate)
        cells = [_blank() for _ in terms]
        yield assertion(node, v.SWRL + "arguments", cells[0])
        for cell, term, rest in zip(cells, terms, [*cells[1:], RDF + "nil"], strict=True):
            yield typed(cell, RDF + "List") + _argument(cell, RDF + "first", term) + assertion(cell, RDF + "rest", rest)
        return
    if len(terms) == 1:
        yield typed(node, v.SWRL + "ClassAtom") + assertion(node, v.SWRL + "classPredicate", _iri(predicate))
    else:
        is_data = is_value or predicate.endswith(DATA_PROPERTIES)
        yield typed(node, v.SWRL + ("DatavaluedPropertyAtom" if is_data else "IndividualPropertyAtom"))
        yield assertion(node, v.SWRL + "propertyPredicate", _iri(predicate))
    for number, term in enumerate(terms, 1):
        yield _argument(node, f"{v.SWRL}argument{number}", term)


def _argument(node, predicate, term):
    if term[0] == "?":
        iri = f"urn:swrl:var#{term[1:]}"
        return typed(iri, v.SWRL + "Variable") + assertion(node, predicate, iri)
    value = _value(term)
    return assertion(node, predicate, *value) if value else assertion(node, predicate, _iri(term))


def _value(term):
    """Return text and datatype of a value; None: it is an individual."""
    if term[0] == "'":
        return term.strip("'"), v.XSD + "string"
    if term in ("true", "false"):
        return term, v.XSD + "boolean"
    return (term, v.XSD + "decimal") if re.fullmatch(r"-?[\d.]+", term) else None


def _iri(name):
    prefix, _, local = name.rpartition(":")
    return {"": v.TOMASYS, "app": APP, "mros": v.MROS}[prefix] + local


def _term(name):
    return name if name.startswith("_:") else f"<{name}>"


def _blank():
    return f"_:made{next(_numbers)}"
