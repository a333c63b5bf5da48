"""Which map is used: anybody may publish one, in whatever frame, before or after the robot's own."""

import math

import numpy as np
import pytest
from move_base.costmap.grid import LETHAL, Geometry
from move_base.costmap.static_map import MapError, MapPart, StaticMap
from move_base.costmap.surroundings import KEPT_MAPS, Surroundings
from move_base.parameters.reader import read_parameters
from robot_formulas.geometry import ORIGIN, Pose

CELLS = 40
FREE, OCCUPIED = 0, 100


class Frames:
    """Frames that all lie in the same place, but for some."""

    def __init__(self):
        self.connected = {"map", "odom", "base_link"}
        self.places = {}
        self.stamps = {}

    def lookup(self, target, source, stamp):
        if not {target, source} <= self.connected:
            return None
        return (self.places.get(target, ORIGIN).inverse() @ self.places.get(source, ORIGIN)).matrix()

    def newest(self, target, source):
        return self.stamps.get(source, math.inf)


def a_map(value, frame="map"):
    return StaticMap.create(np.full(CELLS * CELLS, value), CELLS, CELLS, 0.05, (-1.0, -1.0, 0.0), frame)


@pytest.fixture
def frames():
    return Frames()


@pytest.fixture
def look(frames, tree):
    """Return a function that updates the surroundings, and tells the value of the map in use, or what is missing."""
    surroundings = Surroundings(read_parameters(tree(global_costmap__static_layer__subscribe_to_updates=True)))
    now = iter(range(0, 1000, 10))

    def look():
        missing = surroundings.update(float(next(now)), frames, ORIGIN, ORIGIN)
        return missing or (OCCUPIED if surroundings.global_area.snapshot.costs[5, 5] else FREE)

    look.surroundings = surroundings
    return look


def test_map_of_an_unknown_frame_does_not_replace_the_one_in_use(look, frames):
    assert look.surroundings.set_map(a_map(FREE), "map", 0.0, frames) == ""
    assert look() == FREE
    waits = look.surroundings.set_map(a_map(OCCUPIED, "no/such frame"), "map", 0.0, frames)
    assert (waits, look()) == ("no transform from 'no/such frame' to 'map'", FREE)


@pytest.mark.parametrize("order", [("map", "attic"), ("attic", "map")])
def test_order_in_which_maps_come_does_not_matter_where_one_frame_is_unknown(look, order):
    for frame in order:
        look.surroundings.set_map(a_map(FREE if frame == "map" else OCCUPIED, frame), "map")
    assert look() == FREE


def test_map_is_used_as_soon_as_its_frame_is_connected(look, frames):
    look.surroundings.set_map(a_map(OCCUPIED, "/attic"), "map")
    assert look() == "no transform from 'attic' to 'odom'"
    frames.connected.add("attic")
    assert look() == OCCUPIED
    assert look.surroundings.set_map(a_map(FREE, "attic"), "map", 0.0, frames) == ""  # it is connected now
    assert look() == FREE


def test_map_in_another_connected_frame_is_used_at_once(look, frames):
    frames.connected.add("attic")
    look.surroundings.set_map(a_map(FREE), "map")
    assert look.surroundings.set_map(a_map(OCCUPIED, "attic"), "map", 0.0, frames) == ""
    assert look() == OCCUPIED


def test_newest_of_the_maps_whose_frames_are_connected_is_used_and_older_ones_are_forgotten(look, frames):
    for frame, value in (("attic", OCCUPIED), ("cellar", FREE), ("roof", OCCUPIED)):
        look.surroundings.set_map(a_map(value, frame), "map")
    frames.connected.add("cellar")
    assert look() == FREE
    frames.connected.add("attic")
    assert look() == FREE
    frames.connected.add("roof")  # it came later
    assert look() == OCCUPIED


def test_map_in_the_costmaps_own_frame_ends_the_wait_of_those_before(look, frames):
    look.surroundings.set_map(a_map(OCCUPIED, "attic"), "map")
    look.surroundings.set_map(a_map(FREE), "map")
    frames.connected.add("attic")
    assert look() == FREE


def test_few_maps_are_kept_waiting(look, frames):
    for number in range(KEPT_MAPS + 1):
        look.surroundings.set_map(a_map(OCCUPIED, f"frame {number}"), "map")
    frames.connected.add("frame 0")
    assert look() == f"no transform from 'frame {KEPT_MAPS}' to 'odom'"


def test_map_that_waits_takes_its_updates(look, frames):
    look.surroundings.set_map(a_map(FREE, "attic"), "map")
    look.surroundings.update_map(MapPart.create(np.full(CELLS * CELLS, OCCUPIED), 0, 0, CELLS, CELLS), "map")
    frames.connected.add("attic")
    assert look() == OCCUPIED


