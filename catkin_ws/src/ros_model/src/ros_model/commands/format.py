"""`rosmodel format`: the canonical form."""

from __future__ import annotations

from pathlib import Path

import click

from ros_model.errors import ModelError
from ros_model.files import read_text
from ros_model.reader import parse_system
from ros_model.syntax import comments_inside
from ros_model.writer import write_system


@click.command("format")
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
