"""Reads and writes ontology files. It looks for imports beside the models, never on the network."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from node_kit.io.input_files import InputFileError, is_file, read_bytes, real_path
from node_kit.io.output_files import write_file

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.loaded_rules import fit
from mros1_reasoner.knowledge.loading import renamed
from mros1_reasoner.knowledge.model import Analysis, Direction, Facts
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError, read_model
from mros1_reasoner.knowledge.triples import Triple, TripleError, iri_of, local_name, parse_owl

MAX_SIZE = 200_000_000
"""Bytes of the largest ontology that is read; one of 1,000 designs has 3 million."""

_log = logging.getLogger(__name__)

_OWL = ".owl"
_SHOWN = 100  # characters of a name that somebody has given
_OWL_FOLDER = Path(__file__).resolve().parents[3] / "owl"


def read_knowledge_base(
    models: Sequence[Path],
    vocabularies: Sequence[Path] = (),
    directions: Mapping[str, Direction] | None = None,
    utility: str = "",
    *,
    spares: bool = True,
) -> KnowledgeBase:
    """Return the knowledge base of models, read beside the vocabulary.

    Args:
        models: OWL files of the application.
        vocabularies: further OWL files to load before them; the package's own are always loaded.
        directions: of quality attributes by name; see read_model.
        utility: the quality attribute that is the utility of designs; empty for none.
        spares: whether designs with other bindings count.

    Raises:
        KnowledgeBaseError: a file or an individual can't be used.
    """
    if not models:
        raise KnowledgeBaseError("no application model is given: set model_file to an OWL file")
    own = own_ontologies()
    others = [path for path in vocabularies if real_path(path) not in {real_path(file) for file in own}]
    generic, loaded, files = _read_ontologies(own, [*others, *models])
    where = ", ".join(str(path) for path in models)
    fitted, reads = fit(generic, loaded, where)
    triples = list(dict.fromkeys([*generic, *fitted]))
    return KnowledgeBase(read_model(triples, where, directions, utility, reads, spares=spares), files)


def save_knowledge_base(
    path: Path, knowledge_base: KnowledgeBase, facts: Facts | None = None, analysis: Analysis | None = None
) -> None:
    """Write a knowledge base, facts and statuses as one OWL file (RDF/XML) that loads again as a model.

    Raises:
        KnowledgeBaseError: the file can't be written.
    """
    text = knowledge_base.rdf_xml(facts, analysis)
    try:
        write_file(path, text)
    except OSError as error:
        raise KnowledgeBaseError(f"{path}: {error.strerror or error}: give another file") from error


def place_to_save(folder: Path, name: str) -> Path:
    """Return the path of the OWL file of a name in a folder, which is made if it is not there.

    Whoever reaches the node's service gives the name: it must lead to no file that is not an ontology.

    Args:
        folder: within which the file is to be.
        name: path of the file within the folder.

    Raises:
        KnowledgeBaseError: it is no OWL file in the folder, also by way of a link, or a folder can't be made.
    """
    own = real_path(folder)
    path = real_path(own / name)
    if path.suffix != _OWL or Path(name).suffix != _OWL:
        raise KnowledgeBaseError(f"{name[:_SHOWN]!r} does not end in {_OWL}: give a file that does")
    if not path.is_relative_to(own) or "\0" in name:
        raise KnowledgeBaseError(f"{name[:_SHOWN]!r} is not in {own}: give a file in it, or set ~save_folder")
    try:
        own.mkdir(parents=True, exist_ok=True)
        is_there = path.parent.is_dir()
    except OSError as error:
        raise KnowledgeBaseError(
            f"{own / name[:_SHOWN]}: {error.strerror or error}: give another file, or set ~save_folder"
        ) from error
    if not is_there:
        raise KnowledgeBaseError(f"{path.parent}: no such folder: make it first")
    return path


def own_ontologies() -> tuple[Path, Path]:
    """Return the paths of owl/tomasys.owl and owl/mros.owl.

    Raises:
        KnowledgeBaseError: they are not beside this package.
    """
    folder = _OWL_FOLDER
    if not folder.is_dir():
        import rospkg

        try:
            folder = Path(rospkg.RosPack().get_path("mros1_reasoner")) / "owl"
        except rospkg.ResourceNotFound as error:
            raise KnowledgeBaseError("owl/tomasys.owl is not found: source the workspace") from error
    return folder / "tomasys.owl", folder / "mros.owl"


def read_triples(path: Path) -> list[Triple]:
    """Return the triples of an OWL file (RDF/XML, OWL/XML or N-Triples), without following its imports.

    Raises:
        KnowledgeBaseError: the file is missing, unreadable, or not OWL; one line with the file and the reason.
    """
    try:
        data = read_bytes(path, MAX_SIZE)
    except InputFileError as error:
        raise KnowledgeBaseError(str(error)) from error
    try:
        return parse_owl(data, real_path(path).as_uri())
    except TripleError as error:
        raise KnowledgeBaseError(f"{path}: {error}") from error


def _read_ontologies(
    own: Sequence[Path], others: Sequence[Path]
) -> tuple[list[Triple], list[Triple], tuple[Path, ...]]:
    """Read files and, from the folders they lie in, what they import.

    Returns:
        The triples of our own ontologies, those of the others, and the files that these were read from.

    Raises:
        KnowledgeBaseError: a file can't be read.
    """
    known = set()
    generic: list[Triple] = []
    loaded: list[Triple] = []
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
        if real_path(path) in read:
            continue
        read[real_path(path)] = path
        content = read_triples(path)
        known |= {
            iri_of(s).rstrip("#/") for s, p, o in content if iri_of(p) == v.RDF_TYPE and iri_of(o) == v.OWL_ONTOLOGY
        }
        imports += [(iri_of(o).rstrip("#/"), path) for _, p, o in content if iri_of(p) == v.OWL_IMPORTS]
        (generic if ours else loaded).extend(renamed(content, len(read)))
    return generic, loaded, tuple(read.values())[len(own) :]


def _find_import(iri: str, importer: Path) -> Path | None:
    """Return the file beside the importing one whose name is the last part of the IRI, else the IRI itself."""
    name = local_name(iri)
    folder = real_path(importer).parent
    for file_name in (name, f"{name}.owl", f"{name}.rdf"):
        path = folder / file_name
        if file_name and is_file(path) and path.parent == folder:
            return path
    bears = re.compile(rf"Ontology[^>]*\b(?:about|ontologyIRI)=[\"']{re.escape(iri)}[#/]?[\"']".encode())
    for path in sorted([*folder.glob("*.owl"), *folder.glob("*.rdf")]):
        try:
            if bears.search(read_bytes(path, MAX_SIZE)):
                return path
        except InputFileError:
            continue
    return None
