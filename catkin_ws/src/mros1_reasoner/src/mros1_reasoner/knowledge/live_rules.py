"""The rules that an analysis needs. A rule is idle in a model when it can't conclude anything there, or nobody asks.

A rule can conclude something when each property in its body is in a statement of the ontology, in a fact, or in the
head of a rule that can. It is asked for when an analysis asks for what it concludes, or a rule does that is asked for.
A rule is needed in any case when its conclusion could contradict something: when it is not a value of a property that
neither is functional nor is related to others by an axiom.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.rules import Atom, Rule, rule_nodes, rules_of
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, term_of

_SPEAK_OF_ONE = (v.RDF_TYPE, v.RDFS_LABEL, v.RDFS_COMMENT, v.RDFS_DOMAIN, v.RDFS_RANGE)
_LANGUAGE = (v.OWL, v.RDFS, v.RDF)


def without_idle(
    triples: Sequence[Triple], given: Collection[str], asked: Collection[str]
) -> tuple[list[Triple], list[Triple]]:
    """Return the triples without idle rules, and those of the idle rules.

    Args:
        triples: of a whole ontology.
        given: properties and classes that facts may have.
        asked: properties that an analysis asks for.
    """
    rules = rules_of(Graph(triples))
    axioms, said = _said(triples)
    contradictable = {iri_of(s) for s, p, o in triples if iri_of(o) == v.OWL_FUNCTIONAL_PROPERTY} | axioms
    can = _that_can(rules, said | set(given) | axioms)
    needed = _that_are_asked(can, set(asked) | contradictable)
    idle = {term_of(rule.node) for rule in rules} - {term_of(rule.node) for rule in needed}
    nodes = rule_nodes(triples, idle)
    return [t for t in triples if t[0] not in nodes], [t for t in triples if t[0] in nodes]


def _said(triples: Iterable[Triple]) -> tuple[set[str], set[str]]:
    """Return the properties and classes that axioms relate to others, and those of which there are statements."""
    related: set[str] = set()
    said: set[str] = set()
    for subject, predicate, value in triples:
        name = iri_of(predicate)
        said.add(name)
        if name.startswith(_LANGUAGE) and name not in _SPEAK_OF_ONE:
            related |= {iri_of(subject), iri_of(value)}
    return related, said


def _that_can(rules: Sequence[Rule], said: set[str]) -> list[Rule]:
    def can(rule: Rule, names: set[str]) -> bool:
        return all(atom.predicate in names or not _is_of_property(atom) for atom in rule.body)

    return _reached(rules, said, can, lambda rule: rule.head)


def _that_are_asked(rules: Sequence[Rule], asked: set[str]) -> list[Rule]:
    def is_asked(rule: Rule, names: set[str]) -> bool:
        return any(atom.predicate in names or not _is_of_value(atom) for atom in rule.head)

    return _reached(rules, asked, is_asked, lambda rule: rule.body)


def _reached(
    rules: Sequence[Rule],
    names: set[str],
    is_reached: Callable[[Rule, set[str]], bool],
    brings: Callable[[Rule], Iterable[Atom]],
) -> list[Rule]:
    """Return the rules that names reach, directly or by the predicates of the atoms that a reached rule brings."""
    found: dict[str, Rule] = {}
    while new := [rule for rule in rules if rule.node not in found and is_reached(rule, names)]:
        found |= {rule.node: rule for rule in new}
        names = names | {atom.predicate for rule in new for atom in brings(rule)}
    return list(found.values())


def _is_of_property(atom: Atom) -> bool:
    return len(atom.arguments) == 2 and "#" in atom.predicate and not atom.predicate.startswith(v.SWRLB)


def _is_of_value(atom: Atom) -> bool:
    return _is_of_property(atom) and atom.arguments[1][:1] == '"'
