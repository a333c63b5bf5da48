"""`rosmodel diff`: what differs between two models."""

from __future__ import annotations

from pathlib import Path

import click

from ros_model.errors import ModelError
from ros_model.io.models import read_all
from ros_model.language.difference import ADDITIONAL, CHANGED, MISSING, differences

_COLOURS = {MISSING: "red", ADDITIONAL: "green", CHANGED: "yellow"}


@click.command()
@click.argument("first", metavar="A", type=click.Path())
@click.argument("second", metavar="B", type=click.Path())
def diff(first: str, second: str) -> int:
    """Tell what differs between two .rossystem files, or two .ros files.

    Compared are components, their ports and parameters, connections by their ends, and global parameters; of packages
    all that they declare. A line begins with - for what only A has, + for what only B has, ~ for what is not the same.

    Exit status: 0 nothing differs, 1 something does, 2 a file can't be read.
    """
    models = [read_all(Path(path)) for path in (first, second)]
    if type(models[0]) is not type(models[1]):
        raise ModelError(f"{first} and {second} are not in one language: give two .rossystem or two .ros files")
    found = differences(*models)
    for difference in found:
        click.echo(click.style(str(difference), fg=_COLOURS[difference.sign]))
    return int(bool(found))
