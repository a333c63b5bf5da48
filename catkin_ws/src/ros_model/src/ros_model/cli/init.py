"""`rosmodel init`: a first metacontrol.yaml for a base system, and a package around it."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click
from catkin_pkg.package import parse_package
from node_kit.io.input_files import real_path
from node_kit.plugins import UNREADABLE

from ros_model.cli.generate import ALL, run_generators
from ros_model.errors import ModelError, printable
from ros_model.generators import write_files
from ros_model.io.dynamic_parameters import ranges_of
from ros_model.io.files import read_text
from ros_model.io.installed import InstalledPackages
from ros_model.io.models import files_in, read_sources, read_system
from ros_model.io.project import load_project
from ros_model.language.any_language import PACKAGES
from ros_model.language.library import Unknown
from ros_model.project.executables import alternatives
from ros_model.project.first_package import package_texts
from ros_model.project.first_project import (
    LEVELS,
    TABLE,
    Choices,
    default_columns,
    first_project,
    parameters_of,
    varying,
)
from ros_model.project.requirements import requirement_lines

if TYPE_CHECKING:
    from ros_model.language.metamodel import Component, Reference, RosSystem
    from ros_model.project.first_project import FirstProject

_QUALITY = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_NEW_PACKAGE = re.compile(r"[a-z][a-z0-9_]*")


@click.command("init")
@click.argument("base")
@click.option("--package", metavar="NAME", help="The package of the models; it is made if they are not in it.")
@click.option("-o", "--output", default=".", metavar="FOLDER", help="Where a package is made: the src of a workspace.")
@click.option("--component", metavar="NAME", help="The component that varies; default: the likeliest.")
@click.option("--qa", "qualities", multiple=True, metavar="NAME", help="A quality attribute, beside performance.")
@click.option(
    "--vary",
    multiple=True,
    metavar="NODE/PARAMETER",
    help="Parameters that differ between variants; wildcards are allowed. On a terminal, the command asks.",
)
@click.option(
    "--alternative",
    "others",
    multiple=True,
    metavar="PACKAGE/EXECUTABLE",
    help="Another executable for the component, as a variant.",
)
def init(
    base: str,
    package: str | None,
    output: str,
    component: str | None,
    qualities: tuple[str, ...],
    vary: tuple[str, ...],
    others: tuple[str, ...],
) -> None:
    """Write a first metacontrol.yaml, and its tables, beside the .rossystem file BASE.

    With --package, a catkin package is made around copies of the models, if they are not in one of that name: it builds
    as it is. All checks clean; places marked CHANGE are guesses. Files that exist are never overwritten.
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
    around = _package_around(real_path(path.parent))
    system = read_system(path)
    varied = varying(system, component)
    ranges = _ranges(varied)
    choices = Choices(
        package or around,
        component,
        qualities,
        vary or _asked_parameters(varied, ranges),
        _alternatives(system, varied, path.parent, others),
        ranges,
    )
    if package is None or package == around:
        _in_place(path, system, choices)
    else:
        _new_package(path, system, choices, Path(output))


def _in_place(path: Path, system: RosSystem, choices: Choices) -> None:
    folder = path.parent
    first = first_project(system, path.name, real_path(folder).name or ".", choices)
    _write(folder, first.texts)
    _tell(first, folder)
    click.echo(f"Change the places marked CHANGE, then: rosmodel check {folder}")


def _new_package(path: Path, system: RosSystem, choices: Choices, output: Path) -> None:
    """Write a package with the models and all that is made of them.

    Raises:
        ModelError: the name is none of a catkin package, or a file is there.
    """
    name = choices.package
    if not _NEW_PACKAGE.fullmatch(name):
        raise click.UsageError(f"--package {name!r} is no name of a new package: small letters, digits and '_'")
    folder = output / name
    if os.path.lexists(folder):
        raise ModelError(f"{folder}: is there already: give another name, or another folder with -o")
    first = first_project(system, path.name, "models", choices)
    models = {f"models/{file}": text for file, text in first.texts.items()}
    models |= {f"models/{file.name}": read_text(file) for file in (path, *_beside(path.parent))}
    packages = {c.executable.package for c in system.components if c.executable}
    packages |= {alternative.package for alternative in choices.alternatives}
    installed = InstalledPackages()
    unknown = sorted(package for package in packages if not installed.has_package(package))
    _write(folder, {**package_texts(name, packages, first.variant, (TABLE, LEVELS)), **models})
    _tell(first, folder / "models")
    if unknown:
        click.echo(f"{', '.join(unknown)}: not on ROS_PACKAGE_PATH: source the robot's workspace before you build")
    run_generators(ALL, str(folder / "models"), str(folder))
    click.echo(f"Next steps are in {folder / 'README.md'}")


