import itertools
import math
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.grid import FREE, OCCUPIED, UNKNOWN
from pybullet_simulator.world.walking import Walker
from pybullet_simulator.world.world import Box, World, WorldError, rasterise

WORLDS = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/worlds"
FLOOR = "floor: {x: [-5, 5], y: [-5, 5]}\n"
LARGE_FLOOR = "floor: {x: [0, 200], y: [0, 200]}\n"
RACK = "racks: [{name: rack, position: [2, 0], size: [0.05, 1], height: 1}]\n"


def world_of(tmp_path, text):
    path = tmp_path / "hall.yaml"
    path.write_text(text)
    return read_world(path)


def gap(one, other):
    return min(one.distance(*other.points()).min(), other.distance(*one.points()).min())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("boxes: [", "correct the YAML"),
        ("- 1", "holds no world"),
        ("floor: {x: [1, 1], y: [0, 1]}", "floor: each max"),
        ("floor: {x: [0, .inf], y: [0, 1]}", "floor: x: must be 2 finite numbers"),
        (FLOOR + "tables: []", "tables: unknown key"),
        (FLOOR + "boxes: {a: 1}", "boxes: must be a list"),
        (FLOOR + "boxes: [3]", r"boxes\[0\]: must be a box with a name"),
        (FLOOR + "boxes: [{name: a, position: [0, 0], size: [1, 1]}]", r"boxes\[0\] 'a': lacks height"),
        (FLOOR + "boxes: [{name: a, position: [0], size: [1, 1], height: 1}]", r"'a': position: must be 2"),
        (FLOOR + "boxes: [{name: a, position: [0, 0], size: [1, -1], height: 1}]", "'a': size and height"),
        (FLOOR + "boxes: [{name: a, position: [0, 0], size: [1, 1], height: x}]", "'a': height: must be 1 finite"),
        (FLOOR + "boxes: [{name: a, position: [0, 0], size: [1, 1], height: 1, mass: 2}]", "'a': unknown key mass"),
        (FLOOR + "boxes: [{name: a, position: [9, 0], size: [1, 1], height: 1}]", "'a': position .* off the floor"),
        (FLOOR + "racks: [&a {name: a, position: [0, 0], size: [1, 1], height: 1}, *a]", "'a': the name stands twice"),
        (FLOOR + "people: [3]", r"people\[0\]: must be a person with a name"),
        (FLOOR + "people: [{name: a, waypoints: [[0, 0]]}]", r"'a': waypoints: give two or more"),
        (FLOOR + "people: [{name: a, waypoints: [[0, 0], [1, x]]}]", r"'a': waypoints: must be 2 finite"),
        (FLOOR + "people: [{name: a, waypoints: [[0, 0], [1, 9]]}]", "'a': waypoint .* off the floor"),
        (FLOOR + "people: [{name: a, waypoints: [[0, 0], [1, 1]], speed: 0}]", "'a': speed: is 0; give more"),
        (FLOOR + RACK + "people: [{name: a, waypoints: [[0, 0], [4, 0]]}]", "'a': the way leads into 'rack'"),
        (FLOOR + "people: [{name: a, waypoints: [[0, 0], [1, 1]], age: 7}]", "'a': unknown key age"),
        (FLOOR + f"boxes: [{'0, ' * 501}]", "boxes: more than 500 boxes"),
        (FLOOR + f"people: [{'0, ' * 101}]", "people: are 101; give at most 100"),
        (
            FLOOR + f"people: [{{name: a, waypoints: [{'[0, 0], ' * 501}]}}]",
            "'a': waypoints: are 501 on 0 m; give at most",
        ),
        (
            LARGE_FLOOR + f"people: [{{name: a, waypoints: [{'[0, 0], [200, 0], ' * 26}]}}]",
            "'a': waypoints: are 52 on 10200 m; give at most",
        ),
        (
            LARGE_FLOOR
            + f"people: [{{name: a, waypoints: &w [{'[0, 0], [200, 0], ' * 20}]}}, {{name: b, waypoints: *w}}]",
            "people: their ways are longer than 10000 m in all",
        ),
        (FLOOR + "#" * 80_000, "bytes are too many"),
    ],
)
def test_bad_world_is_refused_with_file_and_entry(tmp_path, text, message):
    with pytest.raises(WorldError, match=message) as caught:
        world_of(tmp_path, text)
    assert "hall.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_world_is_refused():
    with pytest.raises(WorldError, match=r"nowhere\.yaml: No such file"):
        read_world(Path("nowhere.yaml"))


def test_distance_to_a_turned_box():
    box = Box("a", "box", 1.0, 1.0, 2.0, 1.0, 1.0, math.pi / 2)
    assert box.distance(1.0, 1.9) == pytest.approx(0.0)
    assert box.distance(2.5, 1.0) == pytest.approx(1.0)
    assert box.distance(1.5 + 0.3, 2.0 + 0.4) == pytest.approx(0.5)


