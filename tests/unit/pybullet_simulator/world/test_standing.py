"""Where a body can stand on a map."""

import pytest
from helpers.office import at, write_office
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.grid import OCCUPIED
from pybullet_simulator.world.standing import standing_problem
from pybullet_simulator.world.world import Box, World, rasterise


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    world, _ = write_office(tmp_path_factory.mktemp("office"))
    return rasterise(read_world(world))


def cart(pose, length=1.0, width=0.6):
    return Box("cart", "cart", pose.x, pose.y, length, width, 0.5, pose.yaw)


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (at(1.5, 1.5), None),
        (at(4.5, 2.65), None),
        (at(4.5, 2.75), "is in an obstacle"),
        (at(4.5, 2.65, 1.57), "is in an obstacle"),
        (at(0.55, 2.0), "is in an obstacle"),
        (at(8.0, 3.9), "is where the map does not know the floor"),
        (at(8.9, 4.6), "is partly off the map"),
        (at(12.0, 1.0), "is off the map"),
        (at(1e200, 1.0), "is off the map"),
    ],
)
def test_place_is_free_for_all_of_the_body(office, pose, said):
    assert standing_problem(office, cart(pose)) == said


def test_one_occupied_cell_below_the_body_is_enough(office):
    cells = office.cells.copy()
    cells[18, 12] = OCCUPIED
    thin = type(office)(cells, office.resolution, office.origin_x, office.origin_y, office.origin_yaw)
    assert standing_problem(thin, cart(at(1.5, 2.0))) == "is in an obstacle"
    assert standing_problem(thin, cart(at(2.5, 2.0))) is None


def test_drawn_map_is_known_where_the_floor_is():
    grid = rasterise(World("room", 0.0, 4.0, 0.0, 3.0, (Box("crate", "box", 3.0, 1.0, 0.4, 0.4, 1.0),)))
    assert standing_problem(grid, Box("cart", "cart", 1.0, 1.0, 1.0, 0.6, 0.5)) is None
    assert standing_problem(grid, Box("cart", "cart", 2.4, 1.0, 1.0, 0.6, 0.5)) == "is in an obstacle"
    assert standing_problem(grid, Box("cart", "cart", 0.4, 1.0, 1.0, 0.6, 0.5)).endswith("does not know the floor")
