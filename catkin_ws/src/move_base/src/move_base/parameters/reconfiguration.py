"""Parameters that change while move_base runs: their servers and their present values.

The servers and the names of their parameters are those of ROS Navigation; the definitions are in cfg/.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from node_kit.parameters import ParameterError, flag

from move_base.parameters.layout import with_layers
from move_base.parameters.reader import read_parameters

if TYPE_CHECKING:
    from move_base.parameters.parameters import CostmapParameters, MoveBaseParameters


@dataclass(frozen=True)
class ServerDescription:
    """One dynamic_reconfigure server.

    Attributes:
        namespace: relative to the node's own; empty: the node's.
        definition: name of its definition in cfg/.
    """

    namespace: str
    definition: str


OF_LAYERS = {
    "static": "GenericPlugin",
    "obstacle": "ObstaclePlugin",
    "voxel": "VoxelPlugin",
    "inflation": "InflationPlugin",
}
"""Definitions of the layers' servers, by kind."""

OF_LOCAL_PLANNERS = {"TrajectoryPlannerROS": "BaseLocalPlanner", "DWAPlannerROS": "DWAPlanner"}
"""Definitions of the local planners' servers, by name."""


def servers(parameters: MoveBaseParameters) -> list[ServerDescription]:
    """Return the servers that a node with these parameters offers."""
    controller = parameters.controller.name
    found = [ServerDescription("", "MoveBase"), ServerDescription(controller, OF_LOCAL_PLANNERS[controller])]
    costmaps = {"global_costmap": parameters.global_costmap, "local_costmap": parameters.local_costmap}
    for name, costmap in costmaps.items():
        found.append(ServerDescription(name, "Costmap2D"))
        # Layers that are switched off have one, too: they can be switched on.
        found += [ServerDescription(f"{name}/{layer.name}", OF_LAYERS[layer.kind]) for layer in costmap.layers]
    return found


def present_values(
    parameters: MoveBaseParameters, tree: Mapping[str, Any], server: ServerDescription, names: Iterable[str]
) -> dict[str, Any]:
    """Return the present values of a server's parameters, without infinite values."""
    name, _, layer = server.namespace.partition("/")
    source: object = parameters
    if server.definition == "DWAPlanner":
        source = None  # the controller's parameters have other names and units
    elif name == parameters.controller.name:
        source = parameters.controller
    elif name:
        costmap: CostmapParameters = getattr(parameters, name)
        source = next((one for one in costmap.layers if one.name == layer), None) if layer else costmap
    given = _level(with_layers(tree), server.namespace)
    values = {key: getattr(source, key, given.get(key)) for key in names}
    if "y_vels" in values:
        values["y_vels"] = _text(given.get("y_vels", values["y_vels"]))
    if "footprint" in values:
        values["footprint"] = _text(given.get("footprint", tree.get("footprint", "[]")))
    return {key: value for key, value in values.items() if value is not None and not _is_infinite(value)}


def as_default(value: Any, default: Any) -> Any:
    """Return a value in the type of its parameter's default; the default where it can't be one of that type."""
    try:
        return flag(value, "") if isinstance(default, bool) else type(default)(value)
    except (TypeError, ValueError, OverflowError):
        return default


def changed(
    tree: Mapping[str, Any], namespace: str, values: Mapping[str, Any]
) -> tuple[dict[str, Any], MoveBaseParameters]:
    """Return the parameter tree with new values in a server's namespace, and what it means.

    Raises:
        ParameterError: the values do not fit, alone or with the others.
    """
    for name in _FIXED & values.keys():
        raise ParameterError(f"{name} can't change while move_base runs: set it in the launch file and start again")
    new = with_layers(tree)
    _level(new, namespace).update(values)
    return new, read_parameters(new)


_FIXED = {"base_global_planner", "base_local_planner"}
"""Parameters that only a new start changes: topics and servers have the planners' names."""


def _level(tree: Any, namespace: str) -> Any:
    for name in filter(None, namespace.split("/")):
        tree = tree.setdefault(name, {}) if isinstance(tree, dict) else {}
    return tree


def _is_infinite(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)


def _text(value: object) -> str | None:
    """Return a list of numbers, or of lists of them, as dynamic_reconfigure sends it: as a text."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(str(_text(item)) for item in value)}]"
    return None if value is None else str(value)
