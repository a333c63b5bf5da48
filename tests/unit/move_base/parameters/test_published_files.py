"""Parameter files in forms that public robots use: before Hydro, with parents' parameters, with DWA, with mistakes."""

from __future__ import annotations

import math

import pytest
import yaml
from move_base.parameters.layout import sought_above, with_layers
from move_base.parameters.reader import read_parameters
from node_kit.parameters import ParameterError

CART = """
base_local_planner: dwa_local_planner/DWAPlannerROS
controller_frequency: 10.0
global_costmap: &common
  static_map: true
  map_type: costmap
  robot_base_frame: base_footprint
  footprint: [[-0.1, -0.1], [-0.1, 0.1], [0.04, 0.1], [0.04, -0.1]]
  obstacle_range: 3.0
  raytrace_range: 3.5
  inflation_radius: 1.0
  cost_scaling_factor: 3.0
  observation_sources: sweep
  sweep: {sensor_frame: sweep_link, data_type: LaserScan, topic: sweep, marking: true, clearing: true}
local_costmap:
  <<: *common
  static_map: false
  global_frame: odom
  rolling_window: true
  width: 3
  height: 3.4
DWAPlannerROS:
  max_vel_x: 0.22
  min_vel_x: -0.22
  max_vel_y: 0.0
  min_vel_y: 0.0
  max_trans_vel: 0.3
  max_vel_theta: 2.75
  min_vel_theta: 1.37
  acc_lim_y: 0.0
  vy_samples: 0
  vth_samples: 40
  path_distance_bias: 32.0
  goal_distance_bias: 20.0
  occdist_scale: 0.02
"""
"""A small differential-drive robot, configured as before Hydro, driven by DWA."""

CRATE = """
global_costmap:
  plugins:
    - {name: floor, type: "costmap_2d::StaticLayer"}
    - {name: seen, type: "costmap_2d::VoxelLayer"}
    - {name: grown, type: "costmap_2d::InflationLayer"}
  floor: {map_topic: /floor, subscribe_to_updates: true}
  seen:
    observation_sources: fog sonar
    obstacle_range: 4.5
    max_obstacle_height: 0.9
    fog: {data_type: PointCloud2, max_obstacle_height: 1.5, raytrace_range: 7}
    sonar: {topic: bumps}
  grown: {inflation_radius: 0.3}
  inflation_radius: 0.8
local_costmap:
  plugins: [{name: seen, type: "costmap_2d::ObstacleLayer"}]
  seen: {observation_sources: fog, fog: {data_type: PointCloud2}}
raytrace_range: 6.0
robot_radius: 0.31
"""
"""A robot with layers of its own names, whose parameters stand on several levels."""


def read(text: str, **changes):
    tree = yaml.safe_load(text)
    for path, value in changes.items():
        *groups, name = path.split("__")
        level = tree
        for group in groups:
            level = level.setdefault(group, {})
        level[name] = value
    return read_parameters(tree)


def layer(costmap, name):
    return next(one for one in costmap.layers if one.name == name)


def test_costmap_without_plugins_gets_the_layers_of_its_former_parameters():
    parameters = read(CART)
    names = [(one.name, one.kind) for one in parameters.global_costmap.layers]
    assert names == [("static_layer", "static"), ("obstacle_layer", "obstacle"), ("inflation_layer", "inflation")]
    assert [one.name for one in parameters.local_costmap.layers] == ["obstacle_layer", "inflation_layer"]
    (source,) = parameters.local_costmap.sources
    assert (source.topic, source.data_type, source.sensor_frame) == ("sweep", "LaserScan", "sweep_link")
    assert (source.obstacle_range, source.raytrace_range) == (3.0, 3.5)
    assert layer(parameters.local_costmap, "inflation_layer").inflation_radius == 1.0
    assert "lists no plugins" in " ".join(parameters.notes)


def test_former_parameters_can_mean_a_voxel_layer():
    parameters = read(CART, local_costmap__map_type="voxel", local_costmap__z_voxels=10)
    assert layer(parameters.local_costmap, "obstacle_layer").kind == "voxel"


