"""Writes extracted models to their files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.file_names import safe_file_name
from ros_model.generators import write_file

if TYPE_CHECKING:
    from ros_model.language.packages import PackageSet

    from ros_model_extraction.running.graph import Models


def write_models(models: Models, folder: str | Path, name: str) -> tuple[Path, Path]:
    """Write NAME.ros and NAME.rossystem into a folder, which is made where it is missing; return their paths.

    Raises:
        ModelError: the name can't name a file, or the folder can't be written.
    """
    from ros_model.language.system_writer import write_system

    path = _path(folder, name, ".rossystem")
    text = write_system(models.system)
    packages = write_package_set(models.packages, folder, name)
    return packages, write_file(path, text, Path(folder))


def write_package_set(packages: PackageSet, folder: str | Path, name: str) -> Path:
    """Write NAME.ros into a folder, which is made where it is missing; return its path.

    Raises:
        ModelError: as write_models.
    """
    from ros_model.language.packages_writer import write_packages

    return write_file(_path(folder, name, ".ros"), write_packages(packages), Path(folder))


def _path(folder: str | Path, name: str, suffix: str) -> Path:
    return Path(folder) / (safe_file_name(name, "model") + suffix)
