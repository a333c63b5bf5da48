"""Generators: functions (project, package folder) -> written files, found through `<export>` tags of package.xml.

A package adds one with `<export><ros_model generator="NAME" function="module:function"/></export>` and a dependency
on ros_model.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg

from ros_model.errors import ModelError

if TYPE_CHECKING:
    from ros_model.project import Project

Generator = Callable[["Project", Path], list[Path]]

_PACKAGE = "ros_model"


def find_generators() -> dict[str, Generator]:
    """Return the generators of all packages on ROS_PACKAGE_PATH that depend on this one, by name.

    Raises:
        ModelError: an export tag is wrong, or two packages give one name.
    """
    packages = rospkg.RosPack()
    try:
        names = [_PACKAGE, *sorted(set(packages.get_depends_on(_PACKAGE, implicit=False)) - {_PACKAGE})]
        manifests = {name: packages.get_manifest(name) for name in names}
    except (rospkg.ResourceNotFound, rospkg.InvalidManifest) as error:
        raise ModelError(f"can't look for generators: {error}: source the workspace that holds {_PACKAGE}") from error
    found: dict[str, Generator] = {}
    for package, manifest in manifests.items():
        exports = zip(
            manifest.get_export(_PACKAGE, "generator"), manifest.get_export(_PACKAGE, "function"), strict=False
        )
        for name, function in exports:
            if name in found:
                raise ModelError(f"package {package}: a generator {name!r} exists already: rename the export")
            found[name] = _load(package, name, function)
    return found


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
        raise ModelError(f"{path}: {error.strerror or error}: check the folder given with -o") from error
    return path


def _load(package: str, name: str, function: str) -> Generator:
    """Return a generator that imports its module when it is used, so that one that is broken stops no other."""

    def generate(project: Project, output: Path) -> list[Path]:
        module, _, attribute = function.partition(":")
        try:
            found = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise ModelError(f"package {package}: generator {name!r} names {function!r}: {error}") from error
        return list(found(project, output))

    return generate
