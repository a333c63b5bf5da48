"""Options that several commands have."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from node_kit.yaml_text import YamlError, parse_yaml

if TYPE_CHECKING:
    from collections.abc import Callable


class Number(click.FloatRange):
    """A finite number within a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return float(number)


class _Mapping(click.ParamType):
    """A YAML mapping; its value is JSON."""

    name = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the mapping as JSON; empty for an empty one."""
        try:
            content = parse_yaml(str(value)) or {}
        except YamlError as error:
            self.fail(f"is no YAML: {error}", param, ctx)
        if not isinstance(content, dict):
            self.fail(f"{value!r} is no mapping of names to values.", param, ctx)
        return json.dumps(content, sort_keys=True) if content else ""


MAPPING = _Mapping()


def ground_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --world and --routes to a command."""
    path = click.Path(path_type=Path)
    routes = click.option("--routes", type=path, help="YAML file of routes.  [default: the factory's]")
    world = click.option("--world", type=path, help="World file, or a map's YAML file.  [default: the factory]")
    return world(routes(command))


def run_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add what every kind of mission on ROS takes: pace, folder, port, window, silence."""
    options = (
        click.option(
            "--real-time-factor",
            type=Number(0),
            default=1.0,
            show_default=True,
            help="Simulated per wall second; 0: as fast as it can.",
        ),
        click.option(
            "--output",
            type=click.Path(file_okay=False, path_type=Path),
            default=Path("results/mission"),
            show_default=True,
        ),
        click.option(
            "--port", type=click.IntRange(1, 65535), help="Of the run's own ROS master; a free one by default."
        ),
        click.option("--gui", is_flag=True, help="Show the simulator's window."),
        click.option("--quiet", is_flag=True, help="Say nothing but errors."),
    )
    for option in reversed(options):
        command = option(command)
    return command