def test_layer_may_have_the_name_of_a_former_parameter():
    plugins = [{"name": "static_map", "type": "costmap_2d::StaticLayer"}]
    parameters = read(CRATE, global_costmap__plugins=plugins, global_costmap__static_map=True)
    assert [(one.name, one.map_topic) for one in parameters.global_costmap.layers] == [("static_map", "map")]


def test_form_of_the_tree_is_final():
    once = with_layers(yaml.safe_load(CART))
    assert with_layers(once) == once
    assert read_parameters(once).local_costmap == read(CART).local_costmap


def test_only_what_is_lacking_is_looked_for_above_the_node(tree):
    assert sought_above(tree()) == []
    assert sought_above(yaml.safe_load(CART)) == []
    crate = yaml.safe_load(CRATE)
    assert sought_above(crate) == ["obstacle_range"]  # of the local costmap's source
    del crate["robot_radius"], crate["raytrace_range"]
    assert set(sought_above(crate)) == {"footprint", "robot_radius", "obstacle_range", "raytrace_range"}


def test_size_is_rounded_to_metres():
    assert (read(CART).local_costmap.width, read(CART).local_costmap.height) == (3.0, 3.0)
    assert read(CART, local_costmap__width=5.5).local_costmap.width == 6.0


def test_parameter_of_the_costmap_replaces_that_of_its_layer():
    assert layer(read(CRATE).global_costmap, "grown").inflation_radius == 0.8


def test_ranges_are_looked_for_in_the_levels_above():
    fog, sonar = layer(read(CRATE).global_costmap, "seen").sources
    assert (fog.obstacle_range, fog.raytrace_range) == (4.5, 7.0)
    assert (sonar.obstacle_range, sonar.raytrace_range) == (4.5, 6.0)


def test_footprint_is_looked_for_in_the_levels_above():
    assert math.hypot(*read(CRATE).local_costmap.footprint[3]) == pytest.approx(0.31)
    square = [[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2]]
    assert read(CRATE, footprint=square).global_costmap.footprint[0] == (0.2, 0.2)


@pytest.mark.parametrize("text", ["[[.2, .1], [-.2, .1], [0., -.1]]", "[[0.2,0.1],[-0.2,0.1],[0,-0.1]]"])
def test_footprint_is_a_text_in_any_form_of_numbers(text):
    assert read(CRATE, footprint=text).local_costmap.footprint == ((0.2, 0.1), (-0.2, 0.1), (0.0, -0.1))


def test_lower_limit_of_height_counts():
    fog, sonar = layer(read(CRATE).global_costmap, "seen").sources
    assert (fog.max_obstacle_height, sonar.max_obstacle_height) == (0.9, 0.9)


def test_source_without_parameters_is_a_point_cloud_on_the_topic_of_its_name():
    (source,) = read(CRATE, local_costmap__seen__observation_sources="fog2").local_costmap.sources
    assert (source.topic, source.data_type) == ("fog2", "PointCloud")


def test_source_named_twice_counts_once():
    assert len(read(CRATE, local_costmap__seen__observation_sources="fog fog").local_costmap.sources) == 1


def test_frames_and_windows_have_the_published_defaults():
    local = read(CRATE).local_costmap
    assert (local.global_frame, local.rolling_window) == ("map", False)


def test_parameters_of_dwa_limit_the_controller():
    controller = read(CART).controller
    assert controller.name == "DWAPlannerROS"
    assert (controller.max_vel_x, controller.min_vel_x, controller.escape_vel) == (0.22, 0.0, -0.1)
    assert (controller.max_vel_theta, controller.min_vel_theta, controller.min_in_place_vel_theta) == (
        2.75,
        -2.75,
        1.37,
    )
    assert controller.y_vels == ()
    assert controller.acc_lim_y > 0.0
    assert (controller.vx_samples, controller.vtheta_samples) == (3, 40)


def test_dwa_without_a_speed_ahead_drives_backwards_no_faster_than_its_limit():
    controller = read(CART, DWAPlannerROS__max_vel_x=0.0, DWAPlannerROS__max_vel_trans=0.2).controller
    assert controller.backwards
    assert (controller.min_vel_x, controller.max_vel_x, controller.escape_vel) == (-0.2, 0.0, 0.0)
    assert not read(CART).controller.backwards


