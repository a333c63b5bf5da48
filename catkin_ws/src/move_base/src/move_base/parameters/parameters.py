"""The parameters of move_base, typed and checked (`reader` makes them from the parameter server's tree)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT_UPDATE_PERIOD = 1.0
"""Seconds after which a source without `expected_update_rate` counts as silent; costmap_2d would wait for ever."""

LONGEST = 1e6
"""The largest length that a parameter may have, m: it is farther than anything drives."""

FASTEST = 100.0
"""The largest speed that a parameter or the odometry may have, m/s or rad/s."""

LONGEST_TIME = 1e9
"""The largest time that a parameter may have, s: 30 years."""

OBSTACLE_KINDS = ("obstacle", "voxel")
"""Kinds of layers that sensors fill."""


@dataclass(frozen=True)
class ObservationSource:
    """One sensor of an obstacle layer.

    Attributes:
        name: name of the source in `observation_sources`.
        data_type: `LaserScan` or `PointCloud2`.
        topic: topic's name, relative to the node's namespace.
        sensor_frame: replaces the message's frame where it is not empty.
        marking: whether returns mark obstacles.
        clearing: whether rays clear obstacles.
        min_obstacle_height: m, in the costmap's frame.
        max_obstacle_height: m.
        obstacle_range: returns farther than this mark nothing, m.
        raytrace_range: rays clear up to this distance, m.
        expected_update_rate: longest time between two messages, s (a period, whatever its name says).
        inf_is_valid: whether an infinite reading of a scan is a ray that met nothing, and clears.
        layer: name of the obstacle layer that it fills.
    """

    name: str
    data_type: str
    topic: str
    sensor_frame: str = ""
    marking: bool = True
    clearing: bool = True
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 2.0
    obstacle_range: float = 2.5
    raytrace_range: float = 3.0
    expected_update_rate: float = DEFAULT_UPDATE_PERIOD
    inf_is_valid: bool = False
    layer: str = ""

    @property
    def stream(self) -> tuple[str, str, str, bool, float]:
        """Topic and type, and how its messages are converted. Sources that agree in these share one conversion."""
        return self.topic, self.data_type, self.sensor_frame, self.inf_is_valid, self.raytrace_range


@dataclass(frozen=True)
class Layer:
    """One entry of a costmap's `plugins` list; only the fields of its kind are used, and none if it is not enabled.

    Attributes:
        name: the layer's name, under which its parameters are.
        kind: `static`, `obstacle`, `voxel` (which works as `obstacle`) or `inflation`.
        enabled: whether it is used.
        map_topic: topic of the occupancy grid (static).
        track_unknown_space: whether unknown cells stay unknown; else they are free (static).
        lethal_cost_threshold: occupancy from which a cell is an obstacle, 0..100 (static).
        unknown_cost_value: occupancy of an unknown cell (static).
        trinary_costmap: whether a cell is free, an obstacle or unknown; else its cost grows with occupancy (static).
        first_map_only: whether later maps are ignored (static).
        subscribe_to_updates: whether parts of the map come on the topic `MAP_TOPIC_updates` (static).
        use_maximum: whether a larger cost of a layer listed before is kept (static).
        sources: sensors (obstacle).
        footprint_clearing_enabled: whether the robot's own area is cleared (obstacle).
        max_obstacle_height: m; limits that of each source (obstacle).
        inflation_radius: m (inflation).
        cost_scaling_factor: 1/m, decay of the cost beyond the inscribed radius (inflation).
        inflate_unknown: whether every cost replaces that of an unknown cell (inflation).
    """

    name: str
    kind: str
    enabled: bool = True
    map_topic: str = "map"
    track_unknown_space: bool = True
    lethal_cost_threshold: int = 100
    unknown_cost_value: int = -1
    trinary_costmap: bool = True
    first_map_only: bool = False
    subscribe_to_updates: bool = False
    use_maximum: bool = False
    sources: tuple[ObservationSource, ...] = ()
    footprint_clearing_enabled: bool = True
    max_obstacle_height: float = 2.0
    inflation_radius: float = 0.55
    cost_scaling_factor: float = 10.0
    inflate_unknown: bool = False


@dataclass(frozen=True)
class CostmapParameters:
    """Parameters of `global_costmap` or `local_costmap`; lengths in metres, frequencies in Hz.

    `footprint_topic` is empty unless it is given; `robot_radius` is used where no footprint is given.
    """

    global_frame: str
    robot_base_frame: str
    update_frequency: float
    publish_frequency: float
    transform_tolerance: float
    rolling_window: bool
    width: float
    height: float
    resolution: float
    origin_x: float
    origin_y: float
    footprint: tuple[tuple[float, float], ...]
    robot_radius: float
    footprint_padding: float
    always_send_full_costmap: bool
    footprint_topic: str
    published_footprint: str
    layers: tuple[Layer, ...]

    def layers_of(self, *kinds: str) -> tuple[Layer, ...]:
        """Return the layers of these kinds that are enabled."""
        return tuple(layer for layer in self.layers if layer.kind in kinds and layer.enabled)

    @cached_property
    def sources(self) -> tuple[ObservationSource, ...]:
        """The observation sources of the layers that are enabled."""
        return tuple(source for layer in self.layers_of(*OBSTACLE_KINDS) for source in layer.sources)

    @property
    def all_sources(self) -> tuple[ObservationSource, ...]:
        """The observation sources of all layers: a layer that is not enabled may be enabled later."""
        return tuple(source for layer in self.layers for source in layer.sources)

    def padded_footprint(self) -> NDArray[np.float64]:
        """Return the padded footprint's corners (N, 2) in the base frame; each coordinate grows by the padding."""
        corners = np.array(self.footprint)
        return corners + np.sign(corners) * self.footprint_padding


