"""Ontologies from files: imports found beside them, never on the network, and rules set aside that ours replace."""

from __future__ import annotations

import logging
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.triples import Triple, iri_of, literal_of, local_name, read_triples

_log = logging.getLogger(__name__)


def read_ontologies(own: Sequence[Path], others: Sequence[Path]) -> tuple[list[Triple], tuple[Path, ...]]:
    """Read files and, from the folders they lie in, what they import.

    Args:
        own: the vocabulary and its rules, which are taken as they are.
        others: rules of theirs that conclude a derived status are set aside, with a warning that names them.

    Returns:
        The triples, and the files that were read beside our own.

    Raises:
        TripleError: a file can't be read.
    """
    known = set()
    triples: list[Triple] = []
    queue = [(path, True) for path in own] + [(path, False) for path in others]
    read: dict[Path, Path] = {}
    imports: list[tuple[str, Path]] = []
    while queue or imports:
        if not queue:
            iri, importer = imports.pop()
            path = None if iri in known else _find_import(iri, importer)
            if path is not None:
                queue.append((path, False))
            elif iri not in known:
                _log.warning("%s imports <%s>, which is not among the given files: going on without", importer, iri)
            known.add(iri)
            continue
        path, ours = queue.pop(0)
        if path.resolve() in read:
            continue
        read[path.resolve()] = path
        content = read_triples(path)
        known |= {
            iri_of(s).rstrip("#/") for s, p, o in content if iri_of(p) == v.RDF_TYPE and iri_of(o) == v.OWL_ONTOLOGY
        }
        imports += [(iri_of(o).rstrip("#/"), path) for _, p, o in content if iri_of(p) == v.OWL_IMPORTS]
        content = _renamed(content, len(read))
        triples += content if ours else _without_concluding_rules(content, path)
    return list(dict.fromkeys(triples)), tuple(read.values())[len(own) :]


def _find_import(iri: str, importer: Path) -> Path | None:
    """Return the file beside the importing one that bears the last part of the IRI as its name, else the IRI itself."""
    name = local_name(iri)
    folder = importer.resolve().parent
    for file_name in (name, f"{name}.owl", f"{name}.rdf"):
        path = folder / file_name
        if file_name and path.is_file() and path.parent == folder:
            return path
    bears = re.compile(rf"Ontology[^>]*\b(?:about|ontologyIRI)=[\"']{re.escape(iri)}[#/]?[\"']".encode())
    for path in sorted([*folder.glob("*.owl"), *folder.glob("*.rdf")]):
        try:
            if bears.search(path.read_bytes()):
                return path
        except OSError:
            continue
    return None


def _renamed(triples: Iterable[Triple], number: int) -> list[Triple]:
    """Give blank nodes labels of their own, requiredBy its one IRI, and drop what is about the file itself."""

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


def _without_concluding_rules(triples: list[Triple], path: Path) -> list[Triple]:
    """Set aside the rules that conclude a derived status: two values of one would contradict each other."""
    by_subject: dict[str, list[Triple]] = defaultdict(list)
    for triple in triples:
        by_subject[triple[0]].append(triple)

    def reach(node: str) -> set[str]:
        """Return the node and the nodes of its lists and atoms, which belong to it alone."""
        nodes, waiting = {node}, [node]
        while waiting:
            for _, _, value in by_subject[waiting.pop()]:
                if value in by_subject and value not in nodes and _is_rule_part(by_subject[value]):
                    nodes.add(value)
                    waiting.append(value)
        return nodes

    dropped: set[str] = set()
    labels = []
    for rule in [s for s, p, o in triples if iri_of(p) == v.RDF_TYPE and iri_of(o) == v.SWRL + "Imp"]:
        heads = [o for _, p, o in by_subject[rule] if iri_of(p) == v.SWRL + "head"]
        concluded = {
            iri_of(o)
            for head in heads
            for node in reach(head)
            for _, p, o in by_subject[node]
            if iri_of(p) == v.SWRL + "propertyPredicate"
        }
        statuses = concluded & set(v.DERIVED_STATUSES)
        if statuses:
            dropped |= reach(rule)
            label = next((literal_of(o) for _, p, o in by_subject[rule] if iri_of(p) == v.RDFS_LABEL), None)
            labels.append(label[0] if label else f"a rule for {local_name(sorted(statuses)[0])}")
    if labels:
        _log.warning("%s: its own rules are set aside, the generic ones hold: %s", path, ", ".join(sorted(labels)))
    return [triple for triple in triples if triple[0] not in dropped]


def _is_rule_part(statements: Sequence[Triple]) -> bool:
    predicates = {iri_of(predicate) for _, predicate, _ in statements}
    return v.RDF_FIRST in predicates or any(predicate.startswith(v.SWRL) for predicate in predicates)
