"""Writes extracted models to their files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.files import safe_file_name

if TYPE_CHECKING:
    from ros_model.extraction.graph import Models
    from ros_model.packages import PackageSet


def write_models(models: Models, folder: str | Path, name: str) -> tuple[Path, Path]:
    """Write NAME.ros and NAME.rossystem into a folder, which is made where it is missing; return their paths.

    Raises:
        ModelError: the name can't name a file, or the folder can't be written.
    """
    from ros_model.writer import write_system

    path = _path(folder, name, ".rossystem")
    text = write_system(models.system)
    packages = write_package_set(models.packages, folder, name)
    _write(path, text)
    return packages, path


def write_package_set(packages: PackageSet, folder: str | Path, name: str) -> Path:
    """Write NAME.ros into a folder, which is made where it is missing; return its path.

    Raises:
        ModelError: as write_models.
    """
    from ros_model.packages_writer import write_packages

    path = _path(folder, name, ".ros")
    _write(path, write_packages(packages))
    return path


def _path(folder: str | Path, name: str, suffix: str) -> Path:
    return Path(folder) / (safe_file_name(name, "model") + suffix)


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}: give a folder that can be written") from error
