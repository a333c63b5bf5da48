"""Equivalent individuals: an ontology says the same about them, so Pellet reasons about one of them only.

Two individuals are equivalent when the ontology stays the same if they change places. So what follows for one follows
for the other. One of them, the deputy, can take the place of a whole group in every statement: each statement then
becomes one that the ontology holds already. A model of the smaller ontology becomes a model of the whole one when each
individual denotes what its deputy denotes. So the whole ontology implies nothing else.

This holds for every axiom and rule that does not name the individuals: functional properties, cardinalities, keys,
inequalities and built-ins of rules included. It holds because two names may denote the same in OWL. An individual is in
no group when a class expression, a rule, owl:sameAs, owl:differentFrom or anything else than a plain statement names
it. A plain statement gives its class, or the value of a declared property.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.triples import Triple, iri_of, literal_of

_OWL = "http://www.w3.org/2002/07/owl#"
_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
_RDFS = "http://www.w3.org/2000/01/rdf-schema#"
_LANGUAGE = (_OWL, _RDF, _RDFS, v.SWRL, v.XSD)
_TYPE = f"<{v.RDF_TYPE}>"
_NAMED_INDIVIDUAL = f"<{v.OWL_NAMED_INDIVIDUAL}>"
_OBJECT_PROPERTY, _DATATYPE_PROPERTY = f"<{_OWL}ObjectProperty>", f"<{_OWL}DatatypeProperty>"
_ANNOTATION_PROPERTY = f"<{_OWL}AnnotationProperty>"
_NOTES = (f"<{v.RDFS_LABEL}>", f"<{_RDFS}comment>")


@dataclass(frozen=True)
class Expansion:
    """Copies the conclusions about the deputies of each group to the other members.

    Attributes:
        members: the members that each deputy stands for, the deputy included.
    """

    members: Mapping[str, tuple[str, ...]]

    def __call__(self, values: Iterable[Assertion]) -> set[Assertion]:
        """Return the values of the deputies and those of the individuals that they stand for."""
        return {expanded for value in values for expanded in self._expanded(value)}

    def is_ambiguous(self, values: Iterable[Assertion]) -> bool:
        """Tell whether a deputy has itself as a value: for a member, that may mean itself or another member."""
        return any(value.subject == value.value and value.subject in self.members for value in values)

    def _expanded(self, value: Assertion) -> Iterator[Assertion]:
        subjects = self.members.get(value.subject, (value.subject,))
        targets = (value.value,) if value.datatype else self.members.get(value.value, (value.value,))
        pairs: Iterable[tuple[str, ...]] = product(subjects, targets)
        if subjects == targets:
            is_same = value.subject == value.value
            pairs = zip(subjects, subjects, strict=True) if is_same else permutations(subjects, 2)
        for subject, target in pairs:
            yield Assertion(subject, value.property, target, value.datatype)


class EquivalentIndividuals:
    """Groups of individuals about which an ontology says the same.

    Attributes:
        reduced: the ontology with the first one of each group only.
    """

    def __init__(self, triples: Sequence[Triple], about: Mapping[str, Sequence[Triple]] | None = None) -> None:
        """Find the groups in the triples of an ontology.

        Args:
            triples: of the ontology, or the plain statements of it.
            about: the statements about each individual that only plain statements name; None: they are looked up.
        """
        if about is None:
            about = plain_statements(triples)
        shapes: dict[tuple[tuple[str, ...], ...], list[str]] = defaultdict(list)
        for term in sorted(about):
            shape = sorted({tuple("" if part == term else part for part in triple) for triple in about[term]})
            shapes[tuple(shape)].append(term)
        self._groups = [group for group in shapes.values() if len(group) > 1]
        self._iris = [tuple(map(iri_of, group)) for group in self._groups]
        self._number = {term: number for number, group in enumerate(self._groups) for term in group}
        self._about = {term: about[term] for term in self._number}
        dropped = {term for group in self._groups for term in group[1:]}
        self.reduced = [triple for triple in triples if dropped.isdisjoint(triple)]

    def split(self, facts: Sequence[Assertion], deputies: int = 1) -> tuple[list[Assertion], Expansion]:
        """Return the facts to add to the reduced ontology, and how to expand what follows.

        An individual that a fact mentions stands for itself. What is added makes the reduced ontology the whole one
        without the individuals that are left out: it has every statement that names none of them.

        Args:
            facts: what is known now.
            deputies: number for each group. Two of them show whether a member has itself or another member as value.
        """
        mentioned = {f"<{fact.subject}>" for fact in facts} | {f"<{f.value}>" for f in facts if not f.datatype}
        there = {term for term in mentioned if term in self._number}
        touched = {self._number[term] for term in there}
        present: list[str] = []
        members: dict[str, tuple[str, ...]] = {}
        for number, (group, iris) in enumerate(zip(self._groups, self._iris, strict=True)):
            rest = [term for term in group if term not in there] if number in touched else group
            chosen = rest[:deputies]
            there.update(chosen)
            present += [term for term in (group if number in touched else chosen) if term in there and term != group[0]]
            if len(rest) > deputies:
                members |= dict.fromkeys(map(iri_of, chosen), iris if rest is group else tuple(map(iri_of, rest)))
        left_out = self._number.keys() - there if present else set()
        added = {t: None for term in present for t in self._about[term] if left_out.isdisjoint(t)}  # each one once
        return [*facts, *map(assertion_of, added)], Expansion(members)


def plain_statements(triples: Sequence[Triple]) -> dict[str, list[Triple]]:
    """Return the statements about each individual that only plain statements name, without labels and comments.

    An assertion can say each of them: its property is declared, and its individuals have a class.
    """
    types: dict[str, set[str]] = defaultdict(set)
    for subject, predicate, value in triples:
        if predicate == _TYPE:
            types[subject].add(value)
    read = {part for subject, _, value in triples if value != _ANNOTATION_PROPERTY for part in (subject, value)}
    notes = set(_NOTES) - read  # no axiom or rule is about them
    no_individuals = {predicate for _, predicate, _ in triples} | {kind for kinds in types.values() for kind in kinds}
    individuals = {
        term
        for term, kinds in types.items()
        if _is_name(term)
        and term not in no_individuals
        and all(kind == _NAMED_INDIVIDUAL or not _is_of_language(kind) for kind in kinds)
    }

    def is_plain(subject: str, predicate: str, value: str) -> bool:
        if predicate == _TYPE:
            return value == _NAMED_INDIVIDUAL or _is_name(value)
        kinds = types[predicate] & {_OBJECT_PROPERTY, _DATATYPE_PROPERTY}
        if len(kinds) != 1 or not _is_name(predicate) or _is_of_language(predicate) or subject not in individuals:
            return False
        # Text without a datatype may have a language, which an assertion can't say.
        return value in individuals if kinds == {_OBJECT_PROPERTY} else value.startswith('"') and value.endswith(">")

    about: dict[str, list[Triple]] = {term: [] for term in individuals if types[term] != {_NAMED_INDIVIDUAL}}
    for triple in triples:
        if triple[1] in notes:
            continue
        plain = is_plain(*triple)
        for term in {triple[0], triple[2]} & about.keys():
            if not plain:
                del about[term]
            elif triple[2] != _NAMED_INDIVIDUAL:
                about[term].append(triple)
    return about


def _is_name(term: str) -> bool:
    """Tell whether a term is an IRI, and one that stands for itself: without escaped characters."""
    return term.startswith("<") and "\\" not in term


def _is_of_language(term: str) -> bool:
    return iri_of(term).startswith(_LANGUAGE)


def assertion_of(triple: Triple) -> Assertion:
    """Return a plain statement as an assertion."""
    subject, predicate, value = triple
    literal = literal_of(value)
    if literal is None:
        return Assertion(iri_of(subject), iri_of(predicate), iri_of(value))
    return Assertion(iri_of(subject), iri_of(predicate), *literal)
