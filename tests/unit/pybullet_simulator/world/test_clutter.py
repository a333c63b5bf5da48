import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.clutter import KEEP_OUT, ClutterError, scatter
from pybullet_simulator.world.grid import Grid
from pybullet_simulator.world.obstacles import CLUTTER_SIZE
from pybullet_simulator.world.world import Box, overlap, rasterise
from robot_formulas.geometry import Pose

FACTORY = read_world(Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/worlds/factory.yaml")
GRID = rasterise(FACTORY)
START, GOAL = Pose(-8.0, -8.0, 0.0), Pose(5.4, 6.0, 0.0)


def boxes(places):
    return [Box(str(i), "clutter", place.x, place.y, *CLUTTER_SIZE, place.yaw) for i, place in enumerate(places)]


def test_same_seed_same_places():
    assert scatter(GRID, START, GOAL, 7, 1) == scatter(GRID, START, GOAL, 7, 1)
    assert scatter(GRID, START, GOAL, 7, 1) != scatter(GRID, START, GOAL, 7, 2)


def test_fewer_obstacles_are_the_first_of_more():
    assert scatter(GRID, START, GOAL, 20, 3)[:7] == scatter(GRID, START, GOAL, 7, 3)


@pytest.mark.parametrize("seed", range(5))
def test_obstacles_stand_free_and_off_the_ends_of_the_way(seed):
    placed = boxes(scatter(GRID, START, GOAL, 20, seed))
    assert len(placed) == 20
    for box in placed:
        assert FACTORY.contains(box.x, box.y)
        assert not any(overlap(box, other) for other in FACTORY.boxes)
        assert min(math.dist((box.x, box.y), (end.x, end.y)) for end in (START, GOAL)) >= KEEP_OUT - 0.1
    assert not any(overlap(one, other) for one, other in itertools.combinations(placed, 2))


def corridor(width):
    """A corridor along x, so many cells of 0.1 m wide and 10 m long."""
    cells = np.full((width + 2, 100), 100, dtype=np.int8)
    cells[1:-1] = 0
    return Grid(cells, 0.1, 0.0, 0.0)


def test_a_passage_is_left():
    grid = corridor(20)
    start, goal = Pose(0.9, 1.1, 0.0), Pose(9.1, 1.1, 0.0)
    for seed in range(5):
        for place in scatter(grid, start, goal, 2, seed):
            assert max(place.y - 0.1, 2.1 - place.y) > 1.2  # on one side the robot gets by


def test_a_corridor_without_room_is_refused():
    with pytest.raises(ClutterError, match=r"room for 0 obstacles .* not for 1"):
        scatter(corridor(14), Pose(0.9, 0.8, 0.0), Pose(9.1, 0.8, 0.0), 1, 1)


def test_places_follow_a_turned_map():
    turned = Grid(GRID.cells, GRID.resolution, 3.0, 1.0, 0.7)
    move = Pose(3.0, 1.0, 0.7) @ Pose(GRID.origin_x, GRID.origin_y, 0.0).inverse()
    straight = scatter(GRID, START, GOAL, 3, 1)
    for place, other in zip(straight, scatter(turned, move @ START, move @ GOAL, 3, 1), strict=True):
        assert (other.x, other.y) == pytest.approx(((move @ place).x, (move @ place).y), abs=1e-6)
