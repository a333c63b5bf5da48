"""`rosmodel generate`: files of a package from its models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from node_kit.io.input_files import real_path

from ros_model.cli.check import Check
from ros_model.errors import Gathered, ModelError
from ros_model.file_names import safe_file_name
from ros_model.findings import ERROR
from ros_model.generators import find_generators, is_generated, write_file
from ros_model.io.project import load_project
from ros_model.project.settings import FILE_NAME

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from ros_model.generators import Generator
    from ros_model.project.project import Project

ALL = "all"
_FIRST = ("variants", "launch", "observer", "deployment")  # in `generate all`; others follow by name. The monitor reads
# the models of observers, so its configuration names them.
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
        from ros_model.cli.observer_wizard import run_wizard

        run_wizard(output)
        return
    if models is None or output is None:
        missing = "'MODELS'" if models is None else "option '-o'"
        raise click.UsageError(f"Missing {missing}, e.g. rosmodel generate {what} models/ -o .")
    if what == "launch" and models.endswith(_SYSTEM):
        _generate_launch_file(Path(models), Path(output))
        return
    run_generators(what, models, output, as_packages=as_packages)


def run_generators(what: str, models: str, output: str, *, as_packages: bool = False) -> None:
    """Check a project, run one generator or all, and tell what was written.

    Raises:
        ModelError: there is no such generator, the project has an error, or a file can't be written.
    """
    generators = find_generators()
    if what != ALL and what not in generators:
        raise ModelError(f"no generator {what!r}: there are {', '.join(sorted(generators))} and {ALL}")
    if models.endswith(_SYSTEM):
        raise ModelError(f"{models}: is one system, and {what} needs a project: give the folder of {FILE_NAME}")
    checked = Check()
    loaded = load_project(models)
    checked.add_project(loaded)
    _refuse_errors(checked)
    project, package = _placed(loaded, Path(output), as_packages)
    for name in _ordered(generators) if what == ALL else [what]:
        written = generators[name](project, package)
        click.echo(f"{name}: {len(written)} file{'s' * (len(written) != 1)} in {_common(written, output)}")
        for path in _stale(written):
            click.echo(f"  {path} was generated once and is not any more: delete it")
        for path, other in _namesakes(written, package):
            click.echo(
                f"  {path} has the name of {other}: `roslaunch {project.package} {path.name}` refuses both: rename the "
                "variant, or give roslaunch the path"
            )
        if name == "observer":
            _tell_of_observers(project, package)


def _refuse_errors(checked: Check) -> None:
    """Refuse what `rosmodel check` refuses: nothing is written.

    Raises:
        ModelError: there is an error.
    """
    wrong = Gathered()
    wrong.add(
        ModelError(finding.message, finding.position, rule=finding.rule)
        for finding in checked.findings()
        if finding.severity == ERROR
    )
    wrong.tell()


def _ordered(generators: dict[str, Generator]) -> list[str]:
    return [*(name for name in _FIRST if name in generators), *sorted(generators.keys() - set(_FIRST))]


def _placed(project: Project, output: Path, as_packages: bool) -> tuple[Project, Path]:
    """Return the project and the folder of its package.

    Raises:
        ModelError: the models are in the package, but not where generated files look for them.
    """
    package = output / project.package if as_packages else output
    folder, root = real_path(project.folder), real_path(package)
    if folder.is_relative_to(root) and folder != root / "models":
        raise ModelError(
            f"{project.source.path.parent}: generated files look for the models in {package / 'models'}: "
            "move them there, or give the folder around models/ with -o"
        )
    return replace(project, packages_folder=output if as_packages else None), package


def _stale(written: list[Path]) -> list[Path]:
    """Return files of variants that were generated, beside those that are now, but belong to none any more."""
    folders = {(path.parent, path.suffix) for path in written if path.parent.name == "variants"}
    found = (path for folder, suffix in folders for path in folder.glob(f"*{suffix}") if path not in set(written))
    return sorted(path for path in found if is_generated(path))


def _namesakes(written: list[Path], package: Path) -> list[tuple[Path, Path]]:
    """Return the launch files that were written, each with another of its name in the package."""
    launch_files = [path for path in written if path.suffix == ".launch"]
    others = [path for path in (package / "launch").rglob("*.launch") if path not in set(written)]
    return [(path, other) for path in launch_files for other in others if path.name == other.name]


def _tell_of_observers(project: Project, package: Path) -> None:
    from ros_model.generators.observer import missing_exports, outdated
    from ros_model.project.observers import described_observers

    observers = described_observers(project)
    for line in outdated(observers, package):
        click.echo(f"  kept {line}")
    for line in missing_exports(observers, package):
        click.echo(f"  add to {package / 'package.xml'}: {line}")


def _generate_launch_file(path: Path, output: Path) -> None:
    from ros_model.generators.launch import launch_file
    from ros_model.io.models import read_library, read_system
    from ros_model.language.any_language import PACKAGES

    checked = Check()
    checked.add(path)
    _refuse_errors(checked)
    system, library = read_system(path), read_library(sorted(path.parent.glob(f"*{PACKAGES}")))
    name = safe_file_name(system.name, f"{system.position}: system")
    written = write_file(output / "launch" / f"{name}.launch", launch_file(system, library=library), output)
    click.echo(f"launch: {written}")


def _common(written: list[Path], output: str) -> str:
    return output if len(written) != 1 else str(written[0])
