"""Which node is behind a component, as a project's metacontrol.yaml maps them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


class ComponentError(ValueError):
    """A component that nobody knows; the message names the file and those it has."""


def read_components(path: Path) -> dict[str, str]:
    """Return component name -> node.

    Raises:
        ComponentError: the file cannot be read.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ComponentError(f"{path}: cannot be read as YAML: {' '.join(str(error).split())}") from error
    components = content.get("components") if isinstance(content, dict) else None
    return {
        str(name): str(entry["node"])
        for name, entry in (components.items() if isinstance(components, dict) else ())
        if isinstance(entry, dict) and "node" in entry
    }


def node_of(target: str, components: Mapping[str, str]) -> str:
    """Return the node of a component; a name that begins with / is a node already.

    Raises:
        ComponentError: there is no such component.
    """
    if target.startswith("/"):
        return target
    if target not in components:
        known = ", ".join(components) or "none"
        raise ComponentError(f"no component {target!r}; there are {known}; a node's name begins with /")
    return components[target]
