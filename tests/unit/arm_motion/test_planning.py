"""Paths: free at fine steps, straight where they have to be, the same for the same seed."""

from itertools import pairwise

import numpy as np
import pytest
from arm_motion.grasping import top_down
from arm_motion.panda import HOME
from arm_motion.planning import NoPathError, line, plan
from arm_motion.scene import Box, Scene
from arm_motion.timing import timed
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

TABLE = Box((0.70, -0.30, -0.10), (0.80, 1.60, 0.40))
BASE = Box((-0.25, -0.30, -0.155), (0.96, 0.80, 0.28))
MAST = Box((-0.20, -0.30, 0.75), (0.06, 0.06, 1.5))
WALL = Box((0.50, 0.0, 0.30), (0.40, 0.03, 0.40))
CUBE = Box((0.0, 0.0, 0.0), (0.05, 0.05, 0.05))
CELL = (TABLE, BASE, MAST)
OTHER = ((0.0, -0.6, 0.0), HOME)
SECONDS = 60.0
"""For a search, also on a loaded machine."""


@pytest.fixture(scope="module")
def scene():
    with Scene() as scene:
        yield scene


def above(scene, x, y, z=0.25, held=None):
    joints = scene.free_inverse((x, y, z), top_down(0.0), HOME, held)
    assert joints is not None
    return joints


def free_at_fine_steps(scene, path, held=None):
    """Say whether a path is free at steps of 0.005 rad, which are not those of the planner."""
    for first, second in pairwise(path):
        count = int(np.ceil(np.linalg.norm(second - first) / 0.005)) + 1
        if not all(scene.is_free(first + s * (second - first), held, 0.003) for s in np.linspace(0.0, 1.0, count)):
            return False
    return True


@settings(max_examples=8, deadline=None)
@example(x=0.46175333994393963, y=0.1484375, to=-0.24868381542211504, seed=291, holds=True)
@given(
    x=st.floats(0.40, 0.58),
    y=st.floats(0.10, 0.25),
    to=st.floats(-0.25, -0.12),
    seed=st.integers(0, 2**31),
    holds=st.booleans(),
)
def test_a_path_around_a_wall_is_free_also_when_it_is_timed(scene, x, y, to, seed, holds):
    held = CUBE if holds else None
    scene.set([*CELL, WALL], OTHER)
    start, goal = above(scene, x, y, held=held), above(scene, x, to, held=held)
    path = plan(scene, start, goal, seed=seed, deadline=SECONDS, held=held)
    assert np.array_equal(path[0], start)
    assert np.array_equal(path[-1], goal)
    assert free_at_fine_steps(scene, path, held)
    motion = timed(path)
    assert all(scene.is_free(motion.at(time)[0], held, 0.002) for time in np.arange(0.0, motion.duration, 0.02))


def test_the_same_seed_gives_the_same_path_whatever_was_planned_before(scene):
    scene.set([*CELL, WALL], OTHER)
    ends = above(scene, 0.5, 0.2), above(scene, 0.5, -0.2)
    first = plan(scene, *ends, seed=3, deadline=SECONDS)
    other = plan(scene, *ends, seed=4, deadline=SECONDS)
    again = plan(scene, *ends, seed=3, deadline=SECONDS)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_free_way_is_straight(scene):
    scene.set(CELL, OTHER)
    goal = above(scene, 0.5, 0.2)
    assert np.array_equal(plan(scene, HOME, goal, seed=0, deadline=SECONDS), [HOME, goal])


def test_a_held_box_makes_a_detour_necessary(scene):
    low = Box((0.50, 0.0, 0.14), (0.40, 0.03, 0.08))
    scene.set([*CELL, low], OTHER)
    pole = Box((0.0, 0.0, 0.04), (0.03, 0.03, 0.12))
    ends = above(scene, 0.5, 0.15, 0.22, pole), above(scene, 0.5, -0.15, 0.22, pole)
    assert len(plan(scene, *ends, seed=0, deadline=SECONDS)) == 2
    around = plan(scene, *ends, seed=0, deadline=SECONDS, held=pole)
    assert len(around) > 2
    assert free_at_fine_steps(scene, around, pole)


def test_an_arm_close_to_a_box_leaves_it_first(scene):
    scene.set()
    tip = scene.forward(HOME)[0][2] - 0.0074
    scene.set([Box((0.307, 0.0, float(tip) - 0.103), (0.2, 0.2, 0.2))])
    assert not scene.is_free(HOME)
    goal = above(scene, 0.4, 0.3, 0.6)
    path = plan(scene, HOME, goal, seed=0, deadline=SECONDS)
    assert np.array_equal(path[0], HOME)
    assert scene.is_free(path[1])


def test_start_and_goal_that_hit_something_are_named(scene):
    scene.set([WALL])
    inside = scene.inverse((0.5, 0.0, 0.3), top_down(0.0), HOME)
    with pytest.raises(NoPathError, match=r"the goal .* hits something"):
        plan(scene, HOME, inside, seed=0, deadline=SECONDS)
    with pytest.raises(NoPathError, match=r"the start .* hits something"):
        plan(scene, inside, HOME, seed=0, deadline=SECONDS)


def test_a_search_that_has_no_time_says_so(scene):
    scene.set([*CELL, WALL], OTHER)
    with pytest.raises(NoPathError, match=r"no path from .* in 0\.001 s: allow more time"):
        plan(scene, above(scene, 0.5, 0.2), above(scene, 0.5, -0.2), seed=0, deadline=0.001)


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(0.38, 0.60),
    y=st.floats(-0.3, 0.3),
    z=st.floats(0.15, 0.35),
    dx=st.floats(-0.05, 0.05),
    turn=st.floats(-0.5, 0.5),
)
def test_a_line_is_straight_and_ends_at_its_pose(scene, x, y, z, dx, turn):
    scene.set()
    start = above(scene, x, y, z)
    to = np.array((x + dx, y, z - 0.1))
    try:
        path = line(scene, start, to, top_down(turn))
    except NoPathError:
        assume(False)
    assert np.array_equal(path[0], start)
    reached, quaternion = scene.forward(path[-1])
    assert np.allclose(reached, to, atol=1e-4)
    assert abs(quaternion @ np.array(top_down(turn))) > 1.0 - 1e-6
    begin = scene.forward(start)[0]
    along = (to - begin) / np.linalg.norm(to - begin)
    for first, second in pairwise(path):
        for joints in (first, (first + second) / 2.0):
            way = scene.forward(joints)[0] - begin
            assert np.linalg.norm(way - (way @ along) * along) < 1e-3


def test_a_line_through_a_box_is_refused(scene):
    scene.set([WALL])
    start = above(scene, 0.5, 0.15)
    with pytest.raises(NoPathError, match=r"the line to .* hits something"):
        line(scene, start, (0.5, -0.15, 0.25), top_down(0.0))


def test_a_line_to_a_pose_out_of_reach_is_refused(scene):
    scene.set()
    with pytest.raises(NoPathError, match=r"the line to .* is out of reach"):
        line(scene, HOME, (1.5, 0.0, 0.3), top_down(0.0))


def test_a_line_with_a_held_box_ends_where_the_box_stands(scene):
    scene.set(CELL)
    start = above(scene, 0.5, 0.1, held=CUBE)
    line(scene, start, (0.5, 0.1, 0.125), top_down(0.0), CUBE)
    with pytest.raises(NoPathError, match=r"hits something"):
        line(scene, start, (0.5, 0.1, 0.115), top_down(0.0), CUBE)
