"""Names of nodes, topics and executables, between the graph and the models."""

from __future__ import annotations


def split_name(name: str) -> tuple[str, str]:
    """Return a resolved name's namespace ("" for the root) and its last part: `/robot/camera` -> `/robot`, `camera`."""
    namespace, _, base = name.rpartition("/")
    return namespace, base


def as_seen_from(node: str, name: str) -> str:
    """Return a resolved name as a node in its namespace would write it: relative where it can, else with the slash."""
    namespace, _ = split_name(node)
    inside = f"{namespace}/"
    return name.removeprefix(inside) if name.startswith(inside) and name != inside else name


def node_name(text: str) -> str:
    """Return the name of a node of a model for a name in the graph or a file's: `talker.py` -> `talker`."""
    return text.removesuffix(".py").replace(".", "_") or "_"


def is_known_type(type_name: str) -> bool:
    """Return whether a topic's type says anything: the master has `*` or nothing where no publisher told."""
    return type_name.count("/") == 1 and not type_name.startswith("*")
