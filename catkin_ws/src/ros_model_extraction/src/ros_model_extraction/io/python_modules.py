"""Finds Python modules in the source of packages, and reads each once."""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg
from ros_model.language.metamodel import Position

from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.node_facts import Remark, SourceError
from ros_model_extraction.python.bindings import index
from ros_model_extraction.python.modules import Module

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_MAX_PARTS = 50
"""Parts of a module's name, `a.b.c`; published ones have some five, and each part is looked up, with all before it."""


class Library:
    """Finds modules in the source of packages, and reads each once."""

    def __init__(self, folders: Sequence[Path], package_folder: Path, package: str = "") -> None:
        """Search these folders, then the sources of installed packages.

        Args:
            folders: where top-level modules lie.
            package_folder: positions name files relative to it.
            package: its name; it may have messages, and need not be installed.
        """
        self._package = package
        self.remarks: list[Remark] = []
        self._folders = list(folders)
        self._beside: Path | None = None  # the folder of the script, which Python searches first
        self._package_folder = package_folder
        self._modules: dict[str, Module | None] = {}
        self._packages = rospkg.RosPack()

    def script(self, path: Path) -> Module:
        """Read an executable.

        Raises:
            SourceError: it can't be read, or is no Python.
        """
        module = self._read(path, "__main__", is_package=False)
        module.is_script = True
        self._beside = path.parent
        return module

    def module(self, name: str) -> Module | None:
        """Return a module by its full name; None for one that has no source here, or can't be read (a remark says)."""
        if name not in self._modules:
            self._modules[name] = None
            path = self._find(name) if name and name.count(".") < _MAX_PARTS else None
            if path:
                try:
                    self._modules[name] = self._read(path, name, path.name == "__init__.py")
                except SourceError as error:
                    self.remarks.append(error.remark)
        return self._modules[name]

    def has_message(self, source: str, name: str) -> bool:
        """Return whether this or an installed package defines a message or service: `std_msgs.msg`, `String`."""
        package, _, kind = source.partition(".")
        if kind not in ("msg", "srv"):
            return False
        try:
            folder = self._package_folder if package == self._package else Path(self._packages.get_path(package))
        except rospkg.ResourceNotFound:
            return False
        action = re.sub(r"(Action)?(Goal|Result|Feedback)?$", "", name).removesuffix("Action")
        files = (folder / kind / f"{name}.{kind}", folder / "action" / f"{action}.action")
        return any(os.path.isfile(file) for file in files)

    def _find(self, name: str) -> Path | None:
        relative = Path(*name.split("."))
        for folder in self._roots(name.partition(".")[0]):
            for candidate in (folder / relative / "__init__.py", (folder / relative).with_suffix(".py")):
                if os.path.isfile(candidate):  # False where the folder can't be entered
                    return candidate
        return None

    def _roots(self, package: str) -> Iterator[Path]:
        if self._beside:
            yield self._beside
        yield from self._folders
        try:
            yield Path(self._packages.get_path(package)) / "src"
        except rospkg.ResourceNotFound:
            return

    def _read(self, path: Path, name: str, is_package: bool) -> Module:
        shown = str(path)
        for folder in (self._package_folder, self._package_folder.parent):
            if path.is_relative_to(folder):
                shown = str(path.relative_to(folder))
                break
        tree = parse(read_source(path, shown), shown)
        module = Module(name, path, shown, tree, is_package)
        index(module)
        return module


def parse(data: bytes, shown: str) -> ast.Module:
    """Return the syntax tree of Python source.

    Raises:
        SourceError: it is no Python.
    """
    try:
        return ast.parse(data, shown)
    except SyntaxError as error:
        position = Position(shown, error.lineno or 1, error.offset or 1)
        raise SourceError(Remark(position, f"not read: no Python 3: {error.msg}")) from error
    except (ValueError, RecursionError, MemoryError) as error:
        text = f"not read: no Python 3: {error or type(error).__name__}"
        raise SourceError(Remark(Position(shown, 1, 1), text)) from error
