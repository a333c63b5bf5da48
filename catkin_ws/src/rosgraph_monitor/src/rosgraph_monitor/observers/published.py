"""Loads observers that were published for MROS: gives them modules that they import and that are not installed.

These are the parser and the generator of models under their published names, and modules beside the observer, which
Python 2 imported without their package's name. A module that is installed always comes first.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from node_kit.plugins import PluginError

if TYPE_CHECKING:
    from node_kit.plugins import Plugin

_OURS = {
    "ros_model_parser": {"rossystem_parser": "rosgraph_monitor.parser"},
    "ros_model_generator": {"rossystem_generator": "rosgraph_monitor.system_generator"},
}
"""Package that published observers import -> its module -> ours."""


def load(plugin: Plugin) -> Any:
    """Return the class of an observer.

    Raises:
        PluginError: it can't be imported, also with the modules that are given here.
    """
    siblings: list[str] = []
    try:
        while True:
            try:
                return plugin.load()
            except PluginError as error:
                missing = _missing(error)
                if not missing or missing in siblings or not _give(missing, plugin, siblings):
                    raise
    finally:  # another observer has siblings of its own
        for name in siblings:
            sys.modules.pop(name, None)


def _missing(error: PluginError) -> str:
    """Return the name of the module that an import did not find; "" where that was not the reason."""
    cause = error.__cause__
    return (cause.name or "") if isinstance(cause, ModuleNotFoundError) else ""


def _give(missing: str, plugin: Plugin, siblings: list[str]) -> bool:
    """Put a module that was not found among the imported ones; return whether there is one.

    Raises:
        PluginError: it is beside the observer, and imports what is nowhere.
    """
    if missing in _OURS:
        package = ModuleType(missing)
        package.__path__ = []
        sys.modules[missing] = package
        for name, ours in _OURS[missing].items():
            module = importlib.import_module(ours)
            setattr(package, name, module)
            sys.modules[f"{missing}.{name}"] = module
        return True
    around = plugin.target.partition(":")[0].rpartition(".")[0]
    if not around or "." in missing:
        return False
    siblings.append(missing)
    try:
        sys.modules[missing] = importlib.import_module(f"{around}.{missing}")
    except ModuleNotFoundError as error:
        other = error.name or ""
        if other == f"{around}.{missing}":
            return False
        if other in siblings or not _give(other, plugin, siblings):
            raise plugin.error(f"fails: {type(error).__name__}: {error}") from error
        siblings.remove(missing)
        return _give(missing, plugin, siblings)
    return True
