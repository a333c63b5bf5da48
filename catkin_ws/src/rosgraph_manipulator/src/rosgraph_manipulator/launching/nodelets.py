"""Nodelets: a node `nodelet load` only asks a manager, which is another process, to run the nodelet, and waits."""

from __future__ import annotations

import shlex
from dataclasses import replace

from rosgraph_manipulator.configuration.description import NodeDescription


def unloading(node: NodeDescription) -> NodeDescription | None:
    """Return the node that has a nodelet's manager unload what a loader has left there; None: the node loads nothing.

    A manager refuses to load a nodelet that it still has. It should drop that of a loader that was killed when their
    bond breaks, but may keep it for ever (https://github.com/ros/nodelet_core/issues/100).
    """
    if (node.package, node.executable) != ("nodelet", "nodelet"):
        return None
    try:
        words = [word for word in shlex.split(node.args) if not word.startswith("--") and ":=" not in word]
    except ValueError:
        return None
    if len(words) < 3 or words[0] != "load":
        return None
    return replace(
        node, name=f"{node.name}_unload", args=shlex.join(("unload", node.name, words[2])), launch_prefix=None
    )
