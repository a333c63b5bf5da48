"""Reads and writes files, and finds those that are named by a plain path or `package://PACKAGE/path`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import rospkg
from node_kit.io import input_files, output_files
from node_kit.io.input_files import InputFileError, real_path

from ros_model.errors import ModelError
from ros_model.language.metamodel import MAX_SIZE, Position

if TYPE_CHECKING:
    from collections.abc import Mapping

_SCHEME = "package://"


def resolve(uri: str | Path) -> Path:
    """Return the absolute path that a plain path or `package://PACKAGE/path` names; it need not exist.

    Raises:
        ModelError: the package is unknown, or the path leaves the package.
    """
    text = str(uri)
    if not text or "\0" in text:
        raise ModelError(f"{text!r} is no file name: give a path or package://PACKAGE/path")
    if not text.startswith(_SCHEME):
        if "://" in text:
            raise ModelError(f"{text}: only plain paths and package://PACKAGE/path are known")
        try:
            return real_path(Path(text).expanduser())
        except RuntimeError as error:  # there is no such user
            raise ModelError(f"{text}: {error}: give another path") from error
    package, _, relative = text.removeprefix(_SCHEME).partition("/")
    root = _package_folder(text, package)
    path = real_path(root / relative)
    if not relative or relative.startswith("/") or not path.is_relative_to(root):
        raise ModelError(f"{text}: must name a file inside the package {package} ({root})")
    return path


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises:
        ModelError: the file is missing, unreadable, too large, no regular file, or not UTF-8; then with the position
            of the first bad byte.
    """
    try:
        return input_files.read_text(path, MAX_SIZE)
    except InputFileError as error:
        if error.place is None:
            raise ModelError(f"{path}: {error.problem}") from error
        raise ModelError(error.problem, Position(str(path), *error.place)) from error


def write_files(texts: Mapping[Path, str], root: Path) -> list[Path]:
    """Write generated files, all of whose texts are known before the first is written; return their paths.

    Raises:
        ModelError: as write_file.
    """
    return [write_file(path, text, root) for path, text in texts.items()]


def write_file(path: Path, text: str, root: Path) -> Path:
    """Write a generated file, UTF-8, where it does not leave the root; return its path.

    Raises:
        ModelError: the path is outside the root, or can't be written.
    """
    if not real_path(path).is_relative_to(real_path(root)):
        raise ModelError(f"{path}: leaves the folder {root}: nothing is written there")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write_file(path, text)
    except OSError as error:
        raise ModelError(f"{path}: can't be written ({error.strerror or error}): check its folder") from error
    return path


def _package_folder(uri: str, package: str) -> Path:
    """Return a package's folder; all folders of ROS_PACKAGE_PATH are searched once, and again for a package not found.

    A search takes 20 ms with the packages of this project.
    """
    for packages in (rospkg.RosPack.get_instance(), rospkg.RosPack()):
        try:
            folder = real_path(packages.get_path(package))
        except rospkg.ResourceNotFound:
            continue
        if folder.is_dir():
            return folder
    raise ModelError(f"{uri}: no package {package!r}: source the workspace that holds it")
