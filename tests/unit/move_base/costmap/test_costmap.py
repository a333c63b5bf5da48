"""Costmaps: published costs, marking, clearing, rolling, maps that are turned or odd."""

import math

import numpy as np
import pytest
from move_base.costmap.costmap import Costmap
from move_base.costmap.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, occupancy_values
from move_base.costmap.sensors import Observation
from move_base.costmap.static_map import MapError, StaticMap
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import ORIGIN, Pose


@pytest.fixture
def local(tree):
    return Costmap(read_parameters(tree()).local_costmap)


def static_map(occupancy, resolution=0.05, origin=(0.0, 0.0, 0.0)):
    rows, columns = occupancy.shape
    return StaticMap.create(occupancy.ravel(), columns, rows, resolution, origin)


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
    snapshot = local.update(ORIGIN, [], drift)
    x, y = drift.apply(np.array([[2.0, 0.0]]))[0]
    assert at(snapshot, x, y) == LETHAL


@pytest.mark.parametrize(
    ("width", "resolution", "origin"),
    [
        (3, 0.05, (0.0, 0.0, 0.0)),
        (2, 0.0, (0.0, 0.0, 0.0)),
        (2, 1e-9, (0.0, 0.0, 0.0)),
        (2, math.inf, (0.0, 0.0, 0.0)),
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
