"""The work cell by its tags: accuracy, light, tags that are missing or somewhere else."""

import math

import cv2
import numpy as np
import pytest
from helpers.work_cell import HOME, tag_image
from metacontrol_manipulation.perception.camera import MAST_CAMERA as CAMERA
from metacontrol_manipulation.perception.tags import find_cell
from robot_formulas.geometry import Pose, wrap


def error(view, cell):
    """m and rad."""
    return view.cell.distance(cell), abs(wrap(view.cell.yaw - cell.yaw))


def drawn(seed):
    """A place of the cell from which both tags are in view, 1.3 to 1.9 m away."""
    rng = np.random.default_rng(seed)
    return Pose(0.95 + rng.uniform(-0.1, 0.1), rng.uniform(-0.2, 0.2), rng.uniform(-0.1, 0.1))


@pytest.mark.parametrize("seed", range(12))
def test_both_tags_tell_the_place_within_3_mm(seed):
    cell = drawn(seed)
    view = find_cell(tag_image(CAMERA, cell, light=0.4 + 0.05 * seed, seed=seed), CAMERA)
    assert view.ids == (0, 1)
    assert error(view, cell) < (0.003, math.inf)
    assert error(view, cell)[1] < 0.005
    assert view.error < 0.5


@pytest.mark.parametrize("seed", range(6))
def test_one_tag_is_enough_for_a_centimetre(seed):
    cell = drawn(seed)
    view = find_cell(tag_image(CAMERA, cell, tags=(seed % 2,), seed=seed), CAMERA)
    assert view.ids == (seed % 2,)
    assert error(view, cell) < (0.010, math.inf)
    assert error(view, cell)[1] < 0.02


def test_colours_do_not_matter():
    grey = tag_image(CAMERA)
    assert find_cell(np.dstack([grey] * 3), CAMERA).cell == find_cell(grey, CAMERA).cell


@pytest.mark.parametrize("light", [0.0, 0.02])
def test_nothing_is_found_in_the_dark(light):
    assert find_cell(tag_image(CAMERA, light=light), CAMERA) is None


def test_nothing_is_found_where_the_image_is_white():
    assert find_cell(np.full((480, 640), 255, np.uint8), CAMERA) is None


def test_a_tag_that_is_there_twice_does_not_count():
    image = tag_image(CAMERA)
    row, column = (int(value) for value in np.mean(find_cell(image, CAMERA).corners[0], axis=0)[::-1])
    image[380:440, 300:360] = image[row - 30 : row + 30, column - 30 : column + 30]
    assert find_cell(image, CAMERA).ids == (1,)


def test_tags_of_others_and_tags_that_do_not_fit_the_cell_are_no_cell():
    image = np.full((480, 640), 160, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    for tag, column in ((7, 50), (0, 300), (1, 480)):  # upright in the image, as on a wall
        image[180:300, column : column + 120] = 255
        image[192:288, column + 12 : column + 108] = cv2.aruco.generateImageMarker(dictionary, tag, 96)
    assert find_cell(image, CAMERA) is None


def test_the_cell_is_ahead_at_home():
    assert error(find_cell(tag_image(CAMERA), CAMERA), HOME) < (0.003, math.inf)