@dataclass(frozen=True)
class ControllerParameters:
    """Parameters of the local planner; metres, radians, seconds.

    `name` is the local planner's name without its package: its namespace for parameters and topics. The speeds ahead
    are between `min_vel_x` and `max_vel_x`; where both are 0 or less, the robot drives backwards.
    """

    name: str
    odom_topic: str
    acc_lim_x: float
    acc_lim_y: float
    acc_lim_theta: float
    max_vel_x: float
    min_vel_x: float
    max_vel_theta: float
    min_vel_theta: float
    min_in_place_vel_theta: float
    y_vels: tuple[float, ...]
    escape_vel: float
    xy_goal_tolerance: float
    yaw_goal_tolerance: float
    latch_xy_goal_tolerance: bool
    sim_time: float
    sim_granularity: float
    vx_samples: int
    vtheta_samples: int
    path_distance_bias: float
    goal_distance_bias: float
    occdist_scale: float
    heading_lookahead: float
    oscillation_reset_dist: float

    @property
    def backwards(self) -> bool:
        """Whether the robot drives backwards."""
        return self.max_vel_x <= 0.0


@dataclass(frozen=True)
class RecoveryBehavior:
    """One step of the recovery sequence.

    Attributes:
        name: as warnings tell it.
        kind: `clear` or `rotate`.
        reset_distance: side of the square around the robot in which obstacles are kept, m (clear).
        invert_area_to_clear: whether obstacles are cleared inside of the square, not outside of it (clear).
        affected_maps: `global`, `local` or `both` (clear).
        layer_names: names of the layers that are cleared (clear).
    """

    name: str
    kind: str
    reset_distance: float = 0.0
    invert_area_to_clear: bool = False
    affected_maps: str = "both"
    layer_names: tuple[str, ...] = ("obstacles",)

    def affects(self, costmap: str) -> bool:
        """Return whether it clears layers of a costmap, `global` or `local`."""
        return self.kind == "clear" and self.affected_maps in {costmap, "both"}


@dataclass(frozen=True)
class MoveBaseParameters:
    """All parameters of move_base; frequencies in Hz, times in s, lengths in m.

    `max_planning_retries` is -1 where only `planner_patience` limits them; `default_tolerance` is how far a plan may
    end from a blocked goal; `notes` say which parameters were taken in a way that may surprise.
    """

    controller_frequency: float
    planner_frequency: float
    controller_patience: float
    planner_patience: float
    max_planning_retries: int
    oscillation_timeout: float
    oscillation_distance: float
    conservative_reset_dist: float
    recovery_behavior_enabled: bool
    clearing_rotation_allowed: bool
    shutdown_costmaps: bool
    make_plan_add_unreachable_goal: bool
    base_global_planner: str
    base_local_planner: str
    recovery_behaviors: tuple[RecoveryBehavior, ...]
    allow_unknown: bool
    default_tolerance: float
    controller: ControllerParameters
    global_costmap: CostmapParameters
    local_costmap: CostmapParameters
    notes: tuple[str, ...] = ()

    @property
    def global_planner(self) -> str:
        """The global planner's name without its package: its namespace for parameters and topics."""
        return plugin_name(self.base_global_planner)


def plugin_name(kind: str) -> str:
    """Return the name of a plug-in without its package, which is its namespace."""
    return kind.replace("::", "/").rpartition("/")[2]