def test_former_names_of_dwa_are_understood():
    assert read(CART, DWAPlannerROS__max_trans_vel=0.15).controller.max_vel_x == 0.15
    assert read(CART, DWAPlannerROS__max_vel_trans=0.1).controller.max_vel_x == 0.1


def test_base_that_moves_sideways_gets_samples_between_the_limits_of_dwa():
    controller = read(CART, DWAPlannerROS__max_vel_y=0.2, DWAPlannerROS__min_vel_y=-0.1, DWAPlannerROS__vy_samples=4)
    assert controller.controller.y_vels == pytest.approx((-0.1, 0.1, 0.2))


def test_weights_of_dwa_keep_their_ratios():
    controller = read(CART).controller
    assert controller.path_distance_bias / controller.goal_distance_bias == pytest.approx(32 / 20)
    per_cost = controller.occdist_scale * read(CART).local_costmap.resolution
    assert per_cost / controller.path_distance_bias == pytest.approx(0.02 / 32)


@pytest.mark.parametrize("kind", ["teb_local_planner/TebLocalPlannerROS", "mine/Planner"])
def test_planner_that_is_not_replaced_is_refused_with_the_remedy(kind):
    with pytest.raises(
        ParameterError, match=r"base_local_planner is .*: it must be one of .*use the original move_base"
    ):
        read(CART, base_local_planner=kind)
    with pytest.raises(ParameterError, match="base_global_planner"):
        read(CART, base_global_planner=kind)


def test_global_planner_has_its_own_group():
    parameters = read(
        CART, base_global_planner="global_planner/GlobalPlanner", GlobalPlanner={"default_tolerance": 0.4}
    )
    assert (parameters.global_planner, parameters.default_tolerance) == ("GlobalPlanner", 0.4)
    assert read(CART, GlobalPlanner={"default_tolerance": 0.4}).default_tolerance == 0.0


def test_trajectory_planner_listens_to_odom_whatever_odom_topic_says():
    parameters = read(CRATE, TrajectoryPlannerROS={"odom_topic": "wheels"})
    assert parameters.controller.odom_topic == "odom"
    assert "remap odom to wheels" in " ".join(parameters.notes)
    assert read(CART, DWAPlannerROS__odom_topic="wheels").controller.odom_topic == "wheels"


CLEAR, ROTATE = "clear_costmap_recovery/ClearCostmapRecovery", "rotate_recovery/RotateRecovery"


@pytest.mark.parametrize(
    ("behaviours", "words"),
    [
        ([{"name": "a", "type": CLEAR}, {"name": "a", "type": ROTATE}], "one name"),
        ([{"name": "a"}], "no type"),
        (["a"], "no name or no type"),
        ("a", "is no list"),
        ([{"name": "a", "type": "mine/Dance"}], "not known here: mine/Dance"),
    ],
)
def test_list_of_recovery_with_a_mistake_is_replaced_by_the_default(behaviours, words):
    parameters = read(CRATE, recovery_behaviors=behaviours)
    names = [one.name for one in parameters.recovery_behaviors]
    assert names == ["conservative_reset", "rotate_recovery", "aggressive_reset", "rotate_recovery"]
    assert words in " ".join(parameters.notes)


def test_recovery_without_its_package_is_a_former_form():
    (behaviour,) = read(CRATE, recovery_behaviors=[{"name": "turn", "type": "RotateRecovery"}]).recovery_behaviors
    assert (behaviour.name, behaviour.kind) == ("turn", "rotate")


def test_recovery_clears_layers_named_obstacles_unless_told_otherwise():
    parameters = read(CRATE)
    assert parameters.recovery_behaviors[0].layer_names == ("obstacles",)
    assert "conservative_reset clears nothing: no costmap has a layer obstacles" in " ".join(parameters.notes)
    told = read(CRATE, conservative_reset__layer_names=["seen"], aggressive_reset__layer_names=["seen"])
    assert told.recovery_behaviors[0].layer_names == ("seen",)
    assert not told.notes


def test_parameters_without_any_map_or_sensor_are_refused():
    with pytest.raises(ParameterError, match=r"neither a map nor a sensor.*load the base navigation parameters first"):
        read_parameters({"controller_frequency": 5.0})
