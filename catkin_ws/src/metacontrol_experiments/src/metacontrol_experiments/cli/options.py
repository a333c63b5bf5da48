"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable


def ground_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --world and --routes to a command."""
    path = click.Path(path_type=Path)
    routes = click.option("--routes", type=path, help="YAML file of routes.  [default: the factory's]")
    world = click.option("--world", type=path, help="World file, or a map's YAML file.  [default: the factory]")
    return world(routes(command))
