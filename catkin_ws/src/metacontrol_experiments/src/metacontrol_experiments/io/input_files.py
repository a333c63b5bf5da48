"""Reading the files that say what a mission is: routes, contingencies, components."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import rospkg
from node_kit.io.input_files import InputFileError, read_yaml

from metacontrol_experiments.contingency.contingency import Contingency
from metacontrol_experiments.contingency.parsing import (
    ComponentError,
    ContingencyError,
    parse_components,
    parse_contingencies,
)
from metacontrol_experiments.mission.routes import Route, RouteError, parse_route, parse_route_names

SIMULATION = "metacontrol_sim"


class PackageError(RuntimeError):
    """A package is not there; the message says what to do."""


def simulation_package() -> Path:
    """Return the folder of metacontrol_sim.

    Raises:
        PackageError: it is not there.
    """
    try:
        return Path(rospkg.RosPack.get_instance().get_path(SIMULATION))
    except rospkg.ResourceNotFound as error:
        raise PackageError(f"package {SIMULATION} not found; source the workspace's devel/setup.bash first") from error


def read_route(path: Path, name: str) -> Route:
    """Read one route.

    Raises:
        RouteError: the file cannot be read, has no such route, or the route lacks a valid start or goal.
    """
    return parse_route(_content(path, RouteError), name, str(path))


def route_names(path: Path) -> list[str]:
    """Return the names of the routes of a file, in its order.

    Raises:
        RouteError: the file cannot be read.
    """
    return parse_route_names(_content(path, RouteError))


def read_contingencies(path: Path) -> tuple[Contingency, ...]:
    """Return the contingencies of a YAML file.

    Raises:
        ContingencyError: the file cannot be read, or an entry makes no sense.
    """
    return parse_contingencies(_content(path, ContingencyError), str(path))


def read_components(path: Path) -> dict[str, str]:
    """Return component name -> node, as a project's metacontrol.yaml maps them.

    Raises:
        ComponentError: the file cannot be read.
    """
    return parse_components(_content(path, ComponentError))


def _content(path: Path, failure: type[ValueError]) -> Any:
    """Return the content of a YAML file; raise `failure` where it cannot be read."""
    try:
        return read_yaml(path)
    except InputFileError as error:
        raise failure(str(error)) from error
