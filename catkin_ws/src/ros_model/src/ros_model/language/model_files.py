"""Files of models: which language one is in, and where they are."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.files import read_text
from ros_model.language.packages_reader import parse_packages
from ros_model.language.reader import parse_system

if TYPE_CHECKING:
    from ros_model.language.metamodel import RosSystem
    from ros_model.language.packages import PackageSet

PACKAGES = ".ros"
SYSTEM = ".rossystem"
"""The extensions of the languages' files."""

_FIRST_WORD = re.compile(r"(?:\s|//[^\n]*|/\*.*?\*/)*(\w*)", re.DOTALL)


def read_all(path: Path) -> RosSystem | PackageSet:
    """Read a file of either language.

    Raises:
        ModelError: it can't be read or is not well-formed.
    """
    if path.is_dir() and os.access(path, os.R_OK, effective_ids=True):
        raise ModelError(f"{path}: is a folder: give a {SYSTEM} or {PACKAGES} file")
    return parse_all(read_text(path), str(path))


def parse_all(text: str, file: str) -> RosSystem | PackageSet:
    """Read a text of either language: by the file's extension, else by its first word.

    Raises:
        ModelError: it is not well-formed.
    """
    suffix = Path(file).suffix
    match = _FIRST_WORD.match(text)
    in_packages = suffix == PACKAGES or (suffix != SYSTEM and match is not None and match[1] == "PackageSet")
    return parse_packages(text, file) if in_packages else parse_system(text, file)


def files_in(folder: Path, extension: str) -> list[Path]:
    """Return the files with an extension in a folder and below, in order; hidden folders are passed over.

    A folder below that can't be listed is among them, so that reading it tells why.

    Raises:
        ModelError: there is no such folder.
    """
    if not folder.is_dir():
        raise ModelError(f"{folder}: no such folder: check the path")
    found: list[Path] = []
    tree = os.walk(folder, onerror=lambda error: found.append(Path(error.filename)))
    for place, folders, files in tree:
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [Path(place, name) for name in files if name.endswith(extension) and not name.startswith(".")]
    return sorted(found)


def models_at(path: Path) -> list[Path]:
    """Return a file itself, or the models in a folder and below.

    Raises:
        ModelError: the folder has none.
    """
    if not path.is_dir():
        return [path]
    found = [*dict.fromkeys([*files_in(path, PACKAGES), *files_in(path, SYSTEM)])]
    if not found:
        raise ModelError(f"{path}: no model is in this folder: give one with .ros or .rossystem files")
    return found
