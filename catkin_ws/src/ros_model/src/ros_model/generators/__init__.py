"""Generators: functions (project, package folder) -> written files, found through `<export>` tags of package.xml.

A package adds one with `<export><ros_model generator="NAME" function="module:function"/></export>`.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from node_kit.plugins import exported

from ros_model.errors import ModelError
from ros_model.io.files import write_file as write_file  # for generators of other packages
from ros_model.io.files import write_files as write_files

if TYPE_CHECKING:
    from ros_model.project.project import Project

Generator = Callable[["Project", Path], list[Path]]

_PACKAGE = "ros_model"


def find_generators() -> dict[str, Generator]:
    """Return the generators that packages on ROS_PACKAGE_PATH export, by name.

    Raises:
        ModelError: an export tag is incomplete, or two packages give one name.
    """
    found: dict[str, Generator] = {}
    for package, attributes in exported(_PACKAGE):
        if "generator" not in attributes:
            continue
        name, function = attributes["generator"], attributes.get("function", "")
        if name in found or not function:
            problem = "exists already: rename it" if name in found else "names no function: add one"
            raise ModelError(f"package {package}: package.xml: generator {name!r} {problem}")
        found[name] = _load(package, name, function)
    return found


def _load(package: str, name: str, function: str) -> Generator:
    """Return a generator that imports its module when it is used, so that one that is broken stops no other."""

    def generate(project: Project, output: Path) -> list[Path]:
        module, _, attribute = function.partition(":")
        try:
            found = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise ModelError(f"package {package}: generator {name!r} names {function!r}: {error}") from error
        try:
            return list(found(project, output))
        except ModelError:
            raise
        except Exception as error:  # a plug-in is somebody else's code
            problem = f"{type(error).__name__}: {error}"
            raise ModelError(f"package {package}: generator {name!r} fails: {problem}: tell its maintainer") from error

    return generate
