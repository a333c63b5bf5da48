"""Parameters: published names and defaults, one clear error per mistake."""

import pytest
from move_base.parameters.parameters import DEFAULT_UPDATE_PERIOD
from move_base.parameters.reader import read_parameters
from node_kit.parameters import ParameterError


def test_base_file_of_d2_loads(tree):
    parameters = read_parameters(tree())
    assert parameters.controller.max_vel_x == 0.5
    assert [layer.kind for layer in parameters.global_costmap.layers] == ["static", "obstacle", "inflation"]
    assert [source.topic for source in parameters.local_costmap.sources] == ["front/scan"]
    assert parameters.local_costmap.padded_footprint().max(axis=0) == pytest.approx([0.58, 0.5])


def test_whole_numbers_are_taken_for_real_ones(tree):
    assert read_parameters(tree(controller_frequency=15)).controller_frequency == 15.0


def test_several_sources_are_read(tree):
    parameters = read_parameters(tree(local_costmap__obstacles_layer__observation_sources="scan point_cloud"))
    assert [source.data_type for source in parameters.local_costmap.sources] == ["LaserScan", "PointCloud2"]


def test_layer_that_is_not_enabled_is_not_used(tree):
    off = read_parameters(tree(local_costmap__obstacles_layer__enabled=False)).local_costmap
    assert off.sources == ()
    assert [source.topic for source in off.all_sources] == ["front/scan"]  # it can be enabled later


def test_footprint_may_be_a_text(tree):
    text = "[[0.3, 0.2], [0.3, -0.2], [-0.3, 0.0]]"
    assert read_parameters(tree(local_costmap__footprint=text)).local_costmap.footprint[0] == (0.3, 0.2)


def test_radius_replaces_an_empty_footprint(tree):
    footprint = read_parameters(
        tree(local_costmap__footprint=[], local_costmap__robot_radius=0.3)
    ).local_costmap.footprint
    assert len(footprint) == 16
    assert footprint[0] == pytest.approx((0.3, 0.0))


def test_lateral_samples_may_be_a_text(tree):
    parameters = read_parameters(tree(TrajectoryPlannerROS__y_vels="[-0.2, 0.2]"))
    assert parameters.controller.y_vels == (-0.2, 0.2)


@pytest.mark.parametrize(
    ("former", "name", "value"),
    [
        ("max_rotational_vel", "max_vel_theta", 0.7),
        ("min_in_place_rotational_vel", "min_in_place_vel_theta", 0.3),
        ("acc_lim_th", "acc_lim_theta", 2.0),
        ("backup_vel", "escape_vel", -0.2),
        ("pdist_scale", "path_distance_bias", 0.9),
        ("gdist_scale", "goal_distance_bias", 0.4),
    ],
)
def test_former_names_are_understood_and_yield_to_the_present_ones(tree, former, name, value):
    given = tree()
    given["TrajectoryPlannerROS"].pop(name, None)
    given["TrajectoryPlannerROS"][former] = value
    assert getattr(read_parameters(given).controller, name) == value
    given["TrajectoryPlannerROS"][name] = 2 * value
    assert getattr(read_parameters(given).controller, name) == 2 * value


def test_missing_update_period_gets_the_documented_one(tree):
    changed = tree()
    del changed["local_costmap"]["obstacles_layer"]["scan"]["expected_update_rate"]
    (source,) = read_parameters(changed).local_costmap.sources
    assert source.expected_update_rate == DEFAULT_UPDATE_PERIOD


@pytest.mark.parametrize(
    ("samples", "limits", "expected"),
    [
        ([-0.3, 0.3], {"max_vel_y": 0.2}, (-0.2, 0.2)),
        ([-0.3, 0.3], {"max_vel_y": 0.5, "min_vel_y": -0.1}, (-0.1, 0.3)),
        ([-0.3, -0.1, 0.1, 0.3], {"max_vel_y": 0.5, "min_vel_y": 0.2}, (-0.3, 0.3)),
    ],
)
def test_lateral_limits_clip_the_samples(tree, samples, limits, expected):
    changes = {f"TrajectoryPlannerROS__{name}": value for name, value in limits.items()}
    parameters = read_parameters(tree(TrajectoryPlannerROS__y_vels=samples, **changes))
    assert parameters.controller.y_vels == expected


