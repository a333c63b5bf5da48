"""Costmaps: published costs, marking, clearing, rolling, maps that are turned or odd."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from move_base.costmap.costmap import Costmap
from move_base.costmap.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, Geometry, changed_area, occupancy_values
from move_base.costmap.sensors import Observation
from move_base.costmap.static_map import MapError, MapPart, StaticMap
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import ORIGIN, Pose


@pytest.fixture
def local(tree):
    return Costmap(read_parameters(tree()).local_costmap)


def static_map(occupancy, resolution=0.05, origin=(0.0, 0.0, 0.0)):
    rows, columns = occupancy.shape
    return StaticMap.create(occupancy.ravel(), columns, rows, resolution, origin, "map")


def seen(costmap, *points, hits=True, **changes):
    """A scan of the configured source, in the frame `sensor`, whose rays end at the points (x, y)."""
    (source,) = costmap.parameters.sources
    array = np.array([(x, y, 0.0) for x, y in points], dtype=np.float32)
    fields = {"frame": "sensor", "stamp": 1.0, "ordered": True, "source": source, **changes}
    return Observation(points=array, hits=np.full(len(array), hits), **fields)


def fan(distance, count=91, half=math.pi / 4):
    angles = np.linspace(-half, half, count)
    return list(zip(distance * np.cos(angles), distance * np.sin(angles), strict=True))


def at(snapshot, x, y):
    return int(snapshot.costs[snapshot.geometry.cell(x, y)])


def sensor(x=0.0, y=0.0, yaw=0.0, z=0.2):
    return Pose(x, y, yaw).matrix(z)


def test_costs_follow_the_published_function(local):
    snapshot = local.update(ORIGIN, [(seen(local, (2.0, 0.0)), sensor())])
    assert at(snapshot, 2.0, 0.0) == LETHAL
    assert at(snapshot, 2.0, 0.4) == INSCRIBED
    for distance in (0.55, 0.6):
        expected = 252 * math.exp(-3.0 * (distance - 0.5))
        assert at(snapshot, 2.01, 0.01 + distance) == pytest.approx(expected, abs=3)
    assert at(snapshot, 2.0, 0.75) == FREE
    assert snapshot.clearance[snapshot.geometry.cell(2.0, 0.5)] == pytest.approx(0.5, abs=0.05)


def test_nothing_seen_is_free(local):
    snapshot = local.update(ORIGIN, [])
    assert not snapshot.costs.any()
    assert snapshot.clearance.min() == pytest.approx(snapshot.clearance_limit)


def test_far_and_high_returns_mark_nothing(local):
    snapshot = local.update(ORIGIN, [(seen(local, (3.0, 0.0)), sensor(z=2.5))])
    assert not snapshot.costs.any()


def test_sensor_pose_is_applied(local):
    snapshot = local.update(ORIGIN, [(seen(local, (1.0, 0.0)), sensor(1.0, 1.0, math.pi / 2))])
    assert at(snapshot, 1.0, 2.0) == LETHAL


def test_obstacle_that_went_away_is_cleared_by_longer_rays(local):
    local.update(ORIGIN, [(seen(local, (2.0, 0.0)), sensor())])
    snapshot = local.update(ORIGIN, [(seen(local, *fan(3.0), stamp=2.0), sensor())])
    assert at(snapshot, 2.0, 0.0) == FREE
    assert at(snapshot, 3.0, 0.0) == LETHAL


def test_rays_without_return_clear(local):
    local.update(ORIGIN, [(seen(local, (2.0, 0.0)), sensor())])
    snapshot = local.update(ORIGIN, [(seen(local, *fan(12.0), hits=False), sensor())])
    assert not snapshot.costs.any()


def test_what_is_hidden_behind_a_return_stays(local):
    local.update(ORIGIN, [(seen(local, (3.0, 0.0)), sensor())])
    snapshot = local.update(ORIGIN, [(seen(local, *fan(1.5)), sensor())])
    assert at(snapshot, 3.0, 0.0) == LETHAL


def test_what_is_outside_the_field_of_view_stays(local):
    local.update(ORIGIN, [(seen(local, (0.0, 2.0)), sensor())])
    snapshot = local.update(ORIGIN, [(seen(local, *fan(4.0)), sensor())])
    assert at(snapshot, 0.0, 2.0) == LETHAL


def test_unordered_cloud_marks_and_clears(tree):
    sources = tree(local_costmap__obstacles_layer__observation_sources="point_cloud")
    camera = Costmap(read_parameters(sources).local_costmap)
    points = fan(3.0, half=math.pi / 6)
    np.random.default_rng(1).shuffle(points)
    camera.update(ORIGIN, [(seen(camera, (2.0, 0.0), ordered=False), sensor())])
    snapshot = camera.update(ORIGIN, [(seen(camera, *points, ordered=False), sensor())])
    assert at(snapshot, 2.0, 0.0) == FREE
    assert at(snapshot, 3.0, 0.0) == LETHAL


def test_window_rolls_and_keeps_what_it_saw(local):
    local.update(ORIGIN, [(seen(local, (2.0, 0.0)), sensor())])
    snapshot = local.update(Pose(1.234, -0.777, 0.3), [])
    assert at(snapshot, 2.0, 0.0) == LETHAL
    snapshot = local.update(Pose(30.0, 0.0, 0.0), [])
    assert not snapshot.costs.any()


def test_robots_own_area_is_cleared(local):
    snapshot = local.update(ORIGIN, [(seen(local, (0.3, 0.2), (2.0, 0.0)), sensor())])
    assert at(snapshot, 0.3, 0.2) == FREE


def test_every_cell_that_the_robot_covers_in_part_is_cleared(tree):
    parameters = read_parameters(tree()).local_costmap
    corners = np.array(parameters.footprint)
    share = np.linspace(0.0, 1.0, 201)[:, None]
    edge = np.concatenate([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
    rng = np.random.default_rng(1)
    for _ in range(50):
        costmap, robot = Costmap(parameters), Pose(*rng.uniform(-0.5, 0.5, 2), rng.uniform(-3.0, 3.0))
        costmap.update(robot, [])  # moves the costmap there
        costmap.obstacles("obstacles_layer")[:] = LETHAL
        costmap.update(robot, [])
        costs, g = costmap.obstacles("obstacles_layer"), costmap.geometry
        assert (costs[g.cells(robot.apply(edge))] == FREE).all()
        rows, columns = np.nonzero(costs == FREE)
        beside = np.abs(robot.inverse().apply(g.centres(rows, columns))) - corners.max(axis=0)
        assert beside.max() <= g.resolution


def test_clearing_at_the_edge_of_the_costmap_stays_within(tree):
    costmap = Costmap(read_parameters(tree()).local_costmap)
    costmap._clear_footprint(costmap.obstacles("obstacles_layer"), np.array([(2.0, 0.0), (9.0, 0.0), (9.0, 9.0)]))


def test_clear_keeps_what_is_near(local):
    local.update(ORIGIN, [(seen(local, (1.0, 0.0), (4.0, 0.0)), sensor())])
    local.clear(ORIGIN, keep_radius=3.0)
    snapshot = local.update(ORIGIN, [])
    assert (at(snapshot, 1.0, 0.0), at(snapshot, 4.0, 0.0)) == (LETHAL, FREE)
    local.clear()
    assert not local.update(ORIGIN, []).costs.any()


def test_map_gives_the_global_costmap_its_size(tree):
    costmap = Costmap(read_parameters(tree()).global_costmap)
    assert costmap.needs_map
    occupancy = np.zeros((40, 60), dtype=np.int8)
    occupancy[10, 20] = 100
    occupancy[30, 50] = -1
    costmap.set_map(static_map(occupancy, resolution=0.1, origin=(-3.0, -2.0, 0.0)))
    snapshot = costmap.update(ORIGIN, [])
    assert snapshot.costs.shape == (40, 60)
    assert at(snapshot, -3.0 + 2.05, -2.0 + 1.05) == LETHAL
    assert at(snapshot, -3.0 + 5.05, -2.0 + 3.05) == UNKNOWN


def two_maps(tree, **changes):
    """A global costmap with a second static layer, `rooms`, listed last; maps of 2 x 2 m, one obstacle in each."""
    plugins = [*tree()["global_costmap"]["plugins"][:1], {"name": "rooms", "type": "costmap_2d::StaticLayer"}]
    settings = {"global_costmap__plugins": plugins, "global_costmap__rooms__map_topic": "rooms", **changes}
    costmap = Costmap(read_parameters(tree(**settings)).global_costmap)
    for topic, cell in (("map", (5, 5)), ("rooms", (30, 30))):
        occupancy = np.zeros((40, 40), dtype=np.int8)
        occupancy[cell] = 100
        assert costmap.missing_map() == topic
        costmap.set_map(static_map(occupancy), topic)
    assert not costmap.needs_map
    return costmap


def test_later_map_replaces_the_one_before_unless_the_maximum_counts(tree):
    costs = two_maps(tree).update(ORIGIN, []).costs
    assert (costs[5, 5], costs[30, 30]) == (FREE, LETHAL)
    costs = two_maps(tree, global_costmap__rooms__use_maximum=True).update(ORIGIN, []).costs
    assert (costs[5, 5], costs[30, 30]) == (LETHAL, LETHAL)


def test_part_of_a_map_is_updated_for_the_layer_that_asks_for_it(tree):
    part = MapPart.create([100, 100], column=10, row=20, width=2, height=1)
    deaf = two_maps(tree)
    deaf.update_map(part, "rooms")
    assert deaf.update(ORIGIN, []).costs[20, 10] == FREE
    costmap = two_maps(tree, global_costmap__rooms__subscribe_to_updates=True)
    costmap.update_map(part, "rooms")
    costs = costmap.update(ORIGIN, []).costs
    assert (costs[20, 10], costs[20, 11], costs[20, 12]) == (LETHAL, LETHAL, FREE)
    with pytest.raises(MapError, match="reaches beyond the map"):
        costmap.update_map(MapPart.create([1, 1], column=39, row=0, width=2, height=1), "rooms")


def test_first_map_only_keeps_it(tree):
    costmap = two_maps(tree, global_costmap__rooms__first_map_only=True)
    costmap.set_map(static_map(np.zeros((40, 40), dtype=np.int8)), "rooms")
    assert costmap.update(ORIGIN, []).costs[30, 30] == LETHAL


def test_costs_of_a_map_grow_with_its_occupancy_where_asked_for(tree):
    occupancy = np.array([[0, 30, 60, 90, 100, -1]], dtype=np.int8)
    settings = {"global_costmap__plugins": tree()["global_costmap"]["plugins"][:1]}
    for trinary, expected in ((True, [0, 0, 0, 0, 254, 255]), (False, [0, 76, 152, 228, 254, 255])):
        settings["global_costmap__static_layer__trinary_costmap"] = trinary
        costmap = Costmap(read_parameters(tree(**settings)).global_costmap)
        costmap.set_map(static_map(occupancy))
        assert costmap.update(ORIGIN, []).costs.tolist() == [expected]


def test_unknown_cells_are_inflated_where_asked_for(tree):
    occupancy = np.full((40, 60), -1, dtype=np.int8)
    occupancy[10, 20] = 100
    near = (10, 20 + 12)  # 0.6 m from the obstacle, beyond the inscribed radius
    for inflated, expected in ((False, [UNKNOWN, UNKNOWN]), (True, [187, UNKNOWN])):
        settings = {"global_costmap__inflater_layer__inflate_unknown": inflated}
        costmap = Costmap(read_parameters(tree(**settings)).global_costmap)
        costmap.set_map(static_map(occupancy))
        costs = costmap.update(Pose(30.0, 30.0, 0.0), []).costs
        assert [int(costs[near]), int(costs[10, 50])] == pytest.approx(expected, abs=3)


def test_layers_keep_their_obstacles_apart(tree):
    plugins = [{"name": name, "type": "costmap_2d::ObstacleLayer"} for name in ("low", "high")]
    laser = {"observation_sources": "scan", "scan": {"data_type": "LaserScan", "topic": "front/scan"}}
    groups = {"local_costmap__low": {**laser, "enabled": True}, "local_costmap__high": laser}
    costmap = Costmap(read_parameters(tree(local_costmap__plugins=plugins, **groups)).local_costmap)
    low, high = costmap.parameters.sources
    for source, x in ((low, 1.0), (high, 2.0)):
        points = np.array([(x, 0.0, 0.0)], dtype=np.float32)
        costmap.update(ORIGIN, [(Observation(source, "sensor", 1.0, points, np.array([True]), True), sensor())])
    costmap.clear(layers=["low"])
    snapshot = costmap.update(ORIGIN, [])
    assert (at(snapshot, 1.0, 0.0), at(snapshot, 2.0, 0.0)) == (FREE, LETHAL)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.2))
def test_changed_area_holds_all_changes_and_is_the_smallest(seed, share):
    random = np.random.default_rng(seed)
    old = random.integers(0, 3, (7, 9), dtype=np.uint8)
    new = np.where(random.random(old.shape) < share, random.integers(0, 3, old.shape, dtype=np.uint8), old)
    area = changed_area(old, new)
    if area is None:
        assert (old == new).all()
        return
    outside = old != new
    assert all(outside[area].any(axis=axis)[[0, -1]].all() for axis in (0, 1))
    outside[area] = False
    assert not outside.any()


@pytest.mark.parametrize("resolution", [0.025, 0.08, 0.1])
def test_obstacles_of_a_map_are_inflated_in_metres_whatever_its_resolution(tree, resolution):
    costmap = Costmap(read_parameters(tree()).global_costmap)
    cells = round(6.0 / resolution)
    occupancy = np.zeros((cells, cells), dtype=np.int8)
    occupancy[cells // 2, cells // 2] = 100
    costmap.set_map(static_map(occupancy, resolution=resolution))
    snapshot = costmap.update(Pose(1.0, 1.0, 0.0), [])
    centre = (cells // 2 + 0.5) * resolution
    for cost, radius in ((INSCRIBED, 0.5), (1, 0.65)):
        columns = np.nonzero(snapshot.costs[cells // 2] >= cost)[0]
        assert (columns + 0.5).max() * resolution - centre == pytest.approx(radius, abs=1.1 * resolution)
    assert snapshot.clearance[snapshot.geometry.cell(centre + 0.4, centre)] == pytest.approx(0.4, abs=resolution)


def test_turned_map_is_placed_by_its_origin(tree):
    costmap = Costmap(read_parameters(tree()).global_costmap)
    occupancy = np.zeros((40, 60), dtype=np.int8)
    occupancy[20, 50] = 100
    origin = (1.0, 2.0, math.pi / 2)
    costmap.set_map(static_map(occupancy, origin=origin))
    snapshot = costmap.update(ORIGIN, [])
    x, y = Pose(*origin).apply(np.array([[50.5 * 0.05, 20.5 * 0.05]]))[0]
    rows, columns = np.nonzero(snapshot.costs == LETHAL)
    assert snapshot.geometry.centres(rows, columns)[0] == pytest.approx([x, y], abs=0.06)


def test_local_costmap_shows_the_map_through_the_drift_of_odometry(local):
    occupancy = np.zeros((200, 200), dtype=np.int8)
    occupancy[98:102, 138:142] = 100  # around (2, 0) in the map
    local.set_map(static_map(occupancy, origin=(-5.0, -5.0, 0.0)))
    drift = Pose(0.5, 0.2, 0.3)
    snapshot = local.update(ORIGIN, [], {"map": drift})
    x, y = drift.apply(np.array([[2.0, 0.0]]))[0]
    assert at(snapshot, x, y) == LETHAL


@pytest.mark.parametrize("place", [ORIGIN, Pose(1.0, 0.0, 0.0)])
def test_local_costmap_shows_a_map_that_comes_later(local, place):
    def map_with(column):
        occupancy = np.zeros((200, 200), dtype=np.int8)
        occupancy[100, column] = 100
        return static_map(occupancy, origin=(-5.0, -5.0, 0.0))

    local.set_map(map_with(140))
    assert at(local.update(ORIGIN, []), 2.02, 0.02) == LETHAL
    local.set_map(map_with(160))
    snapshot = local.update(place, [])
    assert (at(snapshot, 2.02, 0.02), at(snapshot, 3.02, 0.02)) == (FREE, LETHAL)


@pytest.mark.parametrize(
    ("width", "resolution", "origin"),
    [
        (3, 0.05, (0.0, 0.0, 0.0)),
        (2, 0.0, (0.0, 0.0, 0.0)),
        (2, 1e-9, (0.0, 0.0, 0.0)),
        (2, 0.05, (math.nan, 0.0, 0.0)),
        (2, 0.05, (0.0, -1e18, 0.0)),
        (2, 0.05, (math.nan, 0.0, 0.0)),
        (0, 0.05, (0.0, 0.0, 0.0)),
    ],
)
def test_map_that_makes_no_sense_is_refused(width, resolution, origin):
    with pytest.raises(MapError, match="map"):
        StaticMap.create([0, 0, 0, 0], width, 2, resolution, origin)


def test_published_values_are_those_of_costmap_2d():
    costs = np.array([FREE, 1, 252, INSCRIBED, LETHAL, UNKNOWN], dtype=np.uint8)
    assert occupancy_values(costs).tolist() == [0, 1, 98, 99, 100, -1]


@pytest.mark.filterwarnings("error")
def test_costs_that_fall_at_once_beyond_the_inscribed_radius_are_known(tree):
    costmap = Costmap(read_parameters(tree(local_costmap__inflater_layer__cost_scaling_factor=1e6)).local_costmap)
    snapshot = costmap.update(ORIGIN, [(seen(costmap, (2.0, 0.0)), sensor())])
    assert set(snapshot.costs.ravel()) == {FREE, INSCRIBED, LETHAL}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("away", [0.0, 20.0, 1e6])
def test_robot_far_from_a_fine_grid_frees_nothing_in_it(tree, away):
    fine = {"local_costmap__rolling_window": False, "local_costmap__plugins": tree()["local_costmap"]["plugins"]}
    costmap = Costmap(read_parameters(tree(**fine)).local_costmap)
    costmap.geometry = Geometry(0.001, 100, 100, 0.0, 0.0)
    costmap._obstacles = {name: np.full((100, 100), LETHAL, dtype=np.uint8) for name in costmap._obstacles}
    for obstacles in costmap._obstacles.values():
        costmap._clear_footprint(obstacles, Pose(away, 0.05).apply(costmap._footprint))
        assert (obstacles == LETHAL).all() == (away > 0.0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("reach", [10.0, 1e5, 1e6])
def test_rays_of_any_length_free_only_what_lies_between_them(local, reach):
    local.geometry = Geometry(0.005, 400, 400, -1.0, -1.0)
    obstacles = np.full(local.geometry.shape, LETHAL, dtype=np.uint8)
    angles = np.linspace(-0.5, 0.5, 100)
    local._clear_seen(obstacles, np.zeros(2), (angles, np.full(100, np.float32(2.0 * reach))), reach)
    rows, columns = np.nonzero(obstacles == FREE)
    x, y = local.geometry.centres(rows, columns).T
    assert len(x) > 1000
    beside = np.maximum(np.abs(y * np.cos(0.5)) - x * np.sin(0.5), 0.0)  # distance from the fan, m
    assert beside.max() <= 2 * local.geometry.resolution
