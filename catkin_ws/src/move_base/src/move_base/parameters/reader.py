"""Reads the parameters of move_base from the nested dictionary of its private namespace.

Names and defaults are those of ROS Navigation's move_base, costmap_2d and base_local_planner, so that published launch
files and YAML files load unchanged; `DEFAULT_UPDATE_PERIOD` is the one departure.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from node_kit.parameters import ParameterTree

from move_base.parameters.parameters import (
    DEFAULT_UPDATE_PERIOD,
    ControllerParameters,
    CostmapParameters,
    Layer,
    MoveBaseParameters,
    ObservationSource,
    RecoveryBehavior,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

MAX_CELLS = 50_000_000
"""Cells of a costmap that can be worked with: 350 x 350 m at 0.05 m."""

LAYER_TYPES = {
    "costmap_2d::StaticLayer": "static",
    "costmap_2d::ObstacleLayer": "obstacle",
    "costmap_2d::VoxelLayer": "obstacle",
    "costmap_2d::InflationLayer": "inflation",
}

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
    top = ParameterTree(tree)
    local = _read_costmap(top.child("local_costmap"), rolling_default=True)
    parameters = MoveBaseParameters(
        controller_frequency=top.number("controller_frequency", 20.0, low=0.1, high=1000.0),
        planner_frequency=top.number("planner_frequency", 0.0, low=0.0, high=1000.0),
        controller_patience=top.number("controller_patience", 15.0, low=0.0),
        planner_patience=top.number("planner_patience", 5.0, low=0.0),
        max_planning_retries=top.whole("max_planning_retries", -1, low=-1, high=1000),
        oscillation_timeout=top.number("oscillation_timeout", 0.0, low=0.0),
        oscillation_distance=top.number("oscillation_distance", 0.5, low=0.0),
        conservative_reset_dist=top.number("conservative_reset_dist", 3.0, low=0.0),
        recovery_behavior_enabled=top.flag("recovery_behavior_enabled", True),
        clearing_rotation_allowed=top.flag(_ROTATION, True),
        recovery_behaviors=_read_recovery(top, local),
        allow_unknown=top.child("NavfnROS").flag("allow_unknown", True),
        default_tolerance=top.child("NavfnROS").number("default_tolerance", 0.0, low=0.0),
        controller=_read_controller(top.child("TrajectoryPlannerROS")),
        global_costmap=_read_costmap(top.child("global_costmap"), rolling_default=False),
        local_costmap=local,
    )
    if not local.rolling_window:
        raise top.child("local_costmap").error("rolling_window", "must be true here", False)
    return parameters


def _read_controller(reader: ParameterTree) -> ControllerParameters:
    max_vel_x = reader.number("max_vel_x", 0.5, low=0.0, above=True, high=10.0)
    min_vel_x = reader.number("min_vel_x", 0.1, low=0.0, high=10.0)
    if min_vel_x > max_vel_x:
        raise reader.error("min_vel_x", f"must not be over max_vel_x ({max_vel_x:g})", min_vel_x)
    max_vel_theta = reader.number("max_vel_theta", 1.0, low=0.0, above=True, high=20.0, formerly="max_rotational_vel")
    min_in_place = reader.number(
        "min_in_place_vel_theta", 0.4, low=0.0, above=True, high=20.0, formerly="min_in_place_rotational_vel"
    )
    holonomic = reader.flag("holonomic_robot", True)
    return ControllerParameters(
        odom_topic=reader.text("odom_topic", "odom"),
        acc_lim_x=reader.number("acc_lim_x", 2.5, low=0.0, above=True),
        acc_lim_y=reader.number("acc_lim_y", 2.5, low=0.0, above=True),
        acc_lim_theta=reader.number("acc_lim_theta", 3.2, low=0.0, above=True, formerly="acc_lim_th"),
        max_vel_x=max_vel_x,
        min_vel_x=min_vel_x,
        max_vel_theta=max_vel_theta,
        min_vel_theta=reader.number("min_vel_theta", -max_vel_theta, low=-20.0, high=0.0),
        min_in_place_vel_theta=min(max_vel_theta, min_in_place),
        y_vels=_read_lateral_samples(reader) if holonomic else (),
        escape_vel=reader.number("escape_vel", -0.1, low=-10.0, high=0.0, formerly="backup_vel"),
        xy_goal_tolerance=reader.number("xy_goal_tolerance", 0.10, low=0.0, above=True),
        yaw_goal_tolerance=reader.number("yaw_goal_tolerance", 0.05, low=0.0, above=True),
        latch_xy_goal_tolerance=reader.flag("latch_xy_goal_tolerance", False),
        sim_time=reader.number("sim_time", 1.0, low=0.1, high=20.0),
        sim_granularity=reader.number("sim_granularity", 0.025, low=0.001, high=1.0),
        vx_samples=reader.whole("vx_samples", 3, low=1, high=200),
        vtheta_samples=reader.whole("vtheta_samples", 20, low=1, high=500),
        path_distance_bias=reader.number("path_distance_bias", 0.6, low=0.0, formerly="pdist_scale"),
        goal_distance_bias=reader.number("goal_distance_bias", 0.8, low=0.0, formerly="gdist_scale"),
        occdist_scale=reader.number("occdist_scale", 0.01, low=0.0),
        heading_lookahead=reader.number("heading_lookahead", 0.325, low=0.0),
        oscillation_reset_dist=reader.number("oscillation_reset_dist", 0.05, low=0.0),
    )


def _read_recovery(reader: ParameterTree, local: CostmapParameters) -> tuple[RecoveryBehavior, ...]:
    """Return the behaviours that `recovery_behaviors` lists; without it, the published default."""
    if not reader.has("recovery_behaviors"):
        radius = float(np.hypot(*np.array(local.footprint).T).max())
        near = reader.number("conservative_reset_dist", 3.0, low=0.0)
        rotate = [RecoveryBehavior("rotate_recovery", "rotate")] if reader.flag(_ROTATION, True) else []
        conservative = RecoveryBehavior("conservative_reset", "clear", near)
        return (conservative, *rotate, RecoveryBehavior("aggressive_reset", "clear", 4.0 * radius), *rotate)
    found = []
    for index, entry in enumerate(reader.items("recovery_behaviors", ())):
        name, kind = _plugin(reader, f"recovery_behaviors[{index}]", entry, RECOVERY_TYPES)
        found.append(RecoveryBehavior(name, kind, reader.child(name).number("reset_distance", 3.0, low=0.0)))
    return tuple(found)


def _read_lateral_samples(reader: ParameterTree) -> tuple[float, ...]:
    """Return the lateral speeds in m/s: `y_vels`, clipped to max_vel_y and min_vel_y.

    A negative min_vel_y is the fastest speed to the right, one of zero or more the slowest sample's magnitude.
    """
    samples = reader.numbers("y_vels", (-0.3, -0.1, 0.1, 0.3))
    highest = reader.number("max_vel_y", math.inf, low=0.0)
    lowest = reader.number("min_vel_y", -highest)
    least = max(lowest, 0.0)
    bound = lowest if lowest < 0 else -highest
    clipped = {min(max(value, bound), highest) for value in samples}
    return tuple(sorted(value for value in clipped if value and abs(value) >= least))


def _read_costmap(reader: ParameterTree, *, rolling_default: bool) -> CostmapParameters:
    parameters = CostmapParameters(
        global_frame=_frame(reader, "global_frame", "odom" if rolling_default else "map"),
        robot_base_frame=_frame(reader, "robot_base_frame", "base_link"),
        update_frequency=reader.number("update_frequency", 5.0, low=0.0, above=True, high=1000.0),
        publish_frequency=reader.number("publish_frequency", 0.0, low=0.0, high=1000.0),
        transform_tolerance=reader.number("transform_tolerance", 0.3, low=0.0),
        rolling_window=reader.flag("rolling_window", rolling_default),
        width=reader.number("width", 10.0, low=0.0, above=True, high=1000.0),
        height=reader.number("height", 10.0, low=0.0, above=True, high=1000.0),
        resolution=reader.number("resolution", 0.05, low=0.005, high=1.0),
        origin_x=reader.number("origin_x", 0.0),
        origin_y=reader.number("origin_y", 0.0),
        footprint=_read_footprint(reader),
        footprint_padding=reader.number("footprint_padding", 0.01, low=0.0, high=10.0),
        layers=(),
    )
    if parameters.width * parameters.height > MAX_CELLS * parameters.resolution**2:
        raise reader.error("resolution", f"gives the costmap over {MAX_CELLS:,} cells", parameters.resolution)
    return replace(parameters, layers=_read_layers(reader))


def _read_layers(reader: ParameterTree) -> tuple[Layer, ...]:
    layers = []
    for index, entry in enumerate(reader.items("plugins", ())):
        name, kind = _plugin(reader, f"plugins[{index}]", entry, LAYER_TYPES)
        layers.append(_read_layer(reader.child(name), name, kind))
    if not layers:
        raise reader.error("plugins", "must list the layers (load the base navigation parameters first)", None)
    return tuple(layers)


def _read_layer(reader: ParameterTree, name: str, kind: str) -> Layer:
    enabled = reader.flag("enabled", True)
    if kind == "static":
        return Layer(
            name,
            kind,
            enabled,
            map_topic=reader.text("map_topic", "map"),
            track_unknown_space=reader.flag("track_unknown_space", True),
            lethal_cost_threshold=reader.whole("lethal_cost_threshold", 100, low=1, high=100),
        )
    if kind == "inflation":
        return Layer(
            name,
            kind,
            enabled,
            inflation_radius=reader.number("inflation_radius", 0.55, low=0.0, high=50.0),
            cost_scaling_factor=reader.number("cost_scaling_factor", 10.0, low=0.0),
        )
    names = reader.text("observation_sources", "").split() if enabled else []
    if len(set(names)) != len(names):
        raise reader.error("observation_sources", "names a source twice", " ".join(names))
    return Layer(
        name,
        kind,
        enabled,
        sources=tuple(_read_source(reader, source) for source in names),
        footprint_clearing=reader.flag("footprint_clearing_enabled", True),
    )


def _read_source(layer: ParameterTree, name: str) -> ObservationSource:
    if not layer.has(name):
        raise layer.error("observation_sources", f"names {name!r}, but {layer.full_name(name)} has no parameters", name)
    reader = layer.child(name)
    data_type = reader.text("data_type", "PointCloud")
    if data_type not in {"LaserScan", "PointCloud2"}:
        raise reader.error("data_type", "must be LaserScan or PointCloud2", data_type)
    period = reader.number("expected_update_rate", 0.0, low=0.0)
    source = ObservationSource(
        name=name,
        data_type=data_type,
        topic=reader.text("topic", name),
        sensor_frame=_frame(reader, "sensor_frame", ""),
        marking=reader.flag("marking", True),
        clearing=reader.flag("clearing", False),
        min_obstacle_height=reader.number("min_obstacle_height", 0.0),
        max_obstacle_height=reader.number("max_obstacle_height", layer.number("max_obstacle_height", 2.0)),
        obstacle_range=reader.number("obstacle_range", layer.number("obstacle_range", 2.5, low=0.0), low=0.0),
        raytrace_range=reader.number("raytrace_range", layer.number("raytrace_range", 3.0, low=0.0), low=0.0),
        expected_update_rate=period or DEFAULT_UPDATE_PERIOD,
        inf_is_valid=reader.flag("inf_is_valid", False),
    )
    if source.min_obstacle_height > source.max_obstacle_height:
        raise reader.error("min_obstacle_height", "must not be over max_obstacle_height", source.min_obstacle_height)
    return source


def _read_footprint(reader: ParameterTree) -> tuple[tuple[float, float], ...]:
    value = reader.value("footprint", None)
    if value in (None, "", "[]", []):
        radius = reader.number("robot_radius", 0.46, low=0.0, above=True)
        angles = np.arange(16) * (2.0 * math.pi / 16)
        return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)
    if isinstance(value, str):
        try:
            value = json.loads(value)
        except ValueError as error:
            raise reader.error("footprint", "must be a list of [x, y] corners", value) from error
    try:
        corners = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise reader.error("footprint", "must be a list of [x, y] corners", value) from error
    if corners.ndim != 2 or corners.shape[0] < 3 or corners.shape[1] != 2 or not np.isfinite(corners).all():
        raise reader.error("footprint", "must be a list of at least three finite [x, y] corners", value)
    return tuple((float(x), float(y)) for x, y in corners)


def _frame(reader: ParameterTree, name: str, default: str) -> str:
    """Return a frame's name without the leading slash that some published files have; tf2 refuses it."""
    return reader.text(name, default).removeprefix("/")


def _plugin(reader: ParameterTree, where: str, entry: Any, types: Mapping[str, str]) -> tuple[str, str]:
    """Return name and kind of an entry `{name, type}` of a list of plug-ins."""
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
        raise reader.error(where, "must have a name and a type", entry)
    kind = types.get(str(entry.get("type")))
    if kind is None:
        raise reader.error(where, f"is of an unknown type; known are {', '.join(types)}", entry.get("type"))
    return entry["name"], kind