def test_people_are_in_the_world_but_not_on_its_map(tmp_path):
    world = world_of(tmp_path, FLOOR + "people: [{name: ann, waypoints: [[0, 0], [3, 0], [3, 4]], speed: 1.5}]")
    (ann,) = world.walkers
    assert ann.speed == 1.5
    assert [ann.place(walked) for walked in (0.0, 1.0, 5.0, 7.0, 9.0, 14.0)] == [
        (0.0, 0.0),
        (1.0, 0.0),
        (3.0, 2.0),
        (3.0, 4.0),
        (3.0, 2.0),
        (0.0, 0.0),
    ]
    assert OCCUPIED not in rasterise(world).cells


def test_map_marks_boxes_floor_and_outside(tmp_path):
    world = world_of(tmp_path, FLOOR + "boxes: [{name: a, position: [2, 1], size: [1, 0.5], height: 1}]")
    grid = rasterise(world)

    def cell(x, y):
        return grid.cells[int((y - grid.origin_y) / grid.resolution), int((x - grid.origin_x) / grid.resolution)]

    assert grid.cells.shape == (220, 220)
    assert (grid.origin_x, grid.origin_y) == (-5.5, -5.5)
    assert cell(2.4, 1.2) == OCCUPIED
    assert cell(2.4, 1.4) == FREE
    assert cell(1.0, 2.0) == FREE
    assert cell(5.3, 0.0) == UNKNOWN
    assert (grid.cells == OCCUPIED).sum() == pytest.approx(1.0 * 0.5 / 0.05**2, rel=0.15)


@given(
    st.lists(
        st.builds(
            lambda x, y, length, width, yaw: Box("a", "box", x, y, length, width, 1.0, yaw),
            *[st.floats(-4.0, 4.0)] * 2,
            *[st.sampled_from([0.001, 0.05, 0.3, 2.0, 9.0, 1e300])] * 2,
            st.sampled_from([0.0, 1e-17, 0.4, math.pi / 2, 9.0]) | st.floats(-4.0, 4.0),
        ),
        max_size=4,
    ),
    st.sampled_from([0.05, 0.25]),
)
def test_map_marks_the_cells_that_any_box_touches(boxes, resolution):
    grid = rasterise(World("hall", -3.0, 3.0, -2.0, 2.0, tuple(boxes)), resolution)
    rows, columns = np.indices(grid.cells.shape)
    x, y = grid.to_map((columns + 0.5) * resolution, (rows + 0.5) * resolution)
    touched = np.zeros(grid.cells.shape, dtype=bool)
    for box in boxes:
        touched |= box.distance(x, y) < resolution / 2.0 - 1e-6
    np.testing.assert_array_equal(grid.cells == OCCUPIED, touched)


def test_many_boxes_as_large_as_the_floor_are_drawn_at_once():
    boxes = tuple(Box("a", "box", 100.0, 100.0, 200.0, 200.0, 1.0, yaw) for yaw in range(100))
    began = time.process_time()
    rasterise(World("hall", 0.0, 200.0, 0.0, 200.0, boxes))
    assert time.process_time() - began < 5.0


@given(
    st.lists(
        st.builds(
            lambda x, y, length, width, yaw: Box("a", "box", x, y, length, width, 1.0, yaw),
            *[st.floats(0.0, 60.0)] * 2,
            *[st.sampled_from([0.001, 0.3, 9.0])] * 2,
            st.floats(-4.0, 4.0),
        ),
        max_size=8,
    ),
    st.lists(st.tuples(*[st.floats(0.0, 60.0)] * 2), min_size=2, max_size=4).filter(
        lambda points: len(set(points)) > 1
    ),
)
def test_a_way_is_blocked_where_a_box_is_nearest_to_it(boxes, waypoints):
    world, walker = World("hall", 0.0, 60.0, 0.0, 60.0, tuple(boxes)), Walker("a", tuple(waypoints))
    places = walker.places(0.25)
    walked = np.linspace(0.0, walker.length, len(places))
    np.testing.assert_allclose(places, [walker.place(length) for length in walked], atol=1e-6)
    blocked = (place for place in places.tolist() if world.nearest(*place)[1] < 0.25)
    assert world.first_within(0.25, places) == next(map(tuple, blocked), None)


def test_factory_has_four_narrow_aisles_and_else_wide_ways():
    world = read_world(WORLDS / "factory.yaml")
    narrow = {
        (one.name, other.name): round(distance, 3)
        for one, other in itertools.combinations(world.boxes, 2)
        if 0.03 < (distance := gap(one, other)) < 1.2
    }
    assert narrow == {(f"row_{index}", f"row_{index + 1}"): 1.1 for index in range(1, 5)}


def test_every_route_crosses_the_row_of_racks():
    routes = yaml.safe_load((WORLDS / "routes.yaml").read_text())["routes"]
    assert all(route["start"][1] * route["goal"][1] < 0.0 for route in routes.values())


def test_routes_start_and_end_clear_of_obstacles():
    world = read_world(WORLDS / "factory.yaml")
    routes = yaml.safe_load((WORLDS / "routes.yaml").read_text())["routes"]
    assert len(routes) == 6
    for name, route in routes.items():
        for x, y, _ in (route["start"], route["goal"]):
            assert world.contains(x, y), name
            assert world.nearest(x, y)[1] >= 1.0, name
