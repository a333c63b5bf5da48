"""Reads files of models, finds them in folders, and gathers what they declare."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.io.files import read_text
from ros_model.io.installed import InstalledPackages
from ros_model.language.any_language import PACKAGES, SYSTEM, parse_all
from ros_model.language.library import Library
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.metamodel import RosSystem
    from ros_model.language.packages import Package, PackageSet


def read_system(path: str | Path) -> RosSystem:
    """Read a `.rossystem` file.

    Raises:
        ModelError: the file can't be read or is not well-formed; says file:line:column, what was expected, near what.
    """
    return parse_system(read_text(Path(path)), str(path))


def read_packages(path: str | Path) -> PackageSet:
    """Read a `.ros` file.

    Raises:
        ModelError: the file can't be read or is not well-formed; says file:line:column, what was expected, near what.
    """
    return parse_packages(read_text(Path(path)), str(path))


def read_library(paths: Iterable[Path]) -> Library:
    """Return what `.ros` models declare, and what is installed.

    Raises:
        ModelError: one can't be read.
    """
    return Library((package for path in paths for package in read_packages(path).packages), InstalledPackages())


def read_sources(folder: Path) -> tuple[Library, list[ModelError]]:
    """Return what `.ros` models in a folder and below declare, but for those of running systems, and what is unread.

    A folder that is not there has none.
    """
    packages: list[Package] = []
    unread: list[ModelError] = []
    for path in files_in(folder, PACKAGES) if os.path.isdir(folder) else ():
        try:
            found = read_packages(path)
        except ModelError as error:
            unread.append(error)
            continue
        packages += () if found.is_observed else found.packages
    return Library(packages), unread


def read_all(path: Path) -> RosSystem | PackageSet:
    """Read a file of either language.

    Raises:
        ModelError: it can't be read or is not well-formed.
    """
    if os.path.isdir(path) and os.access(path, os.R_OK, effective_ids=True):
        raise ModelError(f"{path}: is a folder: give a {SYSTEM} or {PACKAGES} file")
    return parse_all(read_text(path), str(path))


def files_in(folder: Path, extension: str) -> list[Path]:
    """Return the files with an extension in a folder and below, in order; hidden folders are passed over.

    A folder below that can't be listed is among them, so that reading it tells why.

    Raises:
        ModelError: there is no such folder.
    """
    if not os.path.isdir(folder):
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
    if not os.path.isdir(path):
        return [path]
    found = [*dict.fromkeys([*files_in(path, PACKAGES), *files_in(path, SYSTEM)])]
    if not found:
        raise ModelError(f"{path}: no model is in this folder: give one with .ros or .rossystem files")
    return found
