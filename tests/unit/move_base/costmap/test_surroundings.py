"""Which map is used: anybody may publish one, in whatever frame, before or after the robot's own."""

import numpy as np
import pytest
from move_base.costmap.grid import LETHAL
from move_base.costmap.static_map import MapPart, StaticMap
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

    def lookup(self, target, source, stamp):
        return self.places.get(source, ORIGIN).matrix() if {target, source} <= self.connected else None

    def newest(self, target, source):
        return 0.0


def a_map(value):
    return StaticMap.create(np.full(CELLS * CELLS, value), CELLS, CELLS, 0.05, (-1.0, -1.0, 0.0))


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


def test_map_of_an_unknown_frame_does_not_replace_the_one_in_use(look):
    assert look.surroundings.set_map(a_map(FREE), "map", "map") == ""
    assert look() == FREE
    waits = look.surroundings.set_map(a_map(OCCUPIED), "no/such frame", "map")
    assert (waits, look()) == ("no transform from 'no/such frame' to 'map'", FREE)


@pytest.mark.parametrize("order", [("map", "attic"), ("attic", "map")])
def test_order_in_which_maps_come_does_not_matter_where_one_frame_is_unknown(look, order):
    for frame in order:
        look.surroundings.set_map(a_map(FREE if frame == "map" else OCCUPIED), frame, "map")
    assert look() == FREE


def test_map_is_used_as_soon_as_its_frame_is_connected(look, frames):
    look.surroundings.set_map(a_map(OCCUPIED), "/attic", "map")
    assert look() == "no transform from 'attic' to 'map'"
    frames.connected.add("attic")
    assert look() == OCCUPIED
    assert look.surroundings.set_map(a_map(FREE), "attic", "map") == ""  # its frame is known now
    assert look() == FREE


def test_map_in_another_connected_frame_is_used_at_once(look, frames):
    frames.connected.add("attic")
    look.surroundings.set_map(a_map(FREE), "map", "map")
    assert look.surroundings.set_map(a_map(OCCUPIED), "attic", "map", frames) == ""
    assert look() == OCCUPIED


def test_newest_of_the_maps_whose_frames_are_connected_is_used_and_older_ones_are_forgotten(look, frames):
    for frame, value in (("attic", OCCUPIED), ("cellar", FREE), ("roof", OCCUPIED)):
        look.surroundings.set_map(a_map(value), frame, "map")
    frames.connected.add("cellar")
    assert look() == FREE
    frames.connected.add("attic")
    assert look() == FREE
    frames.connected.add("roof")  # it came later
    assert look() == OCCUPIED


def test_map_in_the_costmaps_own_frame_ends_the_wait_of_those_before(look, frames):
    look.surroundings.set_map(a_map(OCCUPIED), "attic", "map")
    look.surroundings.set_map(a_map(FREE), "map", "map")
    frames.connected.add("attic")
    assert look() == FREE


def test_few_maps_are_kept_waiting(look, frames):
    for number in range(KEPT_MAPS + 1):
        look.surroundings.set_map(a_map(OCCUPIED), f"frame {number}", "map")
    frames.connected.add("frame 0")
    assert look() == f"no transform from 'frame {KEPT_MAPS}' to 'map'"


def test_map_that_waits_takes_its_updates(look, frames):
    look.surroundings.set_map(a_map(FREE), "attic", "map")
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
    surroundings.set_map(a_map(OCCUPIED), "attic", "rooms")
    surroundings.set_map(a_map(FREE), "map", "map")
    assert surroundings.update(0.0, frames, ORIGIN, ORIGIN) == ""
    occupied = surroundings.global_area.snapshot.costs == LETHAL
    assert occupied[:, CELLS // 2 :].all() and not occupied[:, : CELLS // 2].any()
