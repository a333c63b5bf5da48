"""Finds and loads plug-ins, which packages on ROS_PACKAGE_PATH export in their package.xml.

    <export><rosgraph_manipulator tactic="NAME" function="MODULE:FUNCTION"/></export>

has the tag `rosgraph_manipulator`, the kind `tactic`, a name and a target. A plug-in is somebody else's code: whatever
is wrong with it becomes a PluginError, one line with the package, the export, the target, the error and the remedy.
"""

from __future__ import annotations

import contextlib
import importlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import rospkg
from catkin_pkg.package import InvalidPackage

UNREADABLE = (
    *(rospkg.InvalidManifest, rospkg.ResourceNotFound, InvalidPackage),
    *(AssertionError, ValueError, RecursionError, OSError),
)
"""What rospkg and catkin_pkg raise where a package.xml can't be read, such as one of an unknown format."""
_TARGET = re.compile(r"(?P<module>[A-Za-z_]\w*(\.[A-Za-z_]\w*)*):(?P<attribute>[A-Za-z_]\w*)")
_REMEDY = "correct it, or remove the export from package.xml"


class PluginError(Exception):
    """A plug-in can't be used; one line with the package, the export, the target, the error and the remedy."""


@dataclass(frozen=True)
class Plugin:
    """One export of a package. Only `load` imports its code."""

    package: str
    """The package that exports it; "" where somebody names the target directly."""
    tag: str
    kind: str
    name: str
    target: str
    """`module:attribute`"""
    problem: str = ""
    """Why the export alone can't be used, with the remedy."""

    def load(self) -> Any:
        """Import the target and return what it names.

        Raises:
            PluginError: the export is no good, or the target can't be imported or called.
        """
        match = _TARGET.fullmatch(self.target)
        if self.problem or match is None:
            raise PluginError(f"{self}: {self.problem or _misfit(self.target)}")
        with self.guard():
            found = getattr(importlib.import_module(match["module"]), match["attribute"])
        if not callable(found):
            raise self.error("can't be called", "name a function or a class")
        return found

    @contextlib.contextmanager
    def guard(self, *passing: type[Exception]) -> Iterator[None]:
        """Turn any exception of the plug-in's code in the `with` block into a PluginError.

        Args:
            passing: errors that are raised as they are, since they blame the plug-in's input.
        """
        try:
            yield
        except (Exception, SystemExit) as error:
            if isinstance(error, (PluginError, *passing)):
                raise
            raise self.error(f"fails: {type(error).__name__}: {error}") from error

    def error(self, problem: str, remedy: str = _REMEDY) -> PluginError:
        """Return the error that says that the target has a problem."""
        return PluginError(" ".join(f"{self}: {self.target} {problem}: {remedy}".split()))

    def __str__(self) -> str:
        """Return the place of the export."""
        where = f"package {self.package}: package.xml: " if self.package else ""
        return f"{where}<{self.tag} {self.kind}={self.name!r}>"


def find(tag: str, kind: str, target: str = "function") -> dict[str, Plugin]:
    """Return the exports of one kind, by name, in the order of the packages' names.

    If several exports have the same name, the entry of that name can't be loaded.

    Args:
        tag: name of the export's element.
        kind: attribute with the plug-in's name.
        target: attribute with the target. Where it is that of the name, the plug-in is called as the target's class.
    """
    found: dict[str, Plugin] = {}
    for package, attributes in _exported(tag):
        if kind not in attributes:
            continue
        where = attributes.get(target, "")
        name = where.partition(":")[2] or where if target == kind else attributes[kind]
        plugin = Plugin(package, tag, kind, name, where, problem="" if _TARGET.fullmatch(where) else _misfit(where))
        if name in found:
            problem = f"package {found[name].package} exports one of that name, too: rename one of them"
            plugin = replace(plugin, problem=problem)
        found[name] = plugin
    return found


def named(tag: str, kind: str, target: str) -> Plugin | None:
    """Return the plug-in of a target such as `module:Class`; None if the text is not a target."""
    match = _TARGET.fullmatch(target)
    return Plugin("", tag, kind, match["attribute"], target) if match else None


def _misfit(target: str) -> str:
    return f"{target!r} is no target: name one as MODULE:ATTRIBUTE"


def _exported(tag: str) -> Iterator[tuple[str, Mapping[str, str]]]:
    """Yield (package, attributes) of every `<export><TAG .../></export>`, in the order of the packages' names.

    A package.xml that can't be read is skipped: somebody else's broken package must not stop us.
    """
    packages = rospkg.RosPack()
    for package in sorted(packages.list()):
        if not _may_have(tag, Path(packages.get_path(package), "package.xml")):
            continue
        try:
            exports = packages.get_manifest(package).exports
        except UNREADABLE:
            continue
        for export in exports:
            if export.tag == tag:
                yield package, export.attrs


def _may_have(tag: str, manifest: Path) -> bool:
    """Return whether a package.xml may have an element: parsing that of every package takes ten times as long."""
    try:
        return f"<{tag}".encode() in manifest.read_bytes()
    except OSError:
        return True  # a manifest.xml in its place, say