def test_costmap_that_no_memory_holds_is_refused(tree):
    size = {f"local_costmap__{name}": value for name, value in (("width", 900.0), ("height", 900.0))}
    with pytest.raises(ParameterError, match=r"local_costmap/resolution is .*: it gives .* over 50,000,000 cells"):
        read_parameters(tree(local_costmap__resolution=0.01, **size))


@pytest.mark.parametrize(
    ("path", "value", "rule"),
    [
        ("controller_frequency", "fast", "must be a finite number"),
        ("controller_frequency", True, "must be a finite number"),
        ("controller_frequency", 0.0, "must be a finite number, at least 0.1"),
        ("planner_patience", float("nan"), "must be a finite number"),
        ("TrajectoryPlannerROS__max_vel_x", -0.5, "more than 0"),
        ("TrajectoryPlannerROS__min_vel_x", 0.6, "must not be over max_vel_x"),
        ("TrajectoryPlannerROS__min_vel_x", -0.2, "max_vel_x 0 or less: the robot then drives backwards"),
        ("TrajectoryPlannerROS__max_vel_x", 0.0, "more than 0, or min_vel_x less"),
        ("TrajectoryPlannerROS__vx_samples", 2.5, "must be a whole number"),
        ("TrajectoryPlannerROS__y_vels", [0.1, "left"], "must be a list of finite numbers"),
        ("TrajectoryPlannerROS__y_vels", "to the left", "must be a list of finite numbers"),
        ("TrajectoryPlannerROS__y_vels", [float("inf")], "must be a list of finite numbers"),
        ("TrajectoryPlannerROS", 3, "must be a group of parameters"),
        ("global_costmap__inflater_layer__inflation_radius", float("inf"), "must be a finite number"),
        (
            "global_costmap__plugins",
            [{"name": "a", "type": "b"}],
            "unknown type; known are costmap_2d::StaticLayer",
        ),
        ("global_costmap__footprint", [[1.0, 2.0]], "at least three"),
        ("global_costmap__footprint", "round", "list of [x, y] corners"),
        ("local_costmap__rolling_window", "yes", "must be true or false"),
        (
            "local_costmap__obstacles_layer__scan__data_type",
            "Image",
            "must be one of LaserScan, PointCloud, PointCloud2",
        ),
        ("global_costmap__robot_radius", 460.0, "at most 20"),
        ("global_costmap__footprint", [[480.0, 400.0], [-480.0, 400.0], [0.0, -400.0]], "within 20 m"),
        ("global_costmap__footprint", [[0.01 * n, 0.0] for n in range(1001)], "at most 1,000 corners"),
        ("global_costmap__footprint", [[1.0, 1.0], [-1.0, -1.0]] * 100, "edges of at most 200 m"),
        ("global_costmap__footprint", "[" * 5000, "list of [x, y] corners"),
        ("global_costmap__footprint", f"[[1{'0' * 400}, 0], [1, 1], [0, 1]]", "list of [x, y] corners"),
        ("global_costmap__footprint", [[10**400, 0], [1, 1], [0, 1]], "list of [x, y] corners"),
        ("global_costmap__footprint", " " * 60_001, "at most 60,000 characters"),
        ("global_costmap__footprint_padding", 1e9, "at most 10"),
        ("local_costmap__footprint_topic", "/", "must be the name of a topic"),
        ("local_costmap__published_footprint", "", "must be the name of a topic"),
        ("local_costmap__static_layer__map_topic", "", "must be the name of a topic"),
        ("local_costmap__obstacles_layer__scan__topic", "", "must be the name of a topic"),
        ("TrajectoryPlannerROS__y_vels", [1e9], "at most 100 m/s"),
        ("TrajectoryPlannerROS__y_vels", [0.1] * 301, "at most 300 speeds"),
    ],
)
def test_mistake_is_named(tree, path, value, rule):
    with pytest.raises(ParameterError) as error:
        read_parameters(tree(**{path: value}))
    assert path.split("__")[-1] in str(error.value)
    assert rule in str(error.value)


