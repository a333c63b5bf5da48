"""Equivalent individuals: an ontology says the same about them, so Pellet reasons about one of them only.

When every statement about one individual also holds for another one, the two can be exchanged without a change of the
ontology. So what follows for one follows for the other, until a fact distinguishes them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.triples import Triple, iri_of, literal_of

_OWL = "http://www.w3.org/2002/07/owl#"
_PROPERTIES = (_OWL + "ObjectProperty", _OWL + "DatatypeProperty")
_LANGUAGE = (_OWL, "http://www.w3.org/2000/01/rdf-schema#", v.SWRL)
_NOTES = (v.RDFS_LABEL, "http://www.w3.org/2000/01/rdf-schema#comment")


@dataclass(frozen=True)
class Expansion:
    """Copies the conclusions about the deputy of each group to the other members: (deputy, others)."""

    groups: tuple[tuple[str, tuple[str, ...]], ...]

    def __call__(self, values: Iterable[Assertion]) -> set[Assertion]:
        """Return the values of the deputies and those of the individuals that they stand for."""
        found = set(values)
        for deputy, others in self.groups:
            for value in [value for value in found if deputy in (value.subject, value.value)]:
                for other in others:
                    subject = other if value.subject == deputy else value.subject
                    target = other if value.value == deputy and not value.datatype else value.value
                    found.add(value._replace(subject=subject, value=target))
        return found


class EquivalentIndividuals:
    """Groups of individuals about which an ontology says the same.

    Attributes:
        reduced: the ontology with the first one of each group only.
    """

    def __init__(self, triples: Sequence[Triple]) -> None:
        """Find the groups in the triples of an ontology."""
        about: dict[str, list[Triple]] = defaultdict(list)
        candidates = set()
        sayable = {v.RDF_TYPE} | {
            iri_of(s) for s, p, o in triples if iri_of(p) == v.RDF_TYPE and iri_of(o) in _PROPERTIES
        }
        for triple in triples:
            subject, predicate, value = triple
            if iri_of(predicate) in _NOTES:
                continue
            if iri_of(predicate) == v.RDF_TYPE and not subject.startswith("_:") and _is_class_of_individuals(value):
                candidates.add(subject)
            for term in {subject, predicate, value}:
                about[term].append(triple)
        groups: dict[tuple[tuple[str, ...], ...], list[str]] = defaultdict(list)
        for term in sorted(candidates):
            if all(iri_of(predicate) in sayable for _, predicate, _ in about[term]):
                shape = sorted(tuple("" if part == term else part for part in triple) for triple in about[term])
                groups[tuple(shape)].append(term)
        self._groups = [group for group in groups.values() if len(group) > 1]
        self._about = {term: about[term] for group in self._groups for term in group}
        dropped = {term for group in self._groups for term in group[1:]}
        self.reduced = [triple for triple in triples if dropped.isdisjoint(triple)]

    def split(self, facts: Sequence[Assertion]) -> tuple[list[Assertion], Expansion]:
        """Return the facts to add to the reduced ontology, and how to expand what follows.

        An individual that a fact mentions is in no group. One of the others is the deputy of its group.
        """
        mentioned = {f"<{fact.subject}>" for fact in facts} | {f"<{f.value}>" for f in facts if not f.datatype}
        added: list[Assertion] = []
        groups = []
        for group in self._groups:
            own = [term for term in group if term in mentioned]
            rest = [term for term in group if term not in mentioned]
            for term in [*own, *rest[:1]]:
                if term != group[0]:
                    added += [_assertion(t) for t in self._about[term] if iri_of(t[2]) != v.OWL_NAMED_INDIVIDUAL]
            if len(rest) > 1:
                groups.append((iri_of(rest[0]), tuple(iri_of(term) for term in rest[1:])))
        return [*facts, *added], Expansion(tuple(groups))


def _is_class_of_individuals(term: str) -> bool:
    iri = iri_of(term)
    return iri == v.OWL_NAMED_INDIVIDUAL or not iri.startswith(("_:", *_LANGUAGE))


def _assertion(triple: Triple) -> Assertion:
    subject, predicate, value = triple
    literal = literal_of(value)
    if literal is None:
        return Assertion(iri_of(subject), iri_of(predicate), iri_of(value))
    return Assertion(iri_of(subject), iri_of(predicate), literal[0], literal[1] or v.XSD + "string")