def _beside(folder: Path) -> list[Path]:
    return [file for file in files_in(folder, PACKAGES) if file.parent == folder]


def _write(folder: Path, texts: dict[str, str]) -> None:
    for name in texts:
        if os.path.lexists(folder / name):
            raise ModelError(f"{folder / name}: is there already: move it away, or edit it")
    for written in write_files({folder / name: text for name, text in texts.items()}, folder):
        click.echo(f"wrote {written}")


def _tell(first: FirstProject, folder: Path) -> None:
    for line in (*first.remarks, *requirement_lines(load_project(folder))):
        click.echo(printable(line))


def _ranges(component: Component) -> dict[tuple[str, str], str]:
    if component.executable is None:
        return {}
    package = component.executable.package
    return {(package, name): told for name, told in ranges_of(package).items()}


def _is_asked() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _asked_parameters(component: Component, ranges: dict[tuple[str, str], str]) -> tuple[str, ...] | None:
    """Ask which parameters vary; None: it is left to the default."""
    known = parameters_of(component)
    if not known or not _is_asked():
        return None
    click.echo(f"Parameters of {component.graph_name}:")
    for number, parameter in enumerate(known, 1):
        package = component.executable.package if component.executable else ""
        told = ranges.get((package, parameter.key.rpartition("/")[2]), "")
        click.echo(printable(f"{number:4}  {parameter.key} = {parameter.value}  {told}".rstrip()))

    def proc(text: str) -> tuple[str, ...] | None:
        words = [word for word in re.split(r"[\s,]+", text.strip()) if word]
        if words == ["none"]:
            return ()
        for word in words:
            if word.isdecimal() and not 1 <= int(word) <= len(known):
                raise click.BadParameter(f"{word} is none of the numbers 1 to {len(known)}")
        return tuple(known[int(word) - 1].key if word.isdecimal() else word for word in words) or None

    default = "all" if default_columns(component) else "none"
    question = "Which differ between variants (numbers, names with wildcards)"
    answer = click.prompt(question, default=default, value_proc=lambda text: proc("*" if text == "all" else text))
    return cast("tuple[str, ...] | None", answer)


def _alternatives(
    system: RosSystem, component: Component, folder: Path, names: tuple[str, ...]
) -> dict[Reference, frozenset[str]]:
    """Return the nodes of executables that become variants, those named or said yes to, and their parameters.

    Others are told.

    Raises:
        ModelError: one that is named does not do what the component does.
    """
    library, unread = read_sources(folder)
    for error in unread:
        click.echo(f"rosmodel: {error}: no alternatives are looked for there", err=True)
    found = {f"{node.package}/{node.artifact}": node for node in alternatives(system, component, library)}
    for name in names:
        if name not in found:
            known = f"there are {', '.join(found)}" if found else "no model beside the base tells of one that does"
            does = f"publish and serve all that {component.graph_name} does"
            raise ModelError(f"--alternative {name!r} does not {does}; {known}")
    chosen = [found[name] for name in names]
    for name, node in found.items():
        if name in names:
            continue
        told = f"{name} publishes and serves what {component.graph_name} does"
        if _is_asked():
            if click.confirm(f"{told}. Make it a variant?", default=True):
                chosen.append(node)
        else:
            click.echo(f"{told}: --alternative {name} makes it a variant")
    declared = {node: library.node(node) for node in chosen}
    return {
        node: frozenset(parameter.name for parameter in found.parameters)
        for node, found in declared.items()
        if not isinstance(found, Unknown)
    }


def _package_around(folder: Path) -> str:
    """Return the name of the package around a folder; without one, a name made of the folder's."""
    for around in (folder, *folder.parents):
        if os.path.isfile(around / "package.xml"):
            try:
                return str(parse_package(str(around)).name)
            except UNREADABLE:
                break
    named = folder.parent if folder.name == "models" else folder
    return re.sub(r"[^A-Za-z0-9_-]+|^[^A-Za-z]+", "_", named.name).strip("_") or "my_robot"
