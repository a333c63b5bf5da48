"""An ontology as clauses: its rules, and its axioms as rules.

A clause says: where all of its body holds, all of its head does. Its variables are numbers, everything else in it is a
constant. What can't be said so is refused: class expressions, keys, cardinalities, and individuals that are concluded
to be the same.
"""

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from itertools import permutations
from typing import Any, NamedTuple

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.knowledge.rules import Atom, Rule, rules_of
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, literal_of, local_name

DIFFERENT, SAME = v.OWL + "differentFrom", v.OWL + "sameAs"
_XSD_NUMBERS = tuple(v.XSD + name for name in ("float", "double"))
_XSD_DECIMALS = tuple(
    v.XSD + name
    for name in (
        *("decimal", "integer", "int", "long", "short", "byte", "nonNegativeInteger", "positiveInteger"),
        *("negativeInteger", "nonPositiveInteger", "unsignedInt", "unsignedLong", "unsignedShort", "unsignedByte"),
    )
)
_KINDS = {v.XSD + "string": "string", v.XSD + "boolean": "boolean"}
_KINDS |= dict.fromkeys(_XSD_DECIMALS, "decimal") | dict.fromkeys(_XSD_NUMBERS, "float")
# What an ontology may say in the terms of OWL.
_PREDICATES = {
    *(v.RDF_TYPE, v.RDF_FIRST, v.RDF_REST, v.RDFS_LABEL, v.RDFS_COMMENT, v.RDFS_DOMAIN, v.RDFS_RANGE),
    *(v.RDFS_SUB_PROPERTY_OF, v.OWL_EQUIVALENT_PROPERTY, v.OWL_INVERSE_OF, v.RDFS + "subClassOf", DIFFERENT),
    *(v.RDFS + name for name in ("seeAlso", "isDefinedBy")),
    *(v.OWL + name for name in ("equivalentClass", "disjointWith", "members", "distinctMembers", "oneOf")),
    *(v.OWL + name for name in ("versionIRI", "versionInfo", "imports", "deprecated")),
}
_CLASSES = {
    *(v.RDF + name for name in ("List", "Property")),
    *(v.RDFS + name for name in ("Datatype", "Class")),
    *(v.OWL + name for name in ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty", "Ontology")),
    *(v.OWL + name for name in ("FunctionalProperty", "SymmetricProperty", "TransitiveProperty", "Thing")),
    *(v.OWL + name for name in ("NamedIndividual", "AllDisjointClasses", "AllDifferent")),
}
_NAMED_ONLY = (v.RDFS + "subClassOf", v.OWL + "equivalentClass", v.OWL + "disjointWith", v.RDFS_DOMAIN)


# By the predicate between two names: what holds of the first or the second one, and what follows.
_AXIOMS: dict[str, tuple[tuple[tuple[Any, ...], tuple[Any, ...]], ...]] = {
    v.RDFS + "subClassOf": ((("some", 0, None), ("other", 0, None)),),
    v.OWL + "equivalentClass": ((("some", 0, None), ("other", 0, None)), (("other", 0, None), ("some", 0, None))),
    v.RDFS_SUB_PROPERTY_OF: ((("some", 0, 1), ("other", 0, 1)),),
    v.OWL_EQUIVALENT_PROPERTY: ((("some", 0, 1), ("other", 0, 1)), (("other", 0, 1), ("some", 0, 1))),
    v.OWL_INVERSE_OF: ((("some", 0, 1), ("other", 1, 0)), (("other", 0, 1), ("some", 1, 0))),
    v.RDFS_DOMAIN: ((("some", 0, 1), ("other", 0, None)),),
    v.RDFS_RANGE: ((("some", 0, 1), ("other", 1, None)),),
}


class Value(NamedTuple):
    """A literal by its kind (string, boolean, decimal, float or a datatype's IRI) and its value."""

    kind: str
    value: str | bool | Decimal | float


Term = int | str | Value | None
"""In a clause: the number of a variable, the IRI of an individual, a literal; None in the place of a class's value."""


class Fact(NamedTuple):
    """A statement, or the pattern of one. An individual of a class has the value None."""

    predicate: str
    subject: Term
    value: Term


class Condition(NamedTuple):
    """A built-in of SWRL, or that two terms are the same. `result` is True where the first argument is computed."""

    function: Callable[..., object]
    arguments: tuple[Term, ...]
    result: bool


@dataclass(frozen=True)
class Clause:
    """A rule, or an axiom as one; its name is for messages."""

    patterns: tuple[Fact, ...]
    conditions: tuple[Condition, ...]
    head: tuple[Fact, ...]
    variables: int
    name: str = ""


@dataclass(frozen=True)
class Program:
    """An ontology as clauses, and what would contradict it.

    Attributes:
        clauses: rules, and axioms as rules.
        facts: what the ontology says of individuals.
        functional: properties that have one value at most.
        disjoint: by class, those that no individual of it belongs to.
        kinds: by property, the kind of its values.
        choices: by property, the values that it may have.
    """

    clauses: tuple[Clause, ...]
    facts: tuple[Fact, ...]
    functional: frozenset[str]
    disjoint: Mapping[str, frozenset[str]]
    kinds: Mapping[str, str] = field(default_factory=dict)
    choices: Mapping[str, frozenset[Value]] = field(default_factory=dict)


def compiled(triples: Sequence[Triple]) -> Program:
    """Return an ontology as clauses.

    Raises:
        ReasonerError: it says something that clauses can't; one line that names it.
    """
    graph = Graph(triples)
    lists = _Lists(graph)
    _check(triples, lists)
    object_properties = graph.instances(v.OWL_OBJECT_PROPERTY)
    kinds, choices = {}, {}
    for name, target in graph.pairs(v.RDFS_RANGE):
        if target in _KINDS:
            kinds[name] = _KINDS[target]
        elif name not in object_properties and lists.of(target, v.OWL + "oneOf"):
            choices[name] = frozenset(lists.literals_of(target, v.OWL + "oneOf"))
    disjoint: dict[str, set[str]] = defaultdict(set)
    pairs = graph.pairs(v.OWL + "disjointWith")
    for node in graph.instances(v.OWL + "AllDisjointClasses"):
        pairs += permutations(lists.of(node, v.OWL + "members"), 2)
    for some, other in pairs:
        disjoint[some].add(other)
        disjoint[other].add(some)
    return Program(
        clauses=(*_axioms(graph, object_properties), *map(_clause, rules_of(graph))),
        facts=tuple(_facts(triples, graph, lists)),
        functional=frozenset(graph.instances(v.OWL_FUNCTIONAL_PROPERTY)),
        disjoint={name: frozenset(others) for name, others in disjoint.items()},
        kinds=kinds,
        choices=choices,
    )


def value_of(text: str, datatype: str) -> Value:
    """Return a literal as what it denotes."""
    kind = _KINDS.get(datatype, "string" if not datatype or datatype.endswith("PlainLiteral") else datatype)
    try:
        if kind == "decimal":
            return Value(kind, Decimal(text))
        if kind == "float":
            return Value(kind, float(text))
    except (InvalidOperation, ValueError):
        return Value(datatype, text)
    return Value(kind, text in ("true", "1") if kind == "boolean" else text)


class _Lists:
    """The members of RDF lists."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def of(self, node: str, predicate: str) -> list[str]:
        """Return the cells' individuals of the lists that a node has; the cells themselves where they hold literals."""
        return [next(iter(self._graph.objects_of(cell, v.RDF_FIRST)), cell) for cell in self._cells(node, predicate)]

    def literals_of(self, node: str, predicate: str) -> Iterator[Value]:
        """Yield the literals of the lists that a node has."""
        for cell in self._cells(node, predicate):
            for text, datatype in self._graph.typed_literals_of(cell, v.RDF_FIRST):
                yield value_of(text, datatype)

    def _cells(self, node: str, predicate: str) -> Iterator[str]:
        nil = v.RDF + "nil"
        cells = [cell for cell in self._graph.objects_of(node, predicate) if cell != nil]
        seen: set[str] = set()
        while cells:
            cell = cells.pop()
            if cell not in seen:
                seen.add(cell)
                yield cell
                cells += [rest for rest in self._graph.objects_of(cell, v.RDF_REST) if rest != nil]


def _check(triples: Iterable[Triple], lists: _Lists) -> None:
    """Raise for what clauses can't say."""
    for subject, predicate, value in triples:
        name, kind = iri_of(predicate), iri_of(value)
        if name.startswith((v.OWL, v.RDFS, v.RDF)) and name not in _PREDICATES:
            _refuse(name, subject)
        if name == v.RDF_TYPE and (
            value.startswith("_:") or (kind.startswith((v.OWL, v.RDFS, v.RDF)) and kind not in _CLASSES)
        ):
            _refuse("a class without a name" if value.startswith("_:") else kind, subject)
        if name in _NAMED_ONLY and (value.startswith("_:") or subject.startswith("_:")):
            _refuse("a class without a name", subject)
        if name == v.OWL_INVERSE_OF and subject.startswith("_:"):
            _refuse("a property without a name", subject)
        if name == v.OWL + "oneOf" and not list(lists.literals_of(iri_of(subject), name)):
            _refuse("a class by its members", subject)


def _refuse(what: str, subject: str) -> None:
    raise ReasonerError(
        f"the rule engine does not know {local_name(what)} (of {local_name(iri_of(subject))}): set ~reasoner to pellet"
    )


def _facts(triples: Iterable[Triple], graph: Graph, lists: _Lists) -> Iterator[Fact]:
    declared = graph.instances(v.OWL_OBJECT_PROPERTY) | graph.instances(v.OWL_DATATYPE_PROPERTY)
    for subject, predicate, value in triples:
        name, owner = iri_of(predicate), iri_of(subject)
        if name == v.RDF_TYPE and not iri_of(value).startswith((v.OWL, v.RDFS, v.RDF, v.SWRL)):
            yield Fact(iri_of(value), owner, None)
        elif name in declared:
            literal = literal_of(value)
            yield Fact(name, owner, value_of(*literal) if literal else iri_of(value))
        elif name == DIFFERENT:
            yield from (Fact(DIFFERENT, owner, iri_of(value)), Fact(DIFFERENT, iri_of(value), owner))
    for node in graph.instances(v.OWL + "AllDifferent"):
        members = [m for name in ("members", "distinctMembers") for m in lists.of(node, v.OWL + name)]
        yield from (Fact(DIFFERENT, some, other) for some, other in permutations(members, 2))


def _axioms(graph: Graph, object_properties: set[str]) -> Iterator[Clause]:
    """Yield what axioms say, as rules of one head."""
    for name, forms in _AXIOMS.items():
        for some, other in graph.pairs(name):
            if other == v.OWL + "Thing" or (name == v.RDFS_RANGE and some not in object_properties):
                continue
            for (body, *terms), (head, *concluded) in forms:
                names = {"some": some, "other": other}
                axiom = f"{local_name(name)} of {local_name(some)}"
                yield Clause((Fact(names[body], *terms),), (), (Fact(names[head], *concluded),), 2, axiom)
    for name in graph.instances(v.OWL + "SymmetricProperty"):
        yield Clause((Fact(name, 0, 1),), (), (Fact(name, 1, 0),), 2, f"SymmetricProperty {local_name(name)}")
    for name in graph.instances(v.OWL + "TransitiveProperty"):
        body = (Fact(name, 0, 1), Fact(name, 1, 2))
        yield Clause(body, (), (Fact(name, 0, 2),), 3, f"TransitiveProperty {local_name(name)}")


def _clause(rule: Rule) -> Clause:
    numbers: dict[str, int] = {}

    def term(text: str, datatype: str) -> Term:
        if text[:1] == "?":
            return numbers.setdefault(text, len(numbers))
        return value_of(text[1:-1], datatype) if text[:1] == '"' else text

    def terms(atom: Atom) -> tuple[Term, ...]:
        return tuple(map(term, atom.arguments, atom.datatypes))

    patterns, conditions = [], []
    for atom in rule.body:
        if atom.predicate in _BUILT_INS:
            function, result = _BUILT_INS[atom.predicate]
            conditions.append(Condition(function, terms(atom), result))
        elif atom.predicate == "sameAs":
            conditions.append(Condition(operator.eq, terms(atom), result=False))
        elif atom.predicate == v.OWL + "Thing":
            continue
        else:
            patterns.append(_pattern(atom, terms(atom), rule))
    if any(atom.predicate == "sameAs" for atom in rule.head):
        _refuse("sameAs, which a rule concludes", rule.label or rule.node)
    head = tuple(_pattern(atom, terms(atom), rule) for atom in rule.head)
    bound = {t for fact in patterns for t in fact} | {c.arguments[0] for c in conditions if c.result}
    if any(type(t) is int and t not in bound for fact in head for t in fact):
        _refuse("a variable that is in no atom of the body", rule.label or rule.node)
    return Clause(
        tuple(patterns), tuple(conditions), head, len(numbers), f"rule {rule.label}" if rule.label else str(rule)
    )


def _pattern(atom: Atom, terms: tuple[Term, ...], rule: Rule) -> Fact:
    if atom.predicate == "differentFrom":
        return Fact(DIFFERENT, *terms)
    if "#" not in atom.predicate and "/" not in atom.predicate:
        _refuse(f"an atom of kind {atom.predicate}", rule.label or rule.node)
    if atom.predicate.startswith(v.SWRLB) or not 1 <= len(terms) <= 2:
        _refuse(atom.predicate, rule.label or rule.node)
    return Fact(atom.predicate, terms[0], terms[1] if len(terms) == 2 else None)


def _compared(compare: Callable[[Any, Any], bool]) -> Callable[..., bool]:
    def holds(some: Term, other: Term) -> bool:
        first, second = _operand(some), _operand(other)
        return type(first) is type(second) and compare(first, second)

    return holds


def _operand(term: Term) -> object:
    """Return what a literal is compared by: numbers of all kinds with each other."""
    if not isinstance(term, Value):
        return term
    return Decimal(term.value) if isinstance(term.value, float) else term.value


def _computed(function: Callable[..., Decimal]) -> Callable[..., Value | None]:
    def compute(*terms: Term) -> Value | None:
        numbers = [_operand(term) for term in terms]
        if not all(isinstance(number, Decimal) for number in numbers):
            return None
        try:
            return Value("decimal", function(*numbers))
        except (ArithmeticError, TypeError):
            return None

    return compute


def _sum(*numbers: Decimal) -> Decimal:
    return sum(numbers, Decimal(0))


def _product(*numbers: Decimal) -> Decimal:
    result = Decimal(1)
    for number in numbers:
        result *= number
    return result


_BUILT_INS: dict[str, tuple[Callable[..., object], bool]] = {
    v.SWRLB + name: (_compared(compare), False)
    for name, compare in (
        ("equal", operator.eq),
        ("notEqual", operator.ne),
        ("lessThan", operator.lt),
        ("lessThanOrEqual", operator.le),
        ("greaterThan", operator.gt),
        ("greaterThanOrEqual", operator.ge),
    )
}
_BUILT_INS |= {
    v.SWRLB + name: (_computed(function), True)
    for name, function in (
        ("add", _sum),
        ("subtract", operator.sub),
        ("multiply", _product),
        ("divide", operator.truediv),
        ("abs", abs),
    )
}
