"""The command `rosmodel`: check, format, show, generate."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ros_model.checker import Finding, check_system
from ros_model.errors import ModelError
from ros_model.files import read_text
from ros_model.generators import find_generators
from ros_model.metamodel import compose
from ros_model.project import FILE_NAME, load_project
from ros_model.reader import comments_inside, parse_system, read_system
from ros_model.writer import write_system

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ros_model.metamodel import RosSystem

BAD_INPUT = 2
"""Exit status for a file that can't be read or used; 1 says that it can, and that something is wrong in it."""
_FIRST = ("variants", "launch", "deployment")  # the order of `generate all`; others follow by name


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command; the end of every failure is one line on standard error."""
    try:
        status = command.main(args=arguments, prog_name="rosmodel", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except ModelError as error:
        click.echo(f"rosmodel: {error}", err=True)
        sys.exit(BAD_INPUT)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    sys.exit(status if isinstance(status, int) else 0)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Models of ROS systems: check, format, show, generate from them."""


@command.command()
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


@command.command("format")
@click.option("--check", "only_check", is_flag=True, help="Write nothing; exit status 1 if a file would change.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def format_(only_check: bool, files: tuple[str, ...]) -> int:
    """Write .rossystem files in the canonical form. Comments at their top stay; a file with others is refused."""
    changed = False
    for file in files:
        path = Path(file)
        text = read_text(path)
        formatted = write_system(parse_system(text, file))
        if lost := comments_inside(text, file):
            raise ModelError("this comment would be lost: move it to the top of the file", lost[0])
        if formatted == text:
            continue
        changed = True
        click.echo(f"{'would change' if only_check else 'changed'} {file}")
        if not only_check:
            _replace(path, formatted)
    return int(changed and only_check)


def _replace(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}: check its permissions") from error


@command.command()
@click.argument("file")
def show(file: str) -> None:
    """Show a .rossystem file as a tree."""
    from rich.console import Console  # slow to import, and only needed here

    Console(highlight=False).print(_tree(read_system(file)))


def _tree(system: RosSystem) -> object:
    from rich.markup import escape
    from rich.tree import Tree

    tree = Tree(f"[bold]{escape(system.name)}[/bold]")
    for component in system.components:
        branch = tree.add(f"[bold]{escape(component.graph_name)}[/bold]  {escape(str(component.executable or ''))}")
        for port in component.ports:
            branch.add(f"{port.kind.value} [cyan]{escape(port.name)}[/cyan]")
        for parameter in component.parameters:
            branch.add(f"parameter [green]{escape(parameter.key)}[/green] = {escape(repr(parameter.value))}")
    for connection in system.connections:
        sources = ", ".join(map(str, connection.sources))
        targets = ", ".join(map(str, connection.targets))
        tree.add(escape(f"{connection.kind.value} {connection.name}: {sources} -> {targets}"))
    for setting in system.parameters:
        tree.add(f"parameter [green]{escape(setting.name)}[/green] = {escape(repr(setting.value))}")
    return tree


@command.command()
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
