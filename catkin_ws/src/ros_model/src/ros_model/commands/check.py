"""`rosmodel check`: what is wrong in models."""

from __future__ import annotations

from pathlib import Path

import click

from ros_model.checker import Finding, check_system
from ros_model.commands import BAD_INPUT
from ros_model.errors import ModelError
from ros_model.metamodel import compose
from ros_model.project import FILE_NAME, load_project
from ros_model.reader import read_system


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check(files: tuple[str, ...]) -> int:
    """Check .rossystem files, or projects by their metacontrol.yaml or folder.

    Exit status: 0 all is well, 1 something is wrong in a model, 2 a file can't be read.
    """
    findings: list[Finding] = []
    unreadable = False
    for file in files:
        try:
            findings += _check_file(Path(file))
        except ModelError as error:
            click.echo(f"rosmodel: {error}", err=True)
            unreadable = True
    for finding in findings:
        click.echo(finding)
    return BAD_INPUT if unreadable else int(bool(findings))


def _check_file(path: Path) -> tuple[Finding, ...]:
    if not path.is_dir() and path.name != FILE_NAME:
        return check_system(read_system(path))
    project = load_project(path)
    found = dict.fromkeys(check_system(project.base))
    for variant in project.variants:
        found |= dict.fromkeys(check_system(variant, compose(project.base, variant)))
    return tuple(found)
