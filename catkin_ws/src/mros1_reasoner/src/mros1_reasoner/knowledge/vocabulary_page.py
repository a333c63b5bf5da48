"""The vocabulary and its rules as a page in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.rules import Rule, rules_of
from mros1_reasoner.knowledge.triples import Graph, local_name

_HEAD = """# Vocabulary and rules

Generated from the OWL files here by `rosrun mros1_reasoner vocabulary`; change these, not this.
"""
_NAMELESS = "http://anonymous"
"""What owlready2 calls the ontology of statements that belong to none."""
_PROPERTIES = (v.OWL_OBJECT_PROPERTY, v.OWL_DATATYPE_PROPERTY)


def vocabulary_page(ontologies: Mapping[str, Graph]) -> str:
    """Return a page with the classes, properties and rules of ontologies.

    Args:
        ontologies: by the names of their files.
    """
    return "\n".join([_HEAD, *(line for name, graph in ontologies.items() for line in _section(name, graph))])


def _section(name: str, graph: Graph) -> Iterator[str]:
    yield from (f"## {name}", "")
    for ontology in sorted(graph.instances(v.OWL_ONTOLOGY) - {_NAMELESS}):
        yield from (f"`{ontology}` {_comment(graph, ontology)}".rstrip(), "")
    classes = sorted(iri for iri in graph.instances(v.OWL_CLASS) if not iri.startswith("_:"))
    properties = sorted(iri for kind in _PROPERTIES for iri in graph.instances(kind))
    yield from _table(["class", ""], [[f"`{local_name(iri)}`", _comment(graph, iri)] for iri in classes])
    yield from _table(["property", "from, to", ""], [_property(graph, iri) for iri in properties])
    yield from _table(["rule", "body -> head", ""], [_rule(rule) for rule in rules_of(graph)])


def _property(graph: Graph, iri: str) -> list[str]:
    ends = (_named(graph.objects_of(iri, end)) for end in (v.RDFS_DOMAIN, v.RDFS_RANGE))
    only = ", at most one" if iri in graph.instances(v.OWL_FUNCTIONAL_PROPERTY) else ""
    return [f"`{local_name(iri)}`", f"{' -> '.join(ends)}{only}", _comment(graph, iri)]


def _named(iris: Iterable[str]) -> str:
    return " or ".join(sorted("one of a list" if iri.startswith("_:") else local_name(iri) for iri in iris)) or "any"


def _rule(rule: Rule) -> list[str]:
    return [f"`{rule.label}`", f"`{rule}`", rule.comment]


def _comment(graph: Graph, iri: str) -> str:
    return " ".join(" ".join(graph.literals_of(iri, v.RDFS_COMMENT)).split())


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    if not rows:
        return
    for row in (head, ["---"] * len(head), *rows):
        yield f"| {' | '.join(text.replace('|', chr(92) + '|') for text in row)} |"
    yield ""
