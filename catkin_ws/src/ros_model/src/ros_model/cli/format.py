"""`rosmodel format`: the canonical form."""

from __future__ import annotations

from pathlib import Path

import click
from node_kit.io.output_files import write_file

from ros_model.errors import ModelError
from ros_model.io.files import read_text
from ros_model.io.models import models_at
from ros_model.language.any_language import parse_all
from ros_model.language.comments import with_comments
from ros_model.language.packages import PackageSet
from ros_model.language.packages_writer import write_packages
from ros_model.language.system_writer import write_system


@click.command("format")
@click.option("--check", "only_check", is_flag=True, help="Write nothing; exit status 1 if a file would change.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
def format_(only_check: bool, files: tuple[str, ...]) -> int:
    """Write .rossystem and .ros files, or all in a folder, in the canonical form.

    Comments stay: those at the top of a file there, each of the others above the element that it is beside.

    Exit status: 0 all is well, 1 a file would change and --check is given, 2 a file can't be read or written.
    """
    changed = False
    errors: list[ModelError] = []
    for path in (path for file in files for path in models_at(Path(file))):
        try:
            changed |= _format(path, only_check)
        except ModelError as error:
            errors += error.all
    if errors:
        raise ModelError(errors[0].message, errors[0].position, errors[1:])
    return int(changed and only_check)


def _format(path: Path, only_check: bool) -> bool:
    """Bring a file to its canonical form; return whether it had another."""
    text = read_text(path)
    formatted = formatted_text(text, str(path))
    if formatted == text:
        return False
    if not only_check:
        try:
            write_file(path, formatted)
        except OSError as error:
            raise ModelError(f"{path}: {error.strerror or error}: check its permissions") from error
    click.echo(f"{'would change' if only_check else 'changed'} {path}")
    return True


def formatted_text(text: str, file: str) -> str:
    """Return the canonical form of a text of either language, with its comments.

    Raises:
        ModelError: it is not well-formed.
    """
    model = parse_all(text, file)
    formatted = write_packages(model) if isinstance(model, PackageSet) else write_system(model)
    return with_comments(text, model, formatted, parse_all(formatted, file))