def test_lists_that_repeat_each_other_in_a_footprint_are_refused_at_once(tree):
    text = "&l0 [" + ", ".join(["1"] * 10) + "]"
    for level in range(1, 9):
        text = f"&l{level} [{text}, {', '.join([f'*l{level - 1}'] * 9)}]"  # 10 ** 9 numbers
    with pytest.raises(ParameterError, match=r"footprint is .* must be a list of \[x, y\] corners"):
        read_parameters(tree(local_costmap__footprint=text))


def test_error_of_a_long_footprint_is_short(tree):
    with pytest.raises(ParameterError) as error:
        read_parameters(tree(local_costmap__footprint=[[0.1, 0.2]] * 5000))
    assert len(str(error.value)) < 500


def test_layers_of_one_name_are_refused(tree):
    plugins = tree()["local_costmap"]["plugins"]
    with pytest.raises(ParameterError, match=r"plugins\[3\] is 'static_layer': it must have another name"):
        read_parameters(tree(local_costmap__plugins=[*plugins, plugins[0]]))


def test_samples_that_take_longer_than_a_control_period_are_refused(tree):
    samples = {"TrajectoryPlannerROS__vx_samples": 300, "TrajectoryPlannerROS__vtheta_samples": 300}
    with pytest.raises(ParameterError, match="vx_samples is 300: it gives, with the samples of turns, over 20,000"):
        read_parameters(tree(**samples))


def test_recovery_behaviour_whose_type_is_no_text_has_a_note(tree):
    (note, *_) = read_parameters(tree(recovery_behaviors=[{"name": "a", "type": ["x"]}])).notes
    assert "types that are not known here: ['x']" in note


DWA = {"base_local_planner": "dwa_local_planner/DWAPlannerROS"}


@pytest.mark.parametrize(
    ("path", "others"),
    [
        *[(name, {}) for name in ("controller_patience", "planner_patience", "conservative_reset_dist")],
        *[(name, {}) for name in ("oscillation_timeout", "oscillation_distance", "NavfnROS__default_tolerance")],
        ("wipe__reset_distance", {"recovery_behaviors": [{"name": "wipe", "type": "ClearCostmapRecovery"}]}),
        *[(f"local_costmap__{name}", {}) for name in ("transform_tolerance", "origin_x", "origin_y")],
        ("local_costmap__circumscribed_radius", {}),
        ("local_costmap__obstacles_layer__max_obstacle_height", {}),
        *[
            (f"local_costmap__obstacles_layer__scan__{name}", {})
            for name in ("obstacle_range", "raytrace_range", "expected_update_rate", "max_obstacle_height")
        ],
        ("local_costmap__inflater_layer__cost_scaling_factor", {}),
        *[
            (f"TrajectoryPlannerROS__{name}", {})
            for name in ("acc_lim_x", "acc_lim_y", "acc_lim_theta", "xy_goal_tolerance", "yaw_goal_tolerance")
        ],
        *[
            (f"TrajectoryPlannerROS__{name}", {})
            for name in ("max_vel_y", "heading_lookahead", "oscillation_reset_dist", "occdist_scale")
        ],
        *[
            (f"DWAPlannerROS__{name}", DWA)
            for name in ("max_vel_x", "max_vel_trans", "max_vel_y", "max_vel_theta", "min_vel_theta", "occdist_scale")
        ],
    ],
)
def test_value_that_overflows_is_refused(tree, path, others):
    read_parameters(tree(**others, **{path: 1.0}))
    with pytest.raises(ParameterError, match=f"{path.split('__')[-1]} is 1e.308: it must be a finite number"):
        read_parameters(tree(**others, **{path: 1e308}))
