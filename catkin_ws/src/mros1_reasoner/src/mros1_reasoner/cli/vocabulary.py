"""The command `vocabulary`."""

from __future__ import annotations

from pathlib import Path

import click

from mros1_reasoner.cli.output import ERRORS, refuse
from mros1_reasoner.io.ontology_files import own_ontologies, read_triples
from mros1_reasoner.knowledge.triples import Graph
from mros1_reasoner.knowledge.vocabulary_page import vocabulary_page


@click.command()
@click.argument("files", nargs=-1, type=click.Path(path_type=Path))
def vocabulary(files: tuple[Path, ...]) -> None:
    """Print classes, properties and rules of OWL FILES as Markdown; of the package's own if none is given."""
    try:
        page = vocabulary_page({path.name: Graph(read_triples(path)) for path in files or own_ontologies()})
    except ERRORS as error:
        refuse("vocabulary", error)
    click.echo(page, nl=False)
