"""Parameters that change while move_base runs: their servers and their present values.

The servers and the names of their parameters are those of ROS Navigation; the definitions are in cfg/.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

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


def servers(parameters: MoveBaseParameters) -> list[ServerDescription]:
    """Return the servers that a node with these parameters offers."""
    found = [ServerDescription("", "MoveBase"), ServerDescription("TrajectoryPlannerROS", "BaseLocalPlanner")]
    costmaps = {"global_costmap": parameters.global_costmap, "local_costmap": parameters.local_costmap}
    for name, costmap in costmaps.items():
        found.append(ServerDescription(name, "Costmap2D"))
        found += [
            ServerDescription(f"{name}/{layer.name}", "InflationPlugin")
            for layer in costmap.layers  # also those that are switched off: they can be switched on
            if layer.kind == "inflation"
        ]
    return found


def present_values(
    parameters: MoveBaseParameters, tree: Mapping[str, Any], server: ServerDescription, names: Iterable[str]
) -> dict[str, Any]:
    """Return the present values of a server's parameters, without infinite values."""
    name, _, layer = server.namespace.partition("/")
    source: object = parameters
    if name == "TrajectoryPlannerROS":
        source = parameters.controller
    elif name:
        costmap: CostmapParameters = getattr(parameters, name)
        source = next((one for one in costmap.layers if one.name == layer), None) if layer else costmap
    given = _level(tree, server.namespace)
    values = {key: getattr(source, key, given.get(key)) for key in names}
    return {key: value for key, value in values.items() if value is not None and not _is_infinite(value)}


def changed(
    tree: Mapping[str, Any], namespace: str, values: Mapping[str, Any]
) -> tuple[dict[str, Any], MoveBaseParameters]:
    """Return the parameter tree with new values in a server's namespace, and what it means.

    Raises:
        ParameterError: the values do not fit, alone or with the others.
    """
    new = copy.deepcopy(dict(tree))
    _level(new, namespace).update(values)
    return new, read_parameters(new)


def _level(tree: Any, namespace: str) -> Any:
    for name in filter(None, namespace.split("/")):
        tree = tree.setdefault(name, {}) if isinstance(tree, dict) else {}
    return tree


def _is_infinite(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)
