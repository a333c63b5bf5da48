"""Triples as text: terms in the notation of N-Triples, from OWL in any format that owlready2 reads."""

from __future__ import annotations

import io
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

import owlready2
import owlready2.rdfxml_2_ntriples
from node_kit.one_line import OneLineError

from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.vocabulary import RDF_TYPE

Triple = tuple[str, str, str]

_LINE = re.compile(r"(\S+)\s+(\S+)\s+(.*?)\s*\.\s*$")
_LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"(?:\^\^<([^>]*)>|@\S+)?$', re.DOTALL)
_ESCAPE = re.compile(r"\\(u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|.)", re.DOTALL)
_ESCAPED = {"n": "\n", "r": "\r", "t": "\t", "b": "\b", "f": "\f"}
_DOTS = re.compile(r"^(?:\.{1,2}/)*")
_owlready_join = owlready2.rdfxml_2_ntriples.urljoin


def _join(base: str, name: str) -> str:
    """Join a relative IRI as owlready2 does, also one with a name that begins with a dot: its own loop never ends."""
    rest = _DOTS.sub("", name)
    steps = name[: len(name) - len(rest)]
    return f"{_owlready_join(base, steps)}{rest}" if rest.startswith(".") else _owlready_join(base, name)


owlready2.rdfxml_2_ntriples.urljoin = _join


class TripleError(OneLineError):
    """A text holds no readable triples."""


class Graph:
    """Triples with the look-ups that reading a model needs; names are IRIs, blank nodes their labels."""

    def __init__(self, triples: Sequence[Triple]) -> None:
        self.triples = triples
        self._objects: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
        self._subjects: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
        self._literals: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
        self._typed: dict[str, dict[str, list[tuple[str, str]]]] = defaultdict(lambda: defaultdict(list))
        for subject, predicate, value in triples:
            name, owner = iri_of(predicate), iri_of(subject)
            literal = literal_of(value)
            if literal is None:
                self._objects[name][owner].add(iri_of(value))
                self._subjects[name][iri_of(value)].add(owner)
            else:
                self._literals[name][owner].append(literal[0])
                self._typed[name][owner].append(literal)

    def instances(self, class_iri: str) -> set[str]:
        """Return the individuals of a class."""
        return set(self._subjects[RDF_TYPE].get(class_iri, ()))

    def subjects(self, predicate: str) -> set[str]:
        """Return what has the property."""
        return set(self._objects[predicate]) | set(self._literals[predicate])

    def objects(self, predicate: str) -> set[str]:
        """Return what something has by the property."""
        return set(self._subjects[predicate])

    def objects_of(self, subject: str, predicate: str) -> set[str]:
        """Return what a subject has by the property."""
        return set(self._objects[predicate].get(subject, ()))

    def subjects_of(self, predicate: str, value: str) -> set[str]:
        """Return what has a value by the property."""
        return set(self._subjects[predicate].get(value, ()))

    def pairs(self, predicate: str) -> list[tuple[str, str]]:
        """Return subject and value of each statement with the property."""
        return [(subject, value) for subject, values in self._objects[predicate].items() for value in sorted(values)]

    def literals(self, predicate: str) -> list[tuple[str, str]]:
        """Return subject and text of each statement with the property."""
        return [(subject, value) for subject, values in self._literals[predicate].items() for value in values]

    def literals_of(self, subject: str, predicate: str) -> list[str]:
        """Return the texts that a subject has by the property."""
        return self._literals[predicate].get(subject, [])

    def typed_literals_of(self, subject: str, predicate: str) -> list[tuple[str, str]]:
        """Return text and datatype of the literals that a subject has by the property."""
        return self._typed[predicate].get(subject, [])


def parse_owl(data: bytes, base: str) -> list[Triple]:
    """Return the triples of OWL (RDF/XML, OWL/XML or N-Triples), without following its imports.

    Args:
        data: the text.
        base: IRI to which relative ones refer where the text names no base.

    Raises:
        TripleError: it is not OWL; one line with the reason.
    """
    world = owlready2.World()
    try:
        graph = world.get_ontology("http://metacontrol.org/file#").graph
        graph.parse(io.BytesIO(data), default_base=base)
        saved = io.BytesIO()
        world.save(saved, format="ntriples")
    except Exception as error:  # owlready2's parsers raise whatever their parts do
        reason = " ".join(str(error).split()) or type(error).__name__
        raise TripleError(f"is not an OWL file ({reason}): save it as RDF/XML") from error
    finally:
        world.close()
    triples = list(parse_ntriples(saved.getvalue().decode()))
    if len(triples) <= 1:
        raise TripleError("is not an OWL file (it holds no statement): save it as RDF/XML")
    return triples


def parse_ntriples(text: str) -> Iterator[Triple]:
    """Yield the triples of N-Triples text, a statement on each line.

    Raises:
        TripleError: a line is none.
    """
    for line in text.split("\n"):
        if not line.strip() or line.startswith("#"):
            continue
        match = _LINE.match(line)
        if match is None:
            raise TripleError(f"not a triple: {line[:80]}")
        subject, predicate, value = match.groups()
        yield subject, predicate, value


def write_ntriples(triples: Iterable[Triple]) -> str:
    """Return the triples as N-Triples text."""
    return "".join(f"{subject} {predicate} {value} .\n" for subject, predicate, value in triples)


def assertion_triple(assertion: Assertion) -> Triple:
    """Return an assertion as a triple."""
    value = f"<{assertion.value}>"
    if assertion.datatype:
        text = assertion.value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r")
        value = f'"{text}"^^<{assertion.datatype}>'
    return f"<{assertion.subject}>", f"<{assertion.property}>", value


def decimal_text(number: float) -> str:
    """Return a finite number as text of xsd:decimal, to 12 digits after the point."""
    return f"{number:.12f}".rstrip("0").rstrip(".")


def iri_of(term: str) -> str:
    """Return the IRI of a term; a blank node's label stays as it is."""
    return term[1:-1] if term.startswith("<") else term


def term_of(iri: str) -> str:
    """Return the term of an IRI or of a blank node's label."""
    return iri if iri.startswith("_:") else f"<{iri}>"


def literal_of(term: str) -> tuple[str, str] | None:
    """Return value and datatype (empty for plain ones) of a literal, or None for another term."""
    match = _LITERAL.match(term)
    if match is None:
        return None
    return _ESCAPE.sub(_unescape, match.group(1)), match.group(2) or ""


def local_name(iri: str) -> str:
    """Return what follows the last `#`, or else the last `/`."""
    return re.split(r"[#/]", iri.rstrip("#/"))[-1] if "#" not in iri else iri.rsplit("#", 1)[1]


def _unescape(match: re.Match[str]) -> str:
    code = match.group(1)
    if code[0] in "uU" and len(code) > 1:
        return chr(int(code[1:], 16))
    return _ESCAPED.get(code, code)
