"""Reading the ground of missions: the files of a world and of its routes."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from node_kit.io.input_files import InputFileError, read_bytes, read_yaml
from pybullet_simulator.io.map_file import MAX_IMAGE_SIZE
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.world import WorldError, rasterise

from metacontrol_experiments.io.input_files import read_route, simulation_package
from metacontrol_experiments.mission.ground import FACTORY, Ground, check_route
from metacontrol_experiments.mission.routes import RouteError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from metacontrol_experiments.mission.routes import Route

_DIGITS = 12
"""Of a digest that are kept."""


def read_ground(world: Path | None, routes: Path | None) -> Ground:
    """Return the ground that two files describe; each is that of the factory by default.

    Raises:
        RouteError: a file cannot be read.
    """
    named = [path for path in (world, routes) if path is not None]
    if not named:
        return FACTORY
    digest = hashlib.sha256()
    try:
        for path in named:
            digest.update(read_bytes(path))
        image = _image_of(world) if world is not None else None
    except InputFileError as error:
        raise RouteError(str(error)) from error
    if image is not None:
        try:
            digest.update(read_bytes(image, MAX_IMAGE_SIZE))
        except InputFileError as error:
            raise RouteError(f"{world}: image: {error}") from error
    return Ground(world, routes, " ".join([*(path.name for path in named), digest.hexdigest()[:_DIGITS]]))


def routes_file(ground: Ground) -> Path:
    """Return the file of the routes of a ground.

    Raises:
        PackageError: metacontrol_sim is not there.
    """
    return ground.routes or simulation_package() / "worlds" / "routes.yaml"


def read_routes(ground: Ground, names: Iterable[str]) -> dict[str, Route]:
    """Return routes of a ground by their names, after a check that the robot can stand at both of their ends.

    Raises:
        PackageError: metacontrol_sim is not there.
        RouteError: the world cannot be used, there is no such route, or the robot cannot stand at one of its ends.
    """
    file, world = routes_file(ground), ground.world or simulation_package() / "worlds" / "factory.yaml"
    routes = {name: read_route(file, name) for name in names}
    try:
        grid = rasterise(read_world(world))
    except WorldError as error:
        raise RouteError(str(error)) from error
    for route in routes.values():
        check_route(route, grid, str(file), str(world))
    return routes


def _image_of(world: Path) -> Path | None:
    """Return the image of a map; None for another world.

    Raises:
        InputFileError: the file cannot be read.
    """
    content = read_yaml(world)
    image = content.get("image") if isinstance(content, dict) else None
    return world.parent / image if isinstance(image, str) else None
