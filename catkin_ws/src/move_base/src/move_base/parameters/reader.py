"""Reads the parameters of move_base from the nested dictionary of its private namespace.

Names and defaults are those of ROS Navigation's move_base, costmap_2d, base_local_planner and dwa_local_planner. So
published launch files and YAML files load unchanged; `DEFAULT_UPDATE_PERIOD` is the one departure.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from node_kit.parameters import ParameterTree

from move_base.parameters.costmaps import FARTHEST_CORNER, blind, plugin, read_costmap
from move_base.parameters.layout import COSTMAPS, is_old, with_layers
from move_base.parameters.local_planners import LOCAL_PLANNERS, TRAJECTORY_PLANNER, read_controller
from move_base.parameters.parameters import (
    LONGEST,
    LONGEST_TIME,
    OBSTACLE_KINDS,
    MoveBaseParameters,
    RecoveryBehavior,
    plugin_name,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from move_base.parameters.parameters import CostmapParameters

GLOBAL_PLANNERS = ("navfn/NavfnROS", "global_planner/GlobalPlanner")
"""Global planners that the planner here stands in for."""

RECOVERY_TYPES = {
    "clear_costmap_recovery/ClearCostmapRecovery": "clear",
    "rotate_recovery/RotateRecovery": "rotate",
}

_ROTATION = "clearing_rotation_allowed"


def read_parameters(tree: Mapping[str, Any]) -> MoveBaseParameters:
    """Read and check the parameters of move_base.

    Args:
        tree: the node's private namespace, nested as the parameter server returns it.

    Raises:
        ParameterError: a value has the wrong type or is out of range.
    """
    top = ParameterTree(with_layers(tree))
    global_costmap, local_costmap = (read_costmap(top, name) for name in COSTMAPS)
    if blind(global_costmap) and blind(local_costmap):
        rule = "has neither a map nor a sensor, and global_costmap neither: load the base navigation parameters first"
        raise top.error("local_costmap", rule, "")
    local_planner = _planner(top, "base_local_planner", TRAJECTORY_PLANNER, LOCAL_PLANNERS)
    global_planner = _planner(top, "base_global_planner", GLOBAL_PLANNERS[0], GLOBAL_PLANNERS)
    planning = top.child(plugin_name(global_planner))
    parameters = MoveBaseParameters(
        controller_frequency=top.number("controller_frequency", 20.0, low=0.1, high=1000.0),
        planner_frequency=top.number("planner_frequency", 0.0, low=0.0, high=1000.0),
        controller_patience=top.number("controller_patience", 15.0, low=0.0, high=LONGEST_TIME),
        planner_patience=top.number("planner_patience", 5.0, low=0.0, high=LONGEST_TIME),
        max_planning_retries=top.whole("max_planning_retries", -1, low=-1, high=1000),
        oscillation_timeout=top.number("oscillation_timeout", 0.0, low=0.0, high=LONGEST_TIME),
        oscillation_distance=top.number("oscillation_distance", 0.5, low=0.0, high=LONGEST),
        conservative_reset_dist=top.number("conservative_reset_dist", 3.0, low=0.0, high=LONGEST),
        recovery_behavior_enabled=top.flag("recovery_behavior_enabled", True),
        clearing_rotation_allowed=top.flag(_ROTATION, True),
        shutdown_costmaps=top.flag("shutdown_costmaps", False),
        make_plan_add_unreachable_goal=top.flag("make_plan_add_unreachable_goal", True),
        base_global_planner=global_planner,
        base_local_planner=local_planner,
        recovery_behaviors=_read_recovery(top, local_costmap),
        allow_unknown=planning.flag("allow_unknown", True),
        default_tolerance=planning.number("default_tolerance", 0.0, low=0.0, high=LONGEST),
        controller=read_controller(top.child(plugin_name(local_planner)), local_planner, local_costmap.resolution),
        global_costmap=global_costmap,
        local_costmap=local_costmap,
    )
    return replace(parameters, notes=tuple(_notes(tree, top, parameters)))


def _planner(top: ParameterTree, name: str, default: str, known: tuple[str, ...]) -> str:
    """Return a planner's full name; the name without its package will do, as in the original."""
    given = top.text(name, default)
    full = next((kind for kind in known if given in {kind, plugin_name(kind)}), None)
    if full is None:
        rule = f"must be one of {', '.join(known)}, which this stand-in replaces; for others use the original move_base"
        raise top.error(name, rule, given)
    return full


