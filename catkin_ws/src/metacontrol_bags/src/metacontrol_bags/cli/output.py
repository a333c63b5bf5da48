"""What the commands share: the bags that they are given, lines for what is missing, tables and JSON."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from metacontrol_bags.bag import BagError, Salvaged, robots, salvage
from metacontrol_bags.gaps import gaps, is_mission, nothing_of_a_mission
from metacontrol_bags.metrics import MetricsError
from metacontrol_bags.printable import printable

BAGS = click.argument("bags", metavar="BAG...", nargs=-1, required=True, type=click.Path(path_type=Path))
JSON = click.option("--json", "as_json", is_flag=True, help="Print a JSON list with an object for each bag.")

NAMESPACE = click.option("--namespace", help="Of the robot, where a bag holds several.")

_REFUSED = 2  # exit status
_WIDTH = 150  # characters, where the output is no terminal

Told = TypeVar("Told")


def of_each(bags: Iterable[Path], tell: Callable[[Path], Told]) -> tuple[list[Told], int]:
    """Apply a function to each bag; a bag of which nothing can be told gets a line on stderr.

    Returns:
        What the function returned, and the exit status of the command: 2 if there is such a bag.
    """
    told, status = [], 0
    for bag in bags:
        try:
            told.append(tell(bag))
        except (BagError, MetricsError) as error:
            said = str(error)
            note(said if str(bag) in said else f"{bag}: {said}")
            status = _REFUSED
        except OSError as error:
            note(f"{error.filename or bag}: {error.strerror or error}")
            status = _REFUSED
    return told, status


def robot_of(bag: Path, namespace: str | None) -> str:
    """Return the namespace of the robot to tell of: the given one, else that of the only robot in a bag.

    Raises:
        BagError: the bag has several robots, or none of this name.
    """
    known = robots(bag)
    if namespace is not None:
        wanted = "/" + namespace.strip("/")
        if known and wanted not in known:
            raise BagError(f"{bag}: has no robot in {wanted}, but in {', '.join(known)}: give one of these")
        return wanted
    if len(known) > 1 and "/" not in known:
        raise BagError(f"{bag}: has robots in {', '.join(known)}: choose one by --namespace")
    return "/" if "/" in known or not known else known[0]


def mission(bag: Path, namespace: str | None = None) -> Salvaged:
    """Read a mission from a bag; a line on stderr says what is missing.

    Args:
        bag: its file.
        namespace: of the robot; that of the only one, where it is None.

    Raises:
        BagError: it holds nothing of a mission, or several robots.
    """
    found = salvage(bag, namespace=robot_of(bag, namespace))
    if not is_mission(found.record):
        raise BagError(f"{bag}: {nothing_of_a_mission(found)}")
    tell_problems(bag, gaps(found))
    return found


def tell_problems(bag: Path, problems: Collection[str]) -> None:
    """Say in one line on stderr what is wrong with a bag; nothing if nothing is."""
    if problems:
        note(f"{bag}: {'; '.join(problems)}")


def note(text: str) -> None:
    """Write one line to stderr."""
    name = click.get_current_context().find_root().info_name
    line = " ".join(f"{name}: {text}".split())
    click.echo(printable(line), err=True)


def show_json(found: Sequence[Any]) -> None:
    """Print values as JSON; numbers that JSON does not have become null."""
    click.echo(json.dumps([_plain(value) for value in found], indent=2, allow_nan=False))


def show_table(rows: Sequence[Sequence[str]], title: str = "") -> None:
    """Print rows, the first of them as heading; all columns but the first are aligned to the right."""
    if title:
        click.echo(printable(title))
    table = Table(show_header=any(rows[0]))
    for number, name in enumerate(rows[0]):
        table.add_column(Text(printable(name)), justify="right" if number else "left", overflow="fold")
    for row in rows[1:]:
        table.add_row(*(Text(printable(text)) for text in row))
    console().print(table)


def console() -> Console:
    """Return the console; for a file or a pipe, it is as wide as a table needs."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH)


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
