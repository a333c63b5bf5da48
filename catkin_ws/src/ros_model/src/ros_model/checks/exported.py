"""Checks of a project that other packages export: what they make of its settings, they know themselves.

A package adds one with `<export><ros_model check="NAME" function="module:function"/></export>`: a function project ->
findings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from node_kit.plugins import PluginError, find

from ros_model.findings import WARNING, Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.project.project import Project

_PACKAGE = "ros_model"


def exported_findings(project: Project) -> Iterator[Finding]:
    """Yield what the checks of other packages find in a project; a check that fails is a warning."""
    for plugin in find(_PACKAGE, "check").values():
        try:
            with plugin.guard():
                found = list(plugin.load()(project))
        except PluginError as error:
            yield Finding(str(error), project.source.at(), "settings", WARNING)
        else:
            yield from found
