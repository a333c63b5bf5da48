"""Reads the parameters of the local planners that the controller here stands in for.

Names, former names and defaults are those of base_local_planner and dwa_local_planner of ROS Navigation 1.17. The
defaults are those in force in the original, where dynamic_reconfigure replaces some that the code has.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from move_base.parameters.costmaps import topic
from move_base.parameters.parameters import FASTEST, LONGEST, ControllerParameters, plugin_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from node_kit.parameters import ParameterTree

TRAJECTORY_PLANNER = "base_local_planner/TrajectoryPlannerROS"
DWA_PLANNER = "dwa_local_planner/DWAPlannerROS"

DWA_Y_SAMPLES = 10
"""Default of `vy_samples`."""

_BIASES = {"path": 0.6, "goal": 0.8}
"""Defaults of path_distance_bias and goal_distance_bias. The controller's other weights fit a sum of this size."""

SLOWEST_TURN = 0.01
"""Stands for a `min_vel_theta` of 0, rad/s: the controller needs a least speed of turns."""

LEAST_ACCELERATION = 0.01
"""Stands for an acceleration of 0, m/s2: some published files give 0 for the side to which a base can't move."""

FASTEST_CHANGE = 1e6
"""The largest acceleration, m/s2 or rad/s2: some files give a large one for none to be kept to."""

HEAVIEST = 1e6
"""The largest weight."""

MOST_SAMPLES = 20_000
"""Pairs of speed and turning speed that can be tried in a control period."""

MOST_SIDEWAYS = 300
"""Lateral speeds that can be tried."""


def read_controller(reader: ParameterTree, kind: str, resolution: float) -> ControllerParameters:
    """Read the parameters of a local planner.

    Args:
        reader: the group with the planner's name.
        kind: the planner's plug-in, `TRAJECTORY_PLANNER` or `DWA_PLANNER`.
        resolution: of the local costmap, m.

    Raises:
        ParameterError: a value can't be used.
    """
    controller = _READERS[kind](reader, resolution)
    if controller.vx_samples * controller.vtheta_samples > MOST_SAMPLES:
        rule = f"gives, with the samples of turns, over {MOST_SAMPLES:,} velocities, too many for a control period"
        raise reader.error("vx_samples", rule, controller.vx_samples)
    return controller


def _read_trajectory_planner(reader: ParameterTree, _resolution: float) -> ControllerParameters:
    min_vel_x, max_vel_x = _speeds_ahead(reader, bound=20.0)
    if min_vel_x < 0.0 < max_vel_x:
        rule = "must be 0 or more, or max_vel_x 0 or less: the robot then drives backwards; to back off is escape_vel"
        raise reader.error("min_vel_x", rule, min_vel_x)
    max_vel_theta = reader.number("max_vel_theta", 1.0, low=0.0, above=True, high=20.0, formerly="max_rotational_vel")
    min_in_place = reader.number(
        "min_in_place_vel_theta", 0.4, low=0.0, above=True, high=20.0, formerly="min_in_place_rotational_vel"
    )
    holonomic = reader.flag("holonomic_robot", True)
    return ControllerParameters(
        name=plugin_name(TRAJECTORY_PLANNER),
        odom_topic="odom",  # the original's name; it takes no other one
        acc_lim_x=_acceleration(reader, "acc_lim_x", 2.5),
        acc_lim_y=_acceleration(reader, "acc_lim_y", 2.5),
        acc_lim_theta=_acceleration(reader, "acc_lim_theta", 3.2, formerly="acc_lim_th"),
        max_vel_x=max_vel_x,
        min_vel_x=min_vel_x,
        max_vel_theta=max_vel_theta,
        min_vel_theta=reader.number("min_vel_theta", -max_vel_theta, low=-20.0, high=0.0),
        min_in_place_vel_theta=min(max_vel_theta, min_in_place),
        y_vels=_read_lateral_samples(reader) if holonomic else (),
        escape_vel=reader.number("escape_vel", -0.1, low=-10.0, high=0.0, formerly="backup_vel"),
        xy_goal_tolerance=reader.number("xy_goal_tolerance", 0.10, low=0.0, above=True, high=LONGEST),
        yaw_goal_tolerance=reader.number("yaw_goal_tolerance", 0.05, low=0.0, above=True, high=LONGEST),
        latch_xy_goal_tolerance=reader.flag("latch_xy_goal_tolerance", False),
        sim_time=reader.number("sim_time", 1.7, low=0.1, high=20.0),
        sim_granularity=reader.number("sim_granularity", 0.025, low=0.001, high=5.0),
        vx_samples=reader.whole("vx_samples", 20, low=1, high=300),
        vtheta_samples=reader.whole("vtheta_samples", 20, low=1, high=500),
        path_distance_bias=reader.number("path_distance_bias", 0.6, low=0.0, high=HEAVIEST, formerly="pdist_scale"),
        goal_distance_bias=reader.number("goal_distance_bias", 0.8, low=0.0, high=HEAVIEST, formerly="gdist_scale"),
        occdist_scale=reader.number("occdist_scale", 0.01, low=0.0, high=HEAVIEST),
        heading_lookahead=reader.number("heading_lookahead", 0.325, low=0.0, high=LONGEST),
        oscillation_reset_dist=reader.number("oscillation_reset_dist", 0.05, low=0.0, high=LONGEST),
    )


