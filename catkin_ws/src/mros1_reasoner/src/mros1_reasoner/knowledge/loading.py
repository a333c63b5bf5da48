"""Changes an application's ontology so that it loads with others: labels, and rules that ours replace."""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Iterable, Sequence

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.rules import rules_of
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, local_name, term_of

_log = logging.getLogger(__name__)

_A_RULE = f"<{v.SWRL}Imp>"


def renamed(triples: Iterable[Triple], number: int) -> list[Triple]:
    """Return triples with unique labels of blank nodes and one IRI of requiredBy, without those about the file."""

    def term(text: str) -> str:
        if text.startswith("_:"):
            return f"_:f{number}x{text[2:]}"
        if text.startswith("<") and local_name(text[1:-1]) == "requiredBy":
            return f"<{v.REQUIRED_BY}>"
        return text

    def is_about_file(triple: Triple) -> bool:
        predicate = iri_of(triple[1])
        is_ontology = predicate == v.RDF_TYPE and iri_of(triple[2]) == v.OWL_ONTOLOGY
        return predicate == v.OWL_IMPORTS or is_ontology or predicate.startswith(v.OWLREADY)

    return [(term(s), term(p), term(o)) for s, p, o in triples if not is_about_file((s, p, o))]


def without_concluding_rules(triples: list[Triple], where: str) -> list[Triple]:
    """Leave out the rules that conclude a derived status, because two values of a status contradict each other.

    A warning names them and the file `where` they are.
    """
    if not any(value == _A_RULE for _, _, value in triples):
        return triples  # as in most models, some of which are large
    concluding = [
        (rule, statuses)
        for rule in rules_of(Graph(triples))
        if (statuses := {atom.predicate for atom in rule.head} & set(v.DERIVED_STATUSES))
    ]
    if not concluding:
        return triples
    by_subject: dict[str, list[Triple]] = defaultdict(list)
    for triple in triples:
        by_subject[triple[0]].append(triple)

    def reach(node: str) -> set[str]:
        """Return the node with the nodes of its lists and atoms, which belong to no other node."""
        nodes, waiting = {node}, [node]
        while waiting:
            for _, _, value in by_subject[waiting.pop()]:
                if value in by_subject and value not in nodes and _is_rule_part(by_subject[value]):
                    nodes.add(value)
                    waiting.append(value)
        return nodes

    dropped = {node for rule, _ in concluding for node in reach(term_of(rule.node))}
    labels = [rule.label or f"a rule for {local_name(min(statuses))}" for rule, statuses in concluding]
    _log.warning("%s: its own rules are set aside, the generic ones hold: %s", where, ", ".join(sorted(labels)))
    return [triple for triple in triples if triple[0] not in dropped]


def _is_rule_part(statements: Sequence[Triple]) -> bool:
    predicates = {iri_of(predicate) for _, predicate, _ in statements}
    return v.RDF_FIRST in predicates or any(predicate.startswith(v.SWRL) for predicate in predicates)
