"""Names in the graph: what a name that a node uses resolves to."""

from __future__ import annotations


def resolve(name: str, node: str) -> str:
    """Return the full name of what the node with that full name calls `name`: relative, private (`~`) or global."""
    if name.startswith("/"):
        return name.rstrip("/") or "/"
    if name.startswith("~"):
        return f"{node}/{name[1:].strip('/')}".rstrip("/")
    return f"{node.rpartition('/')[0]}/{name.rstrip('/')}"
