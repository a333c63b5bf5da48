"""Reads and writes files, and finds those that are named by a plain path or `package://PACKAGE/path`."""

from __future__ import annotations

import codecs
import stat
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg

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
        return Path(text).expanduser().resolve()
    package, _, relative = text.removeprefix(_SCHEME).partition("/")
    root = _package_folder(text, package)
    path = (root / relative).resolve()
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
        about = path.stat()
        if stat.S_ISFIFO(about.st_mode) or stat.S_ISCHR(about.st_mode) or stat.S_ISSOCK(about.st_mode):
            raise ModelError(f"{path}: is no regular file: give the path of one")
        if about.st_size > MAX_SIZE:
            raise ModelError(f"{about.st_size} bytes are too many ({MAX_SIZE})", Position(str(path), 1, 1))
        data = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        raise ModelError(f"{path}: {getattr(error, 'strerror', None) or error}: check the path") from error
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        good = data[: error.start].decode("utf-8-sig")
        position = Position(str(path), good.count("\n") + 1, len(good) - (good.rfind("\n") + 1) + 1)
        found = "it looks like UTF-16: " if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else ""
        raise ModelError(
            f"byte 0x{data[error.start]:02x} is not UTF-8: {found}save the file as UTF-8 text", position
        ) from error


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
    if not path.resolve().is_relative_to(root.resolve()):
        raise ModelError(f"{path}: leaves the folder {root}: nothing is written there")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModelError(f"{path}: can't be written ({error.strerror or error}): check its folder") from error
    return path


def _package_folder(uri: str, package: str) -> Path:
    """Return a package's folder; all folders of ROS_PACKAGE_PATH are searched once, and again for a package not found.

    A search takes 20 ms with the packages of this project.
    """
    for packages in (rospkg.RosPack.get_instance(), rospkg.RosPack()):
        try:
            folder = Path(packages.get_path(package)).resolve()
        except rospkg.ResourceNotFound:
            continue
        if folder.is_dir():
            return folder
    raise ModelError(f"{uri}: no package {package!r}: source the workspace that holds it")
