"""A Reasoner that applies rules forward until nothing new follows, without Java.

The ontology is closed once, when it is loaded. An analysis adds its facts to a layer above, and applies each rule only
to what is new there (semi-naive evaluation: Ullman, Principles of Database and Knowledge-Base Systems, 1988).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from typing import Any

from mros1_reasoner.forward.program import DIFFERENT, Clause, Condition, Fact, Program, Term, Value, compiled, value_of
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, ReasonerError
from mros1_reasoner.knowledge.triples import TripleError, decimal_text, local_name, parse_ntriples

Step = Fact | Condition
Plans = dict[str, list[tuple[Fact, Clause, tuple[Step, ...]]]]
"""By predicate the patterns that a fact may match; of each its clause, and what else must hold, in order."""

_NOTHING: dict[Term, None] = {}
_MOST = 1_000_000
"""Facts of one closure: a model of 1,000 designs has 30,000. Rules that compute new values may never come to an end."""


class RuleEngine:
    """A Reasoner by forward chaining. It refuses ontologies that say more than rules can."""

    def __init__(self) -> None:
        self._program: Program | None = None

    def load(self, ontology: str) -> None:
        """See Reasoner.load."""
        self._program = None
        try:
            program = compiled(list(parse_ntriples(ontology)))
        except TripleError as error:
            raise ReasonerError(f"the ontology is no N-Triples: {error}") from error
        self._plans = plans_of(program.clauses)
        self._base = Closure(program, self._plans)
        self._base.add(program.facts)
        self._program = program

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """See Reasoner.infer."""
        if self._program is None:
            raise ReasonerError("no ontology is loaded")
        closure = Closure(self._program, self._plans, below=self._base)
        closure.add(map(fact_of, facts))
        return sorted(_assertion(fact) for name in properties for fact in closure.with_predicate(name))

    def close(self) -> None:
        """See Reasoner.close."""


def plans_of(clauses: Iterable[Clause]) -> Plans:
    """Return in which order to apply clauses."""
    plans: Plans = defaultdict(list)
    for clause in clauses:
        for i, pattern in enumerate(clause.patterns):
            plans[pattern.predicate].append((pattern, clause, _ordered(clause, i)))
    return plans


def fact_of(assertion: Assertion) -> Fact:
    """Return an assertion as a fact."""
    if assertion.property == v.RDF_TYPE:
        return Fact(assertion.value, assertion.subject, None)
    value = value_of(assertion.value, assertion.datatype) if assertion.datatype else assertion.value
    return Fact(assertion.property, assertion.subject, value)


class Closure:
    """Facts with all that follows from them, perhaps in a layer above another closure."""

    def __init__(self, program: Program, plans: Plans, below: Closure | None = None) -> None:
        self._program, self._plans = program, plans
        self._layers = [self] if below is None else [below, self]
        self.values: dict[str, dict[Term, dict[Term, None]]] = defaultdict(dict)  # by predicate and subject
        self.subjects: dict[str, dict[Term, dict[Term, None]]] = defaultdict(dict)  # by predicate and value
        self._new: list[Fact] = []
        self._count = 0

    def add(self, facts: Iterable[Fact]) -> None:
        """Add facts, and what follows.

        Raises:
            InconsistentError: they contradict each other or the ontology.
            ReasonerError: too much follows.
        """
        self._new.extend(facts)
        while self._new:
            fact = self._new.pop()
            if self._holds(fact):
                continue
            self._check(fact)
            self._count += 1
            self.values[fact.predicate].setdefault(fact.subject, {})[fact.value] = None
            self.subjects[fact.predicate].setdefault(fact.value, {})[fact.subject] = None
            for pattern, clause, steps in self._plans.get(fact.predicate, ()):
                bound: list[Term] = [None] * clause.variables
                known = [False] * clause.variables
                if _unified(pattern.subject, fact.subject, bound, known) and _unified(
                    pattern.value, fact.value, bound, known
                ):
                    self._apply(clause, steps, 0, bound, known)

    def with_predicate(self, predicate: str) -> Iterator[Fact]:
        """Yield the facts with a predicate."""
        for layer in self._layers:
            for subject, values in layer.values.get(predicate, {}).items():
                yield from (Fact(predicate, subject, value) for value in values)

    def _holds(self, fact: Fact) -> bool:
        predicate, subject, value = fact
        for layer in self._layers:  # a loop, which is faster than `any`
            found = layer.values.get(predicate)
            if found is not None and value in found.get(subject, _NOTHING):
                return True
        return False

    def _conclusions(self, clause: Clause, bound: Sequence[Term]) -> list[Fact]:
        """Return what a clause concludes, by the values of its variables."""
        return instances(clause.head, bound)

    def _apply(self, clause: Clause, steps: tuple[Step, ...], at: int, bound: list[Term], known: list[bool]) -> None:
        """Conclude from each way in which the remaining steps hold."""
        if at == len(steps):
            self._new.extend(self._conclusions(clause, bound))
            if self._count + len(self._new) > _MOST:
                rule = self._most_frequent(clause)
                raise ReasonerError(
                    f"more than {_MOST} facts follow, most of them by {rule}: correct it, or give it a condition with "
                    "which it comes to an end"
                )
            return
        step = steps[at]
        if isinstance(step, Condition):
            self._apply_condition(clause, steps, at, bound, known)
            return
        subject, value = step.subject, step.value
        if type(subject) is int and not known[subject]:
            if type(value) is int and not known[value]:
                pairs: Iterable[tuple[Term, Term]] = [(f.subject, f.value) for f in self.with_predicate(step.predicate)]
            else:
                target = _term(value, bound)
                pairs = [
                    (found, target)
                    for layer in self._layers
                    for found in layer.subjects.get(step.predicate, {}).get(target, _NOTHING)
                ]
        else:
            owner = _term(subject, bound)
            pairs = [
                (owner, found)
                for layer in self._layers
                for found in layer.values.get(step.predicate, {}).get(owner, _NOTHING)
            ]
        for some, other in pairs:
            before = known[:]
            if _unified(subject, some, bound, known) and _unified(value, other, bound, known):
                self._apply(clause, steps, at + 1, bound, known)
            known[:] = before

    def _most_frequent(self, last: Clause) -> str:
        """Return the names of the rules that conclude most of the facts; `last` is the one that concluded last."""
        counts = {name: sum(map(len, subjects.values())) for name, subjects in self.values.items()}
        name = max(counts, key=lambda name: counts[name])
        clauses = (clause for plans in self._plans.values() for _, clause, _ in plans)
        found = dict.fromkeys(c.name for c in clauses if any(fact.predicate == name for fact in c.head))
        return " or ".join(found) if found and 2 * counts[name] > _MOST else last.name

    def _apply_condition(
        self, clause: Clause, steps: tuple[Step, ...], at: int, bound: list[Term], known: list[bool]
    ) -> None:
        condition = steps[at]
        assert isinstance(condition, Condition)  # noqa: S101 - for the type checker
        first, *others = condition.arguments
        rest = [_term(term, bound) for term in others]
        if not condition.result:
            if condition.function(_term(first, bound), *rest):
                self._apply(clause, steps, at + 1, bound, known)
            return
        result = condition.function(*rest)
        before = known[:]
        if isinstance(result, Value) and _unified(first, result, bound, known):
            self._apply(clause, steps, at + 1, bound, known)
        known[:] = before

    def _check(self, fact: Fact) -> None:
        """Raise where a fact contradicts what is known."""
        predicate, subject, value = fact
        if value is None:
            for other in self._program.disjoint.get(predicate, ()):
                if self._holds(Fact(other, subject, None)):
                    names = " and ".join(sorted((local_name(predicate), local_name(other))))
                    raise InconsistentError(f"the ontology contradicts itself: {subject} can't be both {names}")
            return
        if isinstance(value, Value):
            kind, choices = self._program.kinds.get(predicate), self._program.choices.get(predicate)
            if (kind is not None and value.kind != kind) or (choices is not None and value not in choices):
                raise InconsistentError(f"the ontology contradicts itself: {value.value} is no value of {predicate}")
        if predicate == DIFFERENT and subject == value:
            raise InconsistentError(f"the ontology contradicts itself: {subject} differs from itself")
        if predicate in self._program.functional:
            for layer in self._layers:
                for known in layer.values.get(predicate, {}).get(subject, _NOTHING):
                    self._check_functional(fact, known)

    def _check_functional(self, fact: Fact, other: Term) -> None:
        predicate, subject, value = fact
        if isinstance(value, Value) or self._holds(Fact(DIFFERENT, value, other)):
            raise InconsistentError(
                f"the ontology contradicts itself: {subject} has more than one value for the functional property "
                f"{predicate}"
            )
        raise ReasonerError(
            f"{subject} has two values of the functional property {predicate}, which may be the same: that is beyond "
            "the rule engine: set ~reasoner to pellet"
        )


def instances(patterns: Iterable[Fact], bound: Sequence[Term]) -> list[Fact]:
    """Return patterns with the values of their variables."""
    return [Fact(predicate, _term(subject, bound), _term(value, bound)) for predicate, subject, value in patterns]


def _ordered(clause: Clause, first: int) -> tuple[Step, ...]:
    """Return the patterns of a clause but one, and its conditions, each as soon as its terms are known."""
    known = {term for term in clause.patterns[first] if type(term) is int}
    patterns = [*clause.patterns[:first], *clause.patterns[first + 1 :]]
    conditions = list(clause.conditions)
    steps: list[Step] = []
    while patterns or conditions:
        ready = next((c for c in conditions if _needed(c) <= known), None)
        if ready is not None:
            conditions.remove(ready)
            steps.append(ready)
            known |= {term for term in ready.arguments if type(term) is int}
            continue
        if not patterns:
            raise ReasonerError("a rule has a built-in whose arguments are in no other atom: set ~reasoner to pellet")
        best = max(patterns, key=lambda p: sum(type(term) is not int or term in known for term in (p.subject, p.value)))
        patterns.remove(best)
        steps.append(best)
        known |= {term for term in best if type(term) is int}
    return tuple(steps)


def _needed(condition: Condition) -> set[Term]:
    return {term for term in condition.arguments[condition.result :] if type(term) is int}


def _unified(term: Term, found: Term, bound: list[Term], known: list[bool]) -> bool:
    """Bind a variable to what was found, or return whether it is that."""
    if type(term) is not int:
        return term == found
    if known[term]:
        return bound[term] == found
    bound[term], known[term] = found, True
    return True


def _term(term: Term, bound: Sequence[Term]) -> Term:
    return bound[term] if type(term) is int else term


def _assertion(fact: Fact) -> Assertion:
    value: Any = fact.value
    subject = str(fact.subject)
    if not isinstance(value, Value):
        return Assertion(subject, fact.predicate, str(value))
    if isinstance(value.value, bool):
        return Assertion(subject, fact.predicate, str(value.value).lower(), v.XSD + "boolean")
    if isinstance(value.value, Decimal):
        return Assertion(subject, fact.predicate, decimal_text(float(value.value)), v.XSD + "decimal")
    if isinstance(value.value, float):
        return Assertion(subject, fact.predicate, repr(value.value), v.XSD + "float")
    return Assertion(subject, fact.predicate, value.value, v.XSD + "string" if value.kind == "string" else value.kind)
