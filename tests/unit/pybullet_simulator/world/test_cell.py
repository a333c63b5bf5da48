import itertools
import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pybullet_simulator.world.cell import (
    BLOCK_SIZE,
    BLOCK_SPACING,
    BOARD_SIZE,
    TABLE_TOP,
    TAG_SIZE,
    TAGS,
    scatter_blocks,
)


@given(st.integers(0, 2**32))
def test_blocks_lie_apart_on_both_sides_of_the_table(seed):
    places = [position for position, _ in scatter_blocks(seed).values()]
    assert len(places) == 6
    for number, (x, y, z) in enumerate(places):
        assert -0.32 <= x <= -0.10
        assert 0.25 <= (y if number < 3 else -y) <= 0.60
        assert z == pytest.approx(TABLE_TOP + BLOCK_SIZE[2] / 2.0)
    assert all(math.dist(one, other) >= BLOCK_SPACING for one, other in itertools.combinations(places, 2))


def test_seed_decides_where_blocks_lie():
    assert scatter_blocks(1) == scatter_blocks(1) != scatter_blocks(2)


def test_boards_stand_on_the_table():
    for tag in TAGS:
        assert tag.centre[2] - BOARD_SIZE / 2.0 * math.cos(math.radians(45.0)) > TABLE_TOP


def test_picture_is_an_april_tag_of_the_right_size():
    for tag in TAGS:
        picture = tag.picture()
        image = np.pad(picture, 50, constant_values=200)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
        assert ids.ravel().tolist() == [tag.number]
        edge = np.ptp(corners[0][0][:, 0]) + 1.0
        assert edge / picture.shape[0] == pytest.approx(TAG_SIZE / BOARD_SIZE, abs=0.01)
