"""Changes the triples of an ontology's file so that they load beside those of others."""

from __future__ import annotations

from collections.abc import Iterable

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.triples import Triple, iri_of, local_name


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