def _read_dwa_planner(reader: ParameterTree, resolution: float) -> ControllerParameters:
    """Read DWAPlannerROS, whose biases are per metre; here, occdist_scale is per metre too, and the sum is scaled."""
    path, goal = (
        reader.number(f"{name}_distance_bias", bias, low=0.0, high=HEAVIEST) for name, bias in _BIASES.items()
    )
    scale = sum(_BIASES.values()) / (path + goal) if path + goal else 1.0
    speed = reader.number("max_vel_trans", 0.55, low=0.0, above=True, high=FASTEST, formerly="max_trans_vel")
    lowest, max_vel_x = _speeds_ahead(reader, limit=speed)
    backwards = max_vel_x <= 0.0
    max_vel_theta = reader.number("max_vel_theta", 1.0, low=0.0, above=True, high=FASTEST, formerly="max_rot_vel")
    min_vel_theta = abs(reader.number("min_vel_theta", 0.4, low=-FASTEST, high=FASTEST, formerly="min_rot_vel"))
    return ControllerParameters(
        name=plugin_name(DWA_PLANNER),
        odom_topic=topic(reader, "odom_topic", "odom"),
        acc_lim_x=_acceleration(reader, "acc_lim_x", 2.5),
        acc_lim_y=_acceleration(reader, "acc_lim_y", 2.5),
        acc_lim_theta=_acceleration(reader, "acc_lim_theta", 3.2, formerly="acc_lim_th"),
        max_vel_x=max_vel_x,
        min_vel_x=lowest if backwards else max(0.0, lowest),
        max_vel_theta=max_vel_theta,
        min_vel_theta=-max_vel_theta,
        min_in_place_vel_theta=min(max_vel_theta, max(SLOWEST_TURN, min_vel_theta)),
        y_vels=_lateral_range(reader, speed),
        escape_vel=0.0 if backwards else min(0.0, max(lowest, -0.1)),
        xy_goal_tolerance=reader.number("xy_goal_tolerance", 0.10, low=0.0, above=True, high=LONGEST),
        yaw_goal_tolerance=reader.number("yaw_goal_tolerance", 0.1, low=0.0, above=True, high=LONGEST),
        latch_xy_goal_tolerance=reader.flag("latch_xy_goal_tolerance", False),
        sim_time=reader.number("sim_time", 1.7, low=0.1, high=20.0),
        sim_granularity=reader.number("sim_granularity", 0.025, low=0.001, high=5.0),
        vx_samples=max(1, reader.whole("vx_samples", 3, low=0, high=300)),
        vtheta_samples=max(1, reader.whole("vth_samples", 20, low=0, high=500)),
        path_distance_bias=scale * path,
        goal_distance_bias=scale * goal,
        occdist_scale=scale * reader.number("occdist_scale", 0.01, low=0.0, high=HEAVIEST) / resolution,
        heading_lookahead=reader.number("forward_point_distance", 0.325, low=0.0, high=LONGEST),
        oscillation_reset_dist=reader.number("oscillation_reset_dist", 0.05, low=0.0, high=LONGEST),
    )