def test_each_map_lies_where_its_own_frame_does(frames, tree):
    static = {"name": "rooms", "type": "costmap_2d::StaticLayer"}
    plugins = [{**static, "name": "static_layer"}, static]
    surroundings = Surroundings(
        read_parameters(tree(global_costmap__plugins=plugins, global_costmap__rooms={"map_topic": "rooms"}))
    )
    frames.places["attic"] = Pose(1.0, 0.0, 0.0)
    frames.connected.add("attic")
    surroundings.set_map(a_map(OCCUPIED, "attic"), "rooms")
    surroundings.set_map(a_map(FREE), "map")
    assert surroundings.update(0.0, frames, ORIGIN, ORIGIN) == ""
    occupied = surroundings.global_area.snapshot.costs == LETHAL
    assert occupied[:, CELLS // 2 :].all() and not occupied[:, : CELLS // 2].any()


def test_first_map_stays_where_it_is_when_another_one_comes(frames, tree):
    surroundings = Surroundings(read_parameters(tree(global_costmap__static_layer__first_map_only=True)))
    frames.places["attic"] = Pose(1.0, 0.0, 0.0)
    frames.connected.add("attic")
    for frame in ("map", "attic", "no/such frame"):
        surroundings.set_map(a_map(OCCUPIED, frame), "map", 0.0, frames)
        assert surroundings.update(0.0, frames, ORIGIN, ORIGIN) == ""
        assert (surroundings.global_area.snapshot.costs == LETHAL).all()


def test_update_is_for_the_map_of_its_frame(look, frames):
    look.surroundings.set_map(a_map(FREE), "map", 0.0, frames)
    look.surroundings.set_map(a_map(FREE, "attic"), "map", 0.0, frames)
    all_cells = np.full(CELLS * CELLS, OCCUPIED), 0, 0, CELLS, CELLS
    look.surroundings.update_map(MapPart.create(*all_cells, "/attic"), "map")
    assert look() == FREE
    look.surroundings.update_map(MapPart.create(*all_cells, "map"), "map")
    assert look() == OCCUPIED
    look.surroundings.update_map(MapPart.create(np.full(CELLS * CELLS, FREE), *all_cells[1:], "attic"), "map")
    frames.connected.add("attic")
    assert look() == FREE
    with pytest.raises(MapError, match="it is for a map in 'cellar', the one in use is in 'attic'"):
        look.surroundings.update_map(MapPart.create(*all_cells, "cellar"), "map")


def test_map_whose_transform_was_sent_once_and_is_old_waits(look, frames):
    look.surroundings.set_map(a_map(FREE), "map", 0.0, frames)
    frames.connected.add("attic")
    frames.stamps["attic"] = -100.0
    look.surroundings.set_map(a_map(OCCUPIED, "attic"), "map", 0.0, frames)
    assert look() == FREE


def test_map_waits_in_the_costmap_that_it_is_not_connected_with(frames, tree):
    surroundings = Surroundings(read_parameters(tree()))
    frames.connected.remove("odom")
    surroundings.set_map(a_map(OCCUPIED), "map", 0.0, frames)
    assert surroundings.global_area.missing_map(0.0, frames) == ""
    assert surroundings.local_area.missing_map(0.0, frames) == "no transform from 'map' to 'odom'"


def test_costmap_lies_where_the_frame_of_its_map_does(frames, tree):
    surroundings = Surroundings(read_parameters(tree()))
    frames.places["attic"] = Pose(20.0, 5.0, math.pi / 2)
    frames.connected.add("attic")
    surroundings.set_map(StaticMap.create([100] * 200, 20, 10, 0.05, (1.0, 0.0, 0.0), "attic"), "map", 0.0, frames)
    assert surroundings.update(0.0, frames, Pose(20.0, 5.0, 0.0), Pose(20.0, 5.0, 0.0)) == ""
    snapshot = surroundings.global_area.snapshot
    assert snapshot.geometry == Geometry(0.05, 10, 20, pytest.approx(19.5), pytest.approx(6.0))
    assert (snapshot.costs == LETHAL).mean() > 0.9  # cells at the edge may be rounded away


def test_map_without_a_frame_lies_in_the_global_costmaps(frames, tree):
    surroundings = Surroundings(read_parameters(tree()))
    frames.places["odom"] = Pose(-10.0, 0.0, 0.0)
    surroundings.set_map(a_map(OCCUPIED, ""), "map", 0.0, frames)
    assert surroundings.update(0.0, frames, ORIGIN, Pose(10.0, 0.0, 0.0)) == ""
    local = surroundings.local_area.snapshot
    occupied = local.costs[local.geometry.cell(10.0, 0.0)]
    assert occupied == LETHAL


@pytest.mark.parametrize("frame", ["map", "attic"])
def test_map_that_would_make_the_costmap_too_large_does_not_replace_the_one_in_use(look, frames, frame):
    frames.connected.add("attic")
    frames.places["attic"] = Pose(0.0, 0.0, 0.7)
    look.surroundings.set_map(a_map(FREE), "map", 0.0, frames)
    long = np.full(400_000, OCCUPIED, dtype=np.int8)
    thin = StaticMap.create(long, 100_000, 4, 0.05, (-1.0, -1.0, 0.7 if frame == "map" else 0.0), frame)
    waits = look.surroundings.set_map(thin, "map", 0.0, frames)
    assert "a costmap of it has" in waits and look() == FREE
