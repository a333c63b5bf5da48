"""What the commands `./mros soak` have in common: arguments, what names the code, and figures that are added to."""

from __future__ import annotations

import argparse
import json
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from node_kit.io.output_files import write_file

Figures = TypeVar("Figures")

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "results/soak"


class Arguments(argparse.ArgumentParser):
    """The arguments of a soak; wrong ones are told in one line."""

    def __init__(self, description: str | None) -> None:
        super().__init__(prog="./mros soak", description=description, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        """End with one line."""
        self.exit(2, f"mros: soak: {message}\n")


def whole(what: str, least: int) -> Callable[[str], int]:
    """Return what makes a whole number of an argument.

    Args:
        what: it is, for the line that refuses another one.
        least: that it may be.
    """

    def read(text: str) -> int:
        number = int(text)
        if number < least:
            raise ValueError
        return number

    read.__name__ = what
    return read


def hours(text: str) -> float:
    """Return the number of hours of an argument."""
    found = float(text)
    if not (math.isfinite(found) and found > 0.0):
        raise ValueError
    return found


hours.__name__ = "number of hours"


def code(*places: str) -> str:
    """Return what names the code: files and folders of the project, as git has them, but for documents."""
    places = (*places, ":(exclude)*.md")
    told = ["git", "-C", str(ROOT), "ls-files", "-s", "--", *places]
    changed = ["git", "-C", str(ROOT), "diff", "HEAD", "--", *places]
    try:
        texts = [subprocess.run(one, capture_output=True, check=True).stdout for one in (told, changed)]
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    hashed = subprocess.run(["git", "hash-object", "--stdin"], input=b"".join(texts), capture_output=True, check=True)
    return hashed.stdout.decode()[:10]


class FiguresError(Exception):
    """A file of figures can't be used; the message names it and says why."""


def write_figures(path: Path, content: dict[str, Any]) -> None:
    """Write figures, at once or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, json.dumps(content, indent=1) + "\n")


def read_figures(path: Path, make: Callable[[dict[str, Any]], Figures]) -> Figures:
    """Read figures that `write_figures` has written, and make what holds them.

    Raises:
        FiguresError: the file has another form.
    """
    try:
        return make(json.loads(path.read_text()))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise FiguresError(f"{path} has no figures of a soak ({error}): delete it") from error
