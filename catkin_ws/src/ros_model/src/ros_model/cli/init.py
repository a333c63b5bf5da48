"""`rosmodel init`: a first metacontrol.yaml for a base system."""

from __future__ import annotations

import os
import re
from pathlib import Path

import click
from catkin_pkg.package import InvalidPackage, parse_package
from node_kit.io.input_files import real_path

from ros_model.errors import ModelError, printable
from ros_model.generators import write_files
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from ros_model.project.first_project import Choices, first_project
from ros_model.project.requirements import requirement_lines

_QUALITY = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@click.command("init")
@click.argument("base")
@click.option("--package", metavar="NAME", help="The package of the models; default: the one that they are in.")
@click.option("--component", metavar="NAME", help="The component that varies; default: the likeliest.")
@click.option("--qa", "qualities", multiple=True, metavar="NAME", help="A quality attribute, beside performance.")
def init(base: str, package: str | None, component: str | None, qualities: tuple[str, ...]) -> None:
    """Write a first metacontrol.yaml, and its tables, beside the .rossystem file BASE.

    It checks clean as it is; places marked CHANGE are guesses. Files that exist are never overwritten.
    The command shows which components the variant requires, and by which way.
    """
    if package is not None and not _PACKAGE.fullmatch(package):
        raise click.UsageError(f"--package {package!r} is no name of letters, digits, '_' and '-'")
    for name in qualities:
        if not _QUALITY.fullmatch(name):
            raise click.UsageError(f"--qa {name!r} is no name of letters, digits and '_'")
    path = Path(base)
    if os.path.isdir(path):
        raise ModelError(f"{path}: is a folder: give the .rossystem file of the base system")
    folder = path.parent
    choices = Choices(package or _package_around(real_path(folder)), component, qualities)
    first = first_project(read_system(path), path.name, real_path(folder).name or ".", choices)
    for name in first.texts:
        if os.path.lexists(folder / name):
            raise ModelError(f"{folder / name}: is there already: move it away, or edit it")
    for written in write_files({folder / name: text for name, text in first.texts.items()}, folder):
        click.echo(f"wrote {written}")
    for line in (*first.remarks, *requirement_lines(load_project(folder))):
        click.echo(printable(line))
    click.echo(f"Change the places marked CHANGE, then: rosmodel check {folder}")


def _package_around(folder: Path) -> str:
    """Return the name of the package around a folder; without one, a name made of the folder's."""
    for around in (folder, *folder.parents):
        if os.path.isfile(around / "package.xml"):
            try:
                return str(parse_package(str(around)).name)
            except InvalidPackage:
                break
    named = folder.parent if folder.name == "models" else folder
    return re.sub(r"[^A-Za-z0-9_-]+|^[^A-Za-z]+", "_", named.name).strip("_") or "my_robot"
