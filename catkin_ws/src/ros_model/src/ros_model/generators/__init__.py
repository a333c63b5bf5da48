"""Generators: functions (project, package folder) -> written files, found through `<export>` tags of package.xml.

A package adds one with `<export><ros_model generator="NAME" function="module:function"/></export>`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from node_kit.plugins import Plugin, PluginError, find

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
    plugins = find(_PACKAGE, "generator")
    for plugin in plugins.values():
        if plugin.problem:
            raise ModelError(f"{plugin}: {plugin.problem}")
    return {name: _generator(plugin) for name, plugin in plugins.items()}


def _generator(plugin: Plugin) -> Generator:
    """Return a generator that imports its module when it is used, so that one that is broken stops no other."""

    def generate(project: Project, output: Path) -> list[Path]:
        try:
            found = plugin.load()
            with plugin.guard(ModelError):
                return list(found(project, output))
        except PluginError as error:
            raise ModelError(str(error)) from error

    return generate