def _speeds_ahead(reader: ParameterTree, *, bound: float = FASTEST, limit: float = math.inf) -> tuple[float, float]:
    """Return `min_vel_x` and `max_vel_x` in m/s, neither of which is more than 0 if the robot drives backwards.

    Values beyond `bound` are refused, those beyond `limit` taken as the limit.
    """
    low, high = (
        reader.number(name, default, low=-bound, high=bound)
        for name, default in (("min_vel_x", 0.0), ("max_vel_x", 0.55))
    )
    low, high = max(low, -limit), min(high, limit)
    if high <= 0.0 <= low:
        raise reader.error("max_vel_x", "must be more than 0, or min_vel_x less: the robot then drives backwards", high)
    if low > high:
        raise reader.error("min_vel_x", f"must not be over max_vel_x ({high:g})", low)
    return low, high


def _acceleration(reader: ParameterTree, name: str, default: float, formerly: str = "") -> float:
    return max(LEAST_ACCELERATION, reader.number(name, default, low=0.0, high=FASTEST_CHANGE, formerly=formerly))


def _lateral_range(reader: ParameterTree, speed: float) -> tuple[float, ...]:
    """Return the lateral speeds between `min_vel_y` and `max_vel_y` in m/s; 0 is among the other samples."""
    low, high = (
        reader.number(name, default, low=-FASTEST, high=FASTEST)
        for name, default in (("min_vel_y", -0.1), ("max_vel_y", 0.1))
    )
    if low > high:
        raise reader.error("min_vel_y", f"must not be over max_vel_y ({high:g})", low)
    count = max(2, reader.whole("vy_samples", DWA_Y_SAMPLES, low=0, high=MOST_SIDEWAYS))
    samples = np.linspace(max(low, -speed), min(high, speed), count)
    return tuple(sorted({float(value) for value in samples if abs(value) > 1e-9}))


def _read_lateral_samples(reader: ParameterTree) -> tuple[float, ...]:
    """Return the lateral speeds in m/s: `y_vels`, clipped to max_vel_y and min_vel_y.

    A negative min_vel_y is the fastest speed to the right, one of zero or more the slowest sample's magnitude.
    """
    samples = reader.numbers("y_vels", (-0.3, -0.1, 0.1, 0.3))
    if len(samples) > MOST_SIDEWAYS or any(abs(value) > FASTEST for value in samples):
        raise reader.error("y_vels", f"must be at most {MOST_SIDEWAYS} speeds of at most {FASTEST:g} m/s", samples[:10])
    highest = reader.number("max_vel_y", math.inf, low=0.0, high=FASTEST)
    lowest = reader.number("min_vel_y", -highest, low=-FASTEST, high=FASTEST)
    least = max(lowest, 0.0)
    bound = lowest if lowest < 0 else -highest
    clipped = {min(max(value, bound), highest) for value in samples}
    return tuple(sorted(value for value in clipped if value and abs(value) >= least))


_READERS: dict[str, Callable[[ParameterTree, float], ControllerParameters]] = {
    TRAJECTORY_PLANNER: _read_trajectory_planner,
    DWA_PLANNER: _read_dwa_planner,
}

LOCAL_PLANNERS = tuple(_READERS)
