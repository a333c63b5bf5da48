"""`rosmodel generate`: files of a package from its models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ros_model.errors import ModelError
from ros_model.files import safe_file_name
from ros_model.generators import find_generators, write_file
from ros_model.project import load_project

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from ros_model.generators import Generator
    from ros_model.project import Project

ALL = "all"
_FIRST = ("variants", "launch", "deployment")  # the order of `generate all`; others follow by name
_SYSTEM = ".rossystem"


def _complete(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem

    return [CompletionItem(name) for name in [ALL, *_ordered(find_generators())] if name.startswith(incomplete)]


class _Generate(click.Command):
    """A command whose help lists the generators that there are now."""

    def format_epilog(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        try:
            names = ", ".join([*_ordered(find_generators()), ALL])
        except ModelError as error:
            names = f"({error})"
        with formatter.section("WHAT"):
            formatter.write_text(names)
        super().format_epilog(context, formatter)


@click.command(cls=_Generate)
@click.argument("what", shell_complete=_complete)
@click.argument("models", required=False)
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    help="The package to write into. With --packages, the folder of packages (the src of a workspace).",
)
@click.option(
    "--packages", "as_packages", is_flag=True, help="Make each variant a catkin package, the published layout."
)
def generate(what: str, models: str | None, output: str | None, as_packages: bool) -> None:
    """Generate WHAT into a package from MODELS: the folder of metacontrol.yaml, or that file.

    `launch` takes a lone .rossystem file, too. `observer` without MODELS asks what to observe. Packages add
    generators of their own by an export in package.xml; `all` runs every one.
    """
    if what == "observer" and models is None:
        from ros_model.commands.observer_wizard import run_wizard

        run_wizard(output)
        return
    if models is None or output is None:
        missing = "'MODELS'" if models is None else "option '-o'"
        raise click.UsageError(f"Missing {missing}, e.g. rosmodel generate {what} models/ -o .")
    if what == "launch" and models.endswith(_SYSTEM):
        _generate_launch_file(Path(models), Path(output))
        return
    generators = find_generators()
    if what != ALL and what not in generators:
        raise ModelError(f"no generator {what!r}: there are {', '.join(sorted(generators))} and {ALL}")
    project, package = _placed(load_project(models), Path(output), as_packages)
    for name in _ordered(generators) if what == ALL else [what]:
        written = generators[name](project, package)
        click.echo(f"{name}: {len(written)} file{'s' * (len(written) != 1)} in {_common(written, output)}")
        if name == "observer":
            _tell_exports(project, package)


def _ordered(generators: dict[str, Generator]) -> list[str]:
    return [*(name for name in _FIRST if name in generators), *sorted(generators.keys() - set(_FIRST))]


def _placed(project: Project, output: Path, as_packages: bool) -> tuple[Project, Path]:
    """Return the project and the folder of its package.

    Raises:
        ModelError: the models are in the package, but not where generated files look for them.
    """
    package = output / project.package if as_packages else output
    folder, root = project.folder.resolve(), package.resolve()
    if folder.is_relative_to(root) and folder != root / "models":
        raise ModelError(
            f"{project.folder}: generated files look for the models in {package / 'models'}: move them there, "
            "or give the folder around models/ with -o"
        )
    return replace(project, packages_folder=output if as_packages else None), package


def _tell_exports(project: Project, package: Path) -> None:
    from ros_model.generators.observer import missing_exports
    from ros_model.observers import described_observers

    for line in missing_exports(described_observers(project), package):
        click.echo(f"  add to {package / 'package.xml'}: {line}")


def _generate_launch_file(path: Path, output: Path) -> None:
    from ros_model.generators.launch import launch_file
    from ros_model.model_files import PACKAGES
    from ros_model.project import read_library
    from ros_model.reader import read_system

    system, library = read_system(path), read_library(sorted(path.parent.glob(f"*{PACKAGES}")))
    name = safe_file_name(system.name, f"{system.position}: system")
    written = write_file(output / "launch" / f"{name}.launch", launch_file(system, library=library), output)
    click.echo(f"launch: {written}")


def _common(written: list[Path], output: str) -> str:
    return output if len(written) != 1 else str(written[0])
