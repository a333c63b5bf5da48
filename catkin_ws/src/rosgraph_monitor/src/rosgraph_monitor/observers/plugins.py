"""Observer plug-ins, found through `<export><rosgraph_monitor observer="module:Class"/></export>` in package.xml."""

from __future__ import annotations

import importlib
import re
from typing import Any

from node_kit.plugins import exported

from rosgraph_monitor.observer import Observer

PACKAGE = "rosgraph_monitor"
_TARGET = re.compile(r"(?P<module>[A-Za-z_]\w*(\.[A-Za-z_]\w*)*):(?P<name>[A-Za-z_]\w*)")


class PluginError(Exception):
    """An observer could not be found or made; the message says which and why."""


def available() -> dict[str, str]:
    """Return the exported observers of all packages: `module:Class` by the name of the class."""
    found = {}
    for _, attributes in exported(PACKAGE):
        target = attributes.get("observer", "")
        if _TARGET.fullmatch(target):
            found[target.partition(":")[2]] = target
    return found


def make(name: str) -> Observer:
    """Make the observer of that name, or of an explicit `module:Class`.

    Raises:
        PluginError: no package exports it, it can't be imported, is no observer, or its constructor fails.
    """
    explicit = _TARGET.fullmatch(name)
    target = name if explicit else available().get(name)
    match = _TARGET.fullmatch(target) if target else None
    if not match:
        raise PluginError(f"observer {name!r}: no package exports it to {PACKAGE} (there are {', '.join(available())})")
    try:
        observer_class = getattr(importlib.import_module(match["module"]), match["name"])
        if not (isinstance(observer_class, type) and issubclass(observer_class, Observer)):
            raise PluginError(f"observer {name!r}: {target} is no subclass of rosgraph_monitor.observer.Observer")
        constructor: Any = observer_class  # a subclass takes the name alone, as published
        observer: Observer = constructor(match["name"])
    except PluginError:
        raise
    except (
        Exception,
        SystemExit,
    ) as error:  # a plug-in is somebody else's code: whatever it raises must not end the monitor
        raise PluginError(f"observer {name!r}: {target} fails: {type(error).__name__}: {error}") from error
    return observer