def _read_recovery(top: ParameterTree, local: CostmapParameters) -> tuple[RecoveryBehavior, ...]:
    """Return the behaviours that `recovery_behaviors` lists; the default without it, or if it has mistakes."""
    if not top.has("recovery_behaviors") or _mistake_of_recovery(top):
        of_footprint = max(math.hypot(x, y) for x, y in local.footprint)
        radius = top.child("local_costmap").number(
            "circumscribed_radius", of_footprint, low=0.0, high=2 * FARTHEST_CORNER
        )
        near = top.number("conservative_reset_dist", 3.0, low=0.0, high=LONGEST)
        rotate = [RecoveryBehavior("rotate_recovery", "rotate")] if top.flag(_ROTATION, True) else []
        conservative = _read_clearing(top, "conservative_reset", near)
        return (conservative, *rotate, _read_clearing(top, "aggressive_reset", 4.0 * radius), *rotate)
    found = []
    for entry in top.items("recovery_behaviors"):
        name, kind = plugin(top, "recovery_behaviors", entry, _recovery_types())
        if kind == "clear":
            reset_distance = top.child(name).number("reset_distance", 3.0, low=0.0, high=LONGEST)
            found.append(_read_clearing(top, name, reset_distance))
        else:
            found.append(RecoveryBehavior(name, kind))
    return tuple(found)


def _recovery_types() -> dict[str, str]:
    """Return the kinds by type; the type without its package is a former form."""
    return {**RECOVERY_TYPES, **{plugin_name(name): kind for name, kind in RECOVERY_TYPES.items()}}


def _mistake_of_recovery(top: ParameterTree) -> str:
    """Return what keeps `recovery_behaviors` from being used, or an empty text."""
    given = top.value("recovery_behaviors")
    if not isinstance(given, list):
        return "recovery_behaviors is no list"
    entries = [entry for entry in given if isinstance(entry, dict) and {"name", "type"} <= entry.keys()]
    if len(entries) < len(given):
        return "an entry of recovery_behaviors has no name or no type"
    names = [entry["name"] for entry in entries]
    if len(set(map(str, names))) < len(names):
        return "two recovery_behaviors have one name"
    unknown = [str(entry["type"]) for entry in entries if str(entry["type"]) not in _recovery_types()]
    if unknown:
        return f"recovery_behaviors has types that are not known here: {', '.join(unknown)}"
    return ""


def _read_clearing(top: ParameterTree, name: str, reset_distance: float) -> RecoveryBehavior:
    reader = top.child(name)
    maps = reader.text("affected_maps", "both")
    return RecoveryBehavior(
        name,
        "clear",
        reset_distance,
        invert_area_to_clear=reader.flag("invert_area_to_clear", False),
        affected_maps=maps if maps in {"global", "local"} else "both",
        layer_names=tuple(reader.texts("layer_names", ("obstacles",))),
    )


def _notes(tree: Mapping[str, Any], top: ParameterTree, parameters: MoveBaseParameters) -> Iterator[str]:
    """Return what may surprise whoever wrote the parameters, one line each with a remedy."""
    for costmap in COSTMAPS:
        if is_old(tree, costmap):
            yield f"{costmap} lists no plugins: its parameters are taken as before Hydro; list them to choose layers"
    if top.has("recovery_behaviors") and _mistake_of_recovery(top):
        yield f"{_mistake_of_recovery(top)}: the default behaviours are used; correct the list"
    costmaps = (parameters.global_costmap, parameters.local_costmap)
    layers = {layer.name for costmap in costmaps for layer in costmap.layers if layer.kind in OBSTACLE_KINDS}
    for behaviour in parameters.recovery_behaviors:
        if behaviour.kind == "clear" and not layers & set(behaviour.layer_names):
            names, found = ", ".join(behaviour.layer_names), ", ".join(sorted(layers))
            yield (
                f"{behaviour.name} clears nothing: no costmap has a layer {names}; set {behaviour.name}/layer_names to "
                f"some of {found}"
            )
    if top.child(parameters.controller.name).has("odom_topic") and parameters.controller.odom_topic == "odom":
        given = top.child(parameters.controller.name).text("odom_topic")
        if given != "odom":
            yield (
                f"{parameters.controller.name} takes no odom_topic: it listens to odom; remap odom to {given} in the "
                "launch file"
            )
