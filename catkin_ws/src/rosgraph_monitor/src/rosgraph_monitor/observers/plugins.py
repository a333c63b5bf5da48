"""Observer plug-ins, found through `<export><rosgraph_monitor observer="module:Class"/></export>` in package.xml."""

from __future__ import annotations

from typing import TYPE_CHECKING

from node_kit.plugins import Plugin, PluginError, find, named

from rosgraph_monitor.observer import Observer
from rosgraph_monitor.observers import published

if TYPE_CHECKING:
    from collections.abc import Mapping

PACKAGE = "rosgraph_monitor"
_KIND = "observer"


def available() -> dict[str, str]:
    """Return the exported observers of all packages: `module:Class` by the name of the class."""
    return {name: plugin.target for name, plugin in exported().items() if not plugin.problem}


def make(name: str, known: Mapping[str, Plugin] | None = None) -> Observer:
    """Make the observer of that name, or of an explicit `module:Class`.

    Args:
        name: see above.
        known: what `exported` returned before; without it, all packages are looked through.

    Raises:
        PluginError: no package exports it, it can't be imported, is no observer, or its constructor fails.
    """
    plugin = named(PACKAGE, _KIND, name) or (exported() if known is None else known).get(name)
    if plugin is None:
        raise PluginError(f"observer {name!r}: no package exports it to {PACKAGE}: there are {', '.join(available())}")
    observer_class = published.load(plugin)
    if not (isinstance(observer_class, type) and issubclass(observer_class, Observer)):
        raise plugin.error("is no observer", "derive it from rosgraph_monitor.observer.Observer")
    with plugin.guard():
        observer: Observer = observer_class(plugin.name)  # the name alone, as published
    return observer


def exported() -> dict[str, Plugin]:
    """Return the exported observers of all packages by the name of the class, also those that can't be loaded."""
    return find(PACKAGE, _KIND, target=_KIND)
