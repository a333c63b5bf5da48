"""Blocks by depth: accuracy, blocks that touch or lie on one another, the pyramid, arms and other things."""

import math

import numpy as np
import pytest
from helpers.work_cell import HOME, Box, arm, cube, depth_image, noisy
from metacontrol_manipulation.perception.blocks import find_blocks
from metacontrol_manipulation.perception.camera import MAST_CAMERA as CAMERA
from metacontrol_manipulation.pick_place.pyramid import SLOTS, Slot
from robot_formulas.geometry import Pose

PLACED = [Box(slot.position, (0.05, 0.05, 0.05)) for slot in SLOTS]
SHOULDER = (-0.70, 0.30, 0.63)


def seen(*boxes, cell=HOME, held=(), seed=1):
    return find_blocks(noisy(depth_image(CAMERA, boxes, cell), seed), CAMERA, cell, held)


def assert_found(view, *cubes):
    """Compare the loose blocks with cubes: all of them, within 3 mm and 3 degrees, and nothing else."""
    assert len(view.blocks) == len(cubes), view
    for box in cubes:
        block = min(view.blocks, key=lambda block: math.dist((block.x, block.y, block.z), box.centre))
        assert math.dist((block.x, block.y, block.z), box.centre) < 0.003, (block, box)
        assert abs(math.remainder(block.yaw - box.yaw, math.pi / 2)) < math.radians(3.0), (block, box)


def drawn(rng):
    """Six cubes as the cell draws them."""
    cubes = []
    while len(cubes) < 6:
        side = 1 if len(cubes) < 3 else -1
        one = cube(rng.uniform(-0.32, -0.10), side * rng.uniform(0.25, 0.60), rng.uniform(-math.pi, math.pi))
        if all(math.dist(one.centre, other.centre) >= 0.11 for other in cubes):
            cubes.append(one)
    return cubes


@pytest.mark.parametrize("seed", range(14))
def test_loose_blocks_and_filled_slots_of_a_drawn_cell(seed):
    rng = np.random.default_rng(seed)
    away = seed % 2
    cell = Pose(0.95 + rng.uniform(-0.05, 0.05), away * rng.uniform(-0.4, 0.4), away * rng.uniform(-0.1, 0.1))
    count = seed % 7
    cubes = drawn(rng)[count:]
    placed = []
    for slot in SLOTS[:count]:
        x, y, z = slot.position
        placed.append(
            Box((x + rng.uniform(-0.004, 0.004), y + rng.uniform(-0.002, 0.002), z), (0.05, 0.05, 0.05), 0.02)
        )
    view = seen(*cubes, *placed, cell=cell, seed=seed)
    assert_found(view, *cubes)
    assert view.filled == set(SLOTS[:count])
    assert not view.hidden
    assert not view.unclear
    assert view.seen > 0.85


@pytest.mark.parametrize("yaw", [0.0, 0.3, math.pi / 4, 1.2])
@pytest.mark.parametrize("shift", [0.0, 0.015])
def test_two_blocks_that_touch_are_two(yaw, shift):
    cos, sin = math.cos(yaw), math.sin(yaw)
    beside = cube(-0.2 + 0.05 * cos - shift * sin, 0.4 + 0.05 * sin + shift * cos, yaw)
    assert_found(seen(cube(-0.2, 0.4, yaw), beside), cube(-0.2, 0.4, yaw), beside)


def test_four_blocks_in_a_square_are_four():
    cubes = [cube(-0.2 + 0.05 * (n // 2), 0.4 - 0.05 * (n % 2)) for n in range(4)]
    assert_found(seen(*cubes), *cubes)


def test_of_two_blocks_on_one_another_the_upper_one_can_be_taken():
    upper = cube(-0.195, 0.41, 0.5, layer=1)
    assert_found(seen(cube(-0.2, 0.4, 0.2), upper), upper)


def test_a_block_that_fell_on_the_pyramid_is_loose():
    fallen = cube(-0.2, 0.01, 0.4, layer=1)
    view = seen(*PLACED[:3], fallen)
    assert_found(view, fallen)
    assert view.filled == set(SLOTS[:3])


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.0, 0.013, 0.0), (-0.013, 0.0, 0.0), (0.0, 0.0, 0.4)])
def test_a_block_beside_its_slot_is_loose(x, y, yaw):
    beside = cube(-0.2 + x, 0.056 + y, yaw)
    view = seen(*PLACED[:2], beside)
    assert_found(view, beside)
    assert view.filled == set(SLOTS[:2])


