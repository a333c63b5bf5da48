"""Names in the graph: what a name that a node uses resolves to."""

from __future__ import annotations

ABSOLUTE_TOPICS = ("/rosout", "/rosout_agg", "/clock", "/tf", "/tf_static", "/diagnostics", "/statistics")
"""Topics that the libraries of ROS open for a node, all by their absolute names, whatever its namespace."""


def resolve(name: str, node: str) -> str:
    """Return the full name of what the node with that full name calls `name`: relative, private (`~`) or global."""
    if name.startswith("/"):
        return name.rstrip("/") or "/"
    if name.startswith("~"):
        return f"{node}/{name[1:].strip('/')}".rstrip("/")
    return f"{node.rpartition('/')[0]}/{name.rstrip('/')}"
