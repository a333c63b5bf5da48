"""Brings the parameters of costmaps into one form: a list of layers, and each layer's parameters in its own group.

Three facts of costmap_2d are carried over. A costmap without `plugins` has parameters of the time before Hydro, and its
layers follow from them. Some parameters of the costmap itself replace those of its layers. Some parameters that are not
given are looked for in the levels above.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

from node_kit.parameters import ParameterTree

if TYPE_CHECKING:
    from collections.abc import Mapping

COSTMAPS = ("global_costmap", "local_costmap")

_SHAPES, _SOURCE_RANGES = ("footprint", "robot_radius"), ("obstacle_range", "raytrace_range")

STATIC, OBSTACLE = "costmap_2d::StaticLayer", "costmap_2d::ObstacleLayer"
VOXEL, INFLATION = "costmap_2d::VoxelLayer", "costmap_2d::InflationLayer"

_VOXELS = ("origin_z", "z_resolution", "z_voxels", "mark_threshold", "unknown_threshold", "publish_voxel_map")
_RANGES = ("max_obstacle_height", "raytrace_range", "obstacle_range", "track_unknown_space")

_OF_THE_COSTMAP = {
    STATIC: ("map_topic", "unknown_cost_value", "lethal_cost_threshold", "track_unknown_space"),
    VOXEL: _VOXELS,
    OBSTACLE: _RANGES,
    INFLATION: ("cost_scaling_factor", "inflation_radius"),
}
"""Parameters of the costmap that replace those of its layers, by the layers' type."""


def with_layers(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of move_base with the layers of both costmaps listed and filled; the tree given stays.

    Raises:
        ParameterError: a costmap or a layer is no group of parameters.
    """
    new = copy.deepcopy(dict(tree))
    top = ParameterTree(new)
    for name in COSTMAPS:
        costmap = dict(top.child(name).values)
        if "plugins" not in costmap:
            _list_layers(costmap, top.child(name))
        _fill_layers(costmap, top.child(name))
        new[name] = costmap
    return new


def sought_above(tree: Mapping[str, Any]) -> list[str]:
    """Return the parameters to look for above the node's namespace: those that a costmap or a source lacks.

    Raises:
        ParameterError: a costmap or a layer is no group of parameters.
    """
    top = ParameterTree(with_layers(tree))
    names: dict[str, None] = {}
    for costmap in (top.child(name) for name in COSTMAPS):
        if not any(level.has(name) for name in _SHAPES for level in (costmap, top)):
            names.update(dict.fromkeys(_SHAPES))
        layers = [costmap.child(name) for name, value in costmap.values.items() if isinstance(value, dict)]
        for layer in layers:
            for source in layer.text("observation_sources").split():
                levels = (layer.child(source), layer, costmap, top)
                lacking = [name for name in _SOURCE_RANGES if not any(level.has(name) for level in levels)]
                names.update(dict.fromkeys(lacking))
    return list(names)


def is_old(tree: Mapping[str, Any], costmap: str) -> bool:
    """Return whether a costmap's parameters are of the time before Hydro: they list no layers."""
    return "plugins" not in ParameterTree(tree).child(costmap).values


def _list_layers(costmap: dict[str, Any], given: ParameterTree) -> None:
    """List the layers that parameters without `plugins` mean, and move the parameters to them."""
    layers = []
    if given.flag("static_map", False):
        layers.append({"name": "static_layer", "type": STATIC})
        _move(costmap, given, "static_layer", ("map_topic", "unknown_cost_value", "lethal_cost_threshold"))
        _copy(costmap, given, "static_layer", ("track_unknown_space",))
    kind = VOXEL if given.text("map_type") == "voxel" else OBSTACLE
    layers.append({"name": "obstacle_layer", "type": kind})
    sources = given.text("observation_sources").split()
    _move(costmap, given, "obstacle_layer", (*_VOXELS, *_RANGES, *sources, "observation_sources"))
    layers.append({"name": "inflation_layer", "type": INFLATION})
    _move(costmap, given, "inflation_layer", _OF_THE_COSTMAP[INFLATION])
    costmap["plugins"] = layers


def _fill_layers(costmap: dict[str, Any], given: ParameterTree) -> None:
    """Move the costmap's own parameters to the layers that they are for."""
    layers = [entry for entry in given.items("plugins", costmap["plugins"]) if isinstance(entry, dict)]
    taken = set()
    for entry in layers:
        layer = str(entry.get("name"))
        if not isinstance(costmap.get(layer, {}), dict):
            costmap[layer] = {}  # some robots have a layer static_map beside the former parameter static_map: true
        names = [name for name in _OF_THE_COSTMAP.get(str(entry.get("type")), ()) if name in costmap]
        if names:
            _copy(costmap, given, layer, names)
            taken.update(names)
    for name in taken:
        del costmap[name]


def _move(costmap: dict[str, Any], given: ParameterTree, layer: str, names: tuple[str, ...]) -> None:
    _copy(costmap, given, layer, names)
    for name in names:
        costmap.pop(name, None)


def _copy(costmap: dict[str, Any], given: ParameterTree, layer: str, names: Any) -> None:
    values = dict(ParameterTree(costmap, given.full_name("").rstrip("/")).child(layer).values)
    values.update({name: costmap[name] for name in names if name in costmap})
    costmap[layer] = values
