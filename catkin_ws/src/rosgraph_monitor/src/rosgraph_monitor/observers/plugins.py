"""Observer plug-ins, found through `<export><rosgraph_monitor observer="module:Class"/></export>` in package.xml."""

from __future__ import annotations

from node_kit.plugins import Plugin, PluginError, find, named

from rosgraph_monitor.observer import Observer
from rosgraph_monitor.observers import published

PACKAGE = "rosgraph_monitor"
_KIND = "observer"


def available() -> dict[str, str]:
    """Return the exported observers of all packages: `module:Class` by the name of the class."""
    return {name: plugin.target for name, plugin in _exported().items() if not plugin.problem}


def make(name: str) -> Observer:
    """Make the observer of that name, or of an explicit `module:Class`.

    Raises:
        PluginError: no package exports it, it can't be imported, is no observer, or its constructor fails.
    """
    plugin = named(PACKAGE, _KIND, name) or _exported().get(name)
    if plugin is None:
        raise PluginError(f"observer {name!r}: no package exports it to {PACKAGE}: there are {', '.join(available())}")
    observer_class = published.load(plugin)
    if not (isinstance(observer_class, type) and issubclass(observer_class, Observer)):
        raise plugin.error("is no observer", "derive it from rosgraph_monitor.observer.Observer")
    with plugin.guard():
        observer: Observer = observer_class(plugin.name)  # the name alone, as published
    return observer


def _exported() -> dict[str, Plugin]:
    return find(PACKAGE, _KIND, target=_KIND)
