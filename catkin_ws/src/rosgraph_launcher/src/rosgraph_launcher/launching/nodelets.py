"""Nodelets: a node `nodelet load` only asks a manager, which is another process, to run the nodelet, and waits."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping
from dataclasses import replace

from rosgraph_launcher.description import NodeDescription


def unloading(node: NodeDescription) -> NodeDescription | None:
    """Return the node that has a nodelet's manager unload what a loader has left there; None: the node loads nothing.

    A manager refuses to load a nodelet that it still has. It should drop that of a loader that was killed when their
    bond breaks, but may keep it for ever (https://github.com/ros/nodelet_core/issues/100).
    """
    manager = _manager(node)
    if not manager:
        return None
    return replace(
        node, name=f"{node.name}_unload", args=shlex.join(("unload", node.name, manager)), launch_prefix=None
    )


def loaders(nodes: Mapping[str, NodeDescription], managers: Collection[str]) -> list[str]:
    """Return the nodes whose nodelets run in one of these managers, and are gone when it ends.

    Args:
        nodes: by full name.
        managers: full names.
    """
    return [name for name, node in nodes.items() if _full_name(_manager(node), node) in managers]


def _manager(node: NodeDescription) -> str:
    """Return the manager into which a node loads a nodelet, as the node names it; empty where it loads none."""
    if (node.package, node.executable) != ("nodelet", "nodelet"):
        return ""
    try:
        words = [word for word in shlex.split(node.args) if not word.startswith("--") and ":=" not in word]
    except ValueError:
        return ""
    return words[2] if len(words) > 2 and words[0] == "load" else ""


def _full_name(name: str, node: NodeDescription) -> str:
    """Return the full name that a name has for a node, after its remaps; empty for an empty name."""
    full = _resolved(name, node.namespace) if name else ""
    remaps = {_resolved(old, node.namespace): _resolved(new, node.namespace) for old, new in node.remaps}
    return remaps.get(full, full)


def _resolved(name: str, namespace: str) -> str:
    return name if name.startswith(("/", "~")) else f"{namespace.rstrip('/')}/{name}"