@pytest.mark.parametrize(("x", "y"), [(0.008, 0.0), (-0.004, 0.007)])
def test_a_block_within_a_centimetre_of_its_slot_fills_it(x, y):
    view = seen(*PLACED[:2], cube(-0.2 + x, 0.056 + y))
    assert view.filled == set(SLOTS[:3])
    assert not view.blocks


def test_loose_blocks_before_the_pyramid_hide_nothing():
    before = [cube(-0.29, 0.03, 0.5), cube(-0.25, -0.06, 0.1)]
    view = seen(*PLACED[:5], *before)
    assert_found(view, *before)
    assert view.filled == set(SLOTS[:5])


def test_an_arm_is_no_block_and_hides_none_that_is_seen_in_part():
    cubes = [cube(-0.2, 0.4, 0.1), cube(-0.25, 0.25), cube(-0.1, -0.3, 0.2)]
    view = seen(*arm(SHOULDER, (-0.4, 0.35, 0.85), (-0.22, 0.42, 0.72), (-0.2, 0.4, 0.5)), *cubes)
    assert_found(view, *cubes)
    assert view.seen < 0.85


@pytest.mark.parametrize("height", [0.41, 0.45, 0.50, 0.575, 0.65])
def test_an_empty_gripper_is_no_block_at_any_height(height):
    tip = (-0.2, 0.4, height)
    view = seen(*arm(SHOULDER, (-0.4, 0.35, 0.85), (-0.22, 0.42, height + 0.25), tip))
    assert not view.blocks
    assert not view.unclear


@pytest.mark.parametrize("height", [0.475, 0.49, 0.525, 0.575, 0.65])
def test_a_block_in_a_gripper_lies_nowhere(height):
    tip = (-0.2, 0.4, height)
    boxes = [*arm(SHOULDER, (-0.4, 0.35, 0.85), (-0.22, 0.42, height + 0.25), tip), Box(tip, (0.05, 0.05, 0.05))]
    assert not seen(*boxes).blocks
    assert not seen(*boxes, held=[tip]).blocks


def test_a_block_with_nothing_below_it_lies_nowhere():
    """A block between fingers that are too thin to be seen."""
    assert not seen(cube(-0.2, 0.4, 0.3, layer=1)).blocks


def test_a_block_that_is_being_placed_fills_no_slot_yet():
    tip = SLOTS[2].position
    boxes = [*arm(SHOULDER, (-0.4, 0.25, 0.85), (-0.2, 0.0, 0.7), tip), *PLACED[:3]]
    view = seen(*boxes, held=[tip])
    assert view.filled == set(SLOTS[:2])
    assert Slot(0, 2) in view.hidden


def test_slots_behind_an_arm_are_hidden_not_empty():
    forearm = Box((-0.3, 0.0, 0.75), (0.1, 0.5, 0.3))
    view = seen(*PLACED[:3], forearm)
    assert not view.filled
    assert view.hidden == set(SLOTS)


def test_a_block_that_leans_on_another_is_unclear():
    leaning = Box((-0.2, 0.4, 0.4335), (0.05, 0.05, 0.05), 0.0, (0.5, 0.0))
    for boxes in (
        [leaning],
        [cube(-0.145, 0.4), leaning],
        [*PLACED[:3], Box((-0.255, 0.0, 0.4335), leaning.size, 0.0, leaning.tilt)],
    ):
        view = seen(*boxes)
        assert not view.blocks or len(boxes) == 2
        assert len(view.unclear) == 1, boxes
        place = view.unclear[0]
        assert math.dist((place.x, place.y), boxes[-1].centre[:2]) < 0.04


def test_obstacles_are_no_blocks():
    boxes = [Box((-0.2, 0.4, 0.5), (0.1, 0.1, 0.2), 0.3), Box((-0.2, -0.4, 0.43), (0.06, 0.06, 0.06))]
    assert not seen(*boxes).blocks


def test_an_image_without_depth_shows_nothing_and_hides_everything():
    view = find_blocks(np.zeros((480, 640), np.float32), CAMERA, HOME)
    assert (view.blocks, view.unclear, view.filled, view.seen) == ((), (), frozenset(), 0.0)
    assert view.hidden == frozenset(SLOTS)


def test_yaws_are_within_an_eighth_turn():
    assert abs(seen(cube(-0.2, 0.4, 2.9)).blocks[0].yaw) <= math.pi / 4
