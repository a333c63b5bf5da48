"""SWRL rules, read from triples: what they conclude from what."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, local_name

_IMP, _VARIABLE = v.SWRL + "Imp", v.SWRL + "Variable"
_BODY, _HEAD, _ARGUMENTS = v.SWRL + "body", v.SWRL + "head", v.SWRL + "arguments"
_PREDICATES = tuple(v.SWRL + name for name in ("propertyPredicate", "classPredicate", "builtin"))
_KINDS = {v.SWRL + "DifferentIndividualsAtom": "differentFrom", v.SWRL + "SameIndividualAtom": "sameAs"}


@dataclass(frozen=True)
class Atom:
    """What holds, or is to be concluded.

    Attributes:
        predicate: IRI of a property, a class or a built-in.
        arguments: `?name` for a variable, an IRI for an individual, `"text"` for a literal.
        datatypes: of each argument; empty for those that are no literal with a datatype.
    """

    predicate: str
    arguments: tuple[str, ...]
    datatypes: tuple[str, ...] = field(default=(), compare=False)

    def __str__(self) -> str:
        names = (text if text[:1] in ("?", '"') else local_name(text) for text in self.arguments)
        return f"{local_name(self.predicate)}({', '.join(names)})"


@dataclass(frozen=True)
class Rule:
    """A rule: where all of the body holds, all of the head does.

    Attributes:
        node: IRI or blank node of the rule.
        label: its name; empty without one.
        comment: what it says in words; empty without one.
    """

    node: str
    label: str
    comment: str
    body: tuple[Atom, ...]
    head: tuple[Atom, ...]

    def __str__(self) -> str:
        return f"{', '.join(map(str, self.body))} -> {', '.join(map(str, self.head))}"


def rules_of(graph: Graph) -> list[Rule]:
    """Return the rules, in the order of their labels."""
    variables = graph.instances(_VARIABLE)
    found = [
        Rule(
            node,
            _text(graph, node, v.RDFS_LABEL),
            _text(graph, node, v.RDFS_COMMENT),
            tuple(_atoms(graph, node, _BODY, variables)),
            tuple(_atoms(graph, node, _HEAD, variables)),
        )
        for node in graph.instances(_IMP)
    ]
    return sorted(found, key=lambda rule: (rule.label, str(rule)))


def rule_nodes(triples: Iterable[Triple], rules: Collection[str]) -> set[str]:
    """Return the terms of rules with those of their lists and atoms, which belong to nothing else."""
    by_subject: dict[str, list[Triple]] = defaultdict(list)
    for triple in triples:
        by_subject[triple[0]].append(triple)
    nodes, waiting = set(rules), list(rules)
    while waiting:
        for _, _, value in by_subject.get(waiting.pop(), ()):
            if value in by_subject and value not in nodes and _is_part(by_subject[value]):
                nodes.add(value)
                waiting.append(value)
    return nodes


def _is_part(statements: Sequence[Triple]) -> bool:
    predicates = {iri_of(predicate) for _, predicate, _ in statements}
    return v.RDF_FIRST in predicates or any(predicate.startswith(v.SWRL) for predicate in predicates)


def _atoms(graph: Graph, rule: str, side: str, variables: set[str]) -> Iterator[Atom]:
    for start in sorted(graph.objects_of(rule, side)):
        for cell in _cells(graph, start):
            for node in graph.objects_of(cell, v.RDF_FIRST):
                arguments = list(_arguments(graph, node, variables))
                yield Atom(_predicate(graph, node), tuple(a for a, _ in arguments), tuple(d for _, d in arguments))


def _predicate(graph: Graph, atom: str) -> str:
    named = [iri for predicate in _PREDICATES for iri in graph.objects_of(atom, predicate)]
    kinds = [_KINDS[kind] for kind in graph.objects_of(atom, v.RDF_TYPE) if kind in _KINDS]
    return (named or kinds or ["unknown"])[0]


def _arguments(graph: Graph, atom: str, variables: set[str]) -> Iterator[tuple[str, str]]:
    """Yield the arguments of an atom, each with its datatype."""
    for number in ("argument1", "argument2"):
        yield from _values(graph, atom, v.SWRL + number, variables)
    for start in graph.objects_of(atom, _ARGUMENTS):
        for cell in _cells(graph, start):
            yield from _values(graph, cell, v.RDF_FIRST, variables)


def _values(graph: Graph, node: str, predicate: str, variables: set[str]) -> Iterator[tuple[str, str]]:
    yield from ((f'"{text}"', datatype) for text, datatype in graph.typed_literals_of(node, predicate))
    for iri in graph.objects_of(node, predicate):
        yield f"?{local_name(iri)}" if iri in variables else iri, ""


def _cells(graph: Graph, start: str) -> Iterator[str]:
    """Yield the cells of a list, each once."""
    seen: set[str] = set()
    while start not in seen and graph.objects_of(start, v.RDF_FIRST) | set(graph.literals_of(start, v.RDF_FIRST)):
        seen.add(start)
        yield start
        start = next(iter(graph.objects_of(start, v.RDF_REST)), "")


def _text(graph: Graph, node: str, predicate: str) -> str:
    return next(iter(graph.literals_of(node, predicate)), "")
