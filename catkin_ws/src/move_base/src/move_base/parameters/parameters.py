"""The parameters of move_base, typed and checked (`reader` makes them from the parameter server's tree)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT_UPDATE_PERIOD = 1.0
"""Seconds after which a source without `expected_update_rate` counts as silent; costmap_2d would wait for ever."""


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


@dataclass(frozen=True)
class Layer:
    """One entry of a costmap's `plugins` list; only the fields of its kind are used, and none if it is not enabled.

    Attributes:
        name: the layer's name, under which its parameters are.
        kind: `static`, `obstacle` or `inflation`.
        enabled: whether it is used.
        map_topic: topic of the occupancy grid (static).
        track_unknown_space: whether unknown cells stay unknown; else they are free (static).
        lethal_cost_threshold: occupancy from which a cell is an obstacle, 0..100 (static).
        sources: sensors (obstacle).
        footprint_clearing: whether the robot's own area is cleared (obstacle).
        inflation_radius: m (inflation).
        cost_scaling_factor: 1/m, decay of the cost beyond the inscribed radius (inflation).
    """

    name: str
    kind: str
    enabled: bool = True
    map_topic: str = "map"
    track_unknown_space: bool = True
    lethal_cost_threshold: int = 100
    sources: tuple[ObservationSource, ...] = ()
    footprint_clearing: bool = True
    inflation_radius: float = 0.55
    cost_scaling_factor: float = 10.0


@dataclass(frozen=True)
class CostmapParameters:
    """Parameters of `global_costmap` or `local_costmap`; lengths in metres, frequencies in Hz."""

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
    footprint_padding: float
    layers: tuple[Layer, ...]

    def layers_of(self, kind: str) -> tuple[Layer, ...]:
        """Return the layers of a kind that are enabled."""
        return tuple(layer for layer in self.layers if layer.kind == kind and layer.enabled)

    @property
    def sources(self) -> tuple[ObservationSource, ...]:
        """All observation sources of the costmap's layers."""
        return tuple(source for layer in self.layers_of("obstacle") for source in layer.sources)

    def padded_footprint(self) -> NDArray[np.float64]:
        """Return the padded footprint's corners (N, 2) in the base frame; each coordinate grows by the padding."""
        corners = np.array(self.footprint)
        return corners + np.sign(corners) * self.footprint_padding


@dataclass(frozen=True)
class ControllerParameters:
    """Parameters of `TrajectoryPlannerROS`; metres, radians, seconds."""

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


@dataclass(frozen=True)
class RecoveryBehavior:
    """One step of the recovery sequence.

    Attributes:
        name: as warnings tell it.
        kind: `clear` or `rotate`.
        reset_distance: side of the square around the robot in which obstacles are kept, m (clear).
    """

    name: str
    kind: str
    reset_distance: float = 0.0


@dataclass(frozen=True)
class MoveBaseParameters:
    """All parameters of move_base; frequencies in Hz, times in s, lengths in m.

    `max_planning_retries` is -1 where only `planner_patience` limits them; `default_tolerance` is how far a plan may
    end from a blocked goal.
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
    recovery_behaviors: tuple[RecoveryBehavior, ...]
    allow_unknown: bool
    default_tolerance: float
    controller: ControllerParameters
    global_costmap: CostmapParameters
    local_costmap: CostmapParameters
