"""Slices of an ontology: the statements about individuals that what is known now can have to do with.

Everything that facts add to the conclusions comes from a rule, or an axiom that is one, of which they fulfil a part.
What fulfils the rest is in the slice. So slice and facts imply whatever facts add, and the ontology alone implies
everything else: its conclusions need to be looked up only once. Nothing is implied by a slice that the whole ontology
does not imply.

A slice is found by applying the rules forward, without what they compare and compute: where a rule could conclude
something for some number, it counts as if it did. So a slice may be larger than needed, but not smaller, and the same
one holds for all numbers that rules only compare. Who draws the conclusions from it is Pellet.

That holds of ontologies that are no more than rules, as `forward.program` reads them. Of others there are no slices.
Nor are there where two individuals may turn out to be the same, and where rules ask which individuals differ.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from mros1_reasoner.forward.engine import Closure, Plans, Step, fact_of, instances, plans_of
from mros1_reasoner.forward.program import DIFFERENT, Clause, Fact, Program, Term, Value, compiled
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion, ReasonerError
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, local_name
from mros1_reasoner.pellet.equivalence import EquivalentIndividuals, assertion_of, plain_statements

MOST_STEPS = 300_000
"""Steps of matching rules, after which Pellet gets the whole ontology instead. 1,000 unlike designs need 9,000."""
_KEPT = 16  # slices of the latest facts
_LANGUAGE = (v.OWL, v.RDF, v.RDFS, v.XSD, v.SWRL)
_NUMBERS = ("decimal", "float")
_ANY = "any number"  # kind of values

_About = Mapping[str, Sequence[Triple]]


class SliceError(Exception):
    """Slices of the ontology may lack something."""


@dataclass(frozen=True)
class Slice:
    """What facts can have to do with.

    Attributes:
        individuals: those in the slice, in groups of equivalent ones.
        statements: about the first one of each group.
    """

    individuals: EquivalentIndividuals
    statements: tuple[Assertion, ...]


class Slices:
    """The slices of an ontology.

    Attributes:
        properties: all that are declared.
        common: what belongs to every slice: all but plain statements about individuals.
    """

    def __init__(self, triples: Sequence[Triple]) -> None:
        """Read an ontology.

        Raises:
            SliceError: its slices may lack something; one line that says why.
        """
        graph = Graph(triples)
        self.properties = sorted(graph.instances(v.OWL_OBJECT_PROPERTY) | graph.instances(v.OWL_DATATYPE_PROPERTY))
        try:
            program = compiled(triples)
            for clause in program.clauses:
                _check(clause, self.properties)
            self._base = _Traced(program, dict.fromkeys(program.facts, ()))
        except ReasonerError as error:
            raise SliceError(str(error)) from error
        self._program = replace(program, clauses=tuple(replace(clause, conditions=()) for clause in program.clauses))
        self._plans = plans_of(self._program.clauses)
        self._compared = _only_compared(self._program)
        self._about = plain_statements(triples)
        self.common = [triple for triple in triples if self._about.keys().isdisjoint((triple[0], triple[2]))]
        self._stated: dict[Fact, list[Triple]] = defaultdict(list)
        self._types: dict[str, list[Triple]] = defaultdict(list)
        for triple in dict.fromkeys(triple for statements in self._about.values() for triple in statements):
            self._stated[fact_of(assertion_of(triple))].append(triple)
            if iri_of(triple[1]) == v.RDF_TYPE:
                self._types[triple[0]].append(triple)
        self._latest: dict[tuple[Fact, ...], Slice | None] = {}

    def implies(self, values: Iterable[Assertion]) -> bool:
        """Return whether the rules, as they are read here, imply these values of all properties, and no others."""
        found = {fact_of(value) for value in values}
        return found == {fact for name in self.properties for fact in self._base.with_predicate(name)}

    def of(self, facts: Sequence[Assertion]) -> Slice | None:
        """Return the slice for facts; None: it could lack something."""
        known = tuple(self._open(i, fact_of(fact)) for i, fact in enumerate(facts))
        if known in self._latest:
            found = self._latest.pop(known)
        else:
            try:
                found = self._slice(known)
            except (SliceError, ReasonerError):
                found = None
        self._latest[known] = found  # at the end: the first is the one that was not asked for the longest
        if len(self._latest) > _KEPT:
            del self._latest[next(iter(self._latest))]
        return found

    def _open(self, number: int, fact: Fact) -> Fact:
        """Return a fact with a value that is like no other one in place of a number that rules only compare."""
        value = fact.value
        if isinstance(value, Value) and value.kind in _NUMBERS and fact.predicate in self._compared:
            return fact._replace(value=Value(_ANY, str(number)))
        return fact

    def _slice(self, known: Sequence[Fact]) -> Slice:
        reached = _Reached(self._program, self._plans, self._base)
        reached.add(known)
        chosen = dict.fromkeys(t for fact in self._base.causes(reached.used) for t in self._stated.get(fact, ()))
        terms = {term: None for triple in chosen for term in (triple[0], triple[2])}
        terms |= {f"<{term}>": None for fact in known for term in (fact.subject, fact.value) if isinstance(term, str)}
        chosen |= {triple: None for term in terms for triple in self._types.get(term, ())}
        about: dict[str, list[Triple]] = defaultdict(list)
        for triple in chosen:
            for term in {triple[0], triple[2]} & self._about.keys():
                about[term].append(triple)
        individuals = EquivalentIndividuals(list(chosen), about)
        return Slice(individuals, tuple(map(assertion_of, individuals.reduced)))


class _Steps(Closure):
    """A closure that takes so many steps at most."""

    _steps = 0

    def _apply(self, clause: Clause, steps: tuple[Step, ...], at: int, bound: list[Term], known: list[bool]) -> None:
        self._steps += 1
        if self._steps > MOST_STEPS:
            raise SliceError("the rules join too much")
        super()._apply(clause, steps, at, bound, known)


class _Traced(_Steps):
    """What follows from the ontology alone, and from what."""

    def __init__(self, program: Program, stated: dict[Fact, tuple[Fact, ...]]) -> None:
        super().__init__(program, plans_of(program.clauses))
        self._from = stated
        self.add(program.facts)

    def causes(self, facts: Iterable[Fact]) -> Iterator[Fact]:
        """Yield statements from which facts follow."""
        waiting, seen = list(facts), set(facts)
        while waiting:
            fact = waiting.pop()
            causes = self._from[fact]
            if not causes:
                yield fact
            new = [cause for cause in causes if cause not in seen]
            seen.update(new)
            waiting += new

    def _conclusions(self, clause: Clause, bound: Sequence[Term]) -> list[Fact]:
        found = super()._conclusions(clause, bound)
        for fact in found:
            if fact not in self._from:
                self._from[fact] = tuple(instances(clause.patterns, bound))
        return found


class _Reached(_Steps):
    """What could follow from facts, and from which facts of the ontology alone.

    Attributes:
        used: facts of the ontology alone that others could join, or contradict.
    """

    def __init__(self, program: Program, plans: Plans, below: Closure) -> None:
        super().__init__(program, plans, below)
        self._below = below
        self.used: dict[Fact, None] = {}

    def _conclusions(self, clause: Clause, bound: Sequence[Term]) -> list[Fact]:
        found = [fact for fact in super()._conclusions(clause, bound) if not self._below._holds(fact)]
        if found:
            self.used |= {fact: None for fact in instances(clause.patterns, bound) if self._below._holds(fact)}
        return found

    def _check(self, fact: Fact) -> None:
        """Note what could contradict a fact; the classes of individuals are in each slice anyway."""
        if fact.value is None or fact.predicate not in self._program.functional:
            return
        for layer in self._layers:
            for other in layer.values.get(fact.predicate, {}).get(fact.subject, ()):
                if not isinstance(fact.value, Value):
                    raise SliceError(f"two individuals may be the same, by {fact.predicate} of {fact.subject}")
                if layer is self._below:
                    self.used[fact._replace(value=other)] = None


def _check(clause: Clause, properties: Collection[str]) -> None:
    """Refuse clauses that may conclude something though no fact fulfils a part of them."""
    bound = {term for fact in clause.patterns for term in fact}
    if not clause.patterns or any(type(t) is int and t not in bound for fact in clause.head for t in fact):
        raise SliceError("a rule concludes what no statement says")
    for fact in (*clause.patterns, *clause.head):
        is_declared = fact.value is None or fact.predicate in properties
        if not is_declared or fact.predicate == DIFFERENT or fact.predicate.startswith(_LANGUAGE):
            raise SliceError(f"a rule is about {local_name(fact.predicate)}")


def _only_compared(program: Program) -> frozenset[str]:
    """Return the properties of whose values no clause without conditions depends, nor concludes anything."""
    used: set[str] = set()
    values: set[str] = set()
    for clause in program.clauses:
        terms = Counter(term for fact in (*clause.patterns, *clause.head) for term in (fact.subject, fact.value))
        for fact in clause.patterns:
            values.add(fact.predicate)
            if type(fact.value) is not int or terms[fact.value] > 1:
                used.add(fact.predicate)
    return frozenset(values - used)
