"""`rosmodel generate`: files of a package from its models."""

from __future__ import annotations

from pathlib import Path

import click

from ros_model.errors import ModelError
from ros_model.generators import find_generators
from ros_model.project import load_project

_FIRST = ("variants", "launch", "deployment")  # the order of `generate all`; others follow by name


@click.command()
@click.argument("what", metavar="launch|deployment|tomasys|variants|all")
@click.argument("folder")
@click.option("-o", "--output", required=True, metavar="PACKAGE_DIR", help="The package to write into.")
def generate(what: str, folder: str, output: str) -> None:
    """Generate files of a package from the models in FOLDER (or its metacontrol.yaml).

    Packages add generators of their own by an export in package.xml; `all` runs every one.
    """
    project = load_project(folder)
    generators = find_generators()
    if what != "all" and what not in generators:
        raise ModelError(f"no generator {what!r}: there are {', '.join(sorted(generators))} and all")
    order = [*(name for name in _FIRST if name in generators), *sorted(generators.keys() - set(_FIRST))]
    for name in order if what == "all" else [what]:
        written = generators[name](project, Path(output))
        click.echo(f"{name}: {len(written)} file{'s' * (len(written) != 1)} in {output}")
