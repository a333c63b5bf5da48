"""Where the cell is while the base drives: odometry with slip, one tag or two in sight."""

import math

import numpy as np
import pytest
from helpers.work_cell import HOME, tag_image
from metacontrol_manipulation.perception.camera import MAST_CAMERA as CAMERA
from metacontrol_manipulation.perception.localisation import CellTracker, Localisation, Track
from robot_formulas.geometry import ORIGIN, Pose, wrap

AT_HOME = Localisation(HOME, ORIGIN, 0.002, 0.002)


def off(known, cell, base=ORIGIN):
    """Error of the cell in base_link: m, rad."""
    seen = known.seen_from(base)
    return seen.distance(cell), abs(wrap(seen.yaw - cell.yaw))


def test_odometry_tells_where_the_cell_is_while_nothing_is_seen_and_the_error_grows_with_the_way():
    base = Pose(0.0, 0.4, 0.1)
    moved = AT_HOME.moved(base)
    assert off(moved, base.inverse() @ HOME, base) == (0.0, 0.0)
    assert AT_HOME.deviation < moved.deviation < moved.moved(Pose(0.0, 0.9)).deviation
    assert moved.deviation == pytest.approx(0.012, abs=0.001)  # 3 % of 0.4 m


@pytest.mark.parametrize("seed", range(6))
def test_one_tag_does_not_spoil_what_is_known(seed):
    """Alone, a tag misleads by up to 5 mm and 8 mrad; the base has not moved since two tags were seen."""
    tracker = CellTracker(AT_HOME)
    for number in range(20):
        tracker.look(tag_image(CAMERA, HOME, tags=(seed % 2,), seed=20 * seed + number), CAMERA, ORIGIN)
    distance, turn = off(tracker.known, HOME)
    assert distance < 0.003
    assert turn < 0.003


@pytest.mark.parametrize("seed", range(4))
def test_slip_is_corrected_by_tags_on_the_way(seed):
    rng = np.random.default_rng(seed)
    tracker, true, odometry = CellTracker(AT_HOME), ORIGIN, ORIGIN
    for number in range(12):
        step = Pose(0.0, 0.03, 0.0)
        true, odometry = true @ step, odometry @ Pose(rng.normal(0.0, 3e-4), 0.03 * 1.06, rng.normal(0.0, 3e-4))
        tracker.look(tag_image(CAMERA, true.inverse() @ HOME, seed=number), CAMERA, odometry)
    assert off(tracker.known, true.inverse() @ HOME, odometry)[0] < 0.004  # 22 mm by odometry alone
    assert tracker.known.deviation < 0.008


def test_two_tags_count_more_than_the_one_that_was_seen_before_from_the_same_place():
    tracker = CellTracker()
    tracker.look(tag_image(CAMERA, HOME, tags=(0,), seed=1), CAMERA, ORIGIN)
    first = tracker.known
    tracker.look(tag_image(CAMERA, HOME, seed=2), CAMERA, ORIGIN)
    assert tracker.known.deviation < first.deviation
    second = tracker.known
    tracker.look(tag_image(CAMERA, HOME, tags=(0,), seed=3), CAMERA, ORIGIN)
    assert tracker.known == second


def test_an_image_without_tags_leaves_what_is_known():
    tracker = CellTracker(AT_HOME)
    assert tracker.look(tag_image(CAMERA, HOME, light=0.0), CAMERA, ORIGIN) is None
    assert tracker.known == AT_HOME


def test_track_gives_the_pose_that_is_nearest_in_time():
    track = Track()
    assert track.latest is None
    assert track.at(1.0) is None
    for number in range(300):
        track.add(0.02 * number, Pose(0.001 * number, 0.0))
    assert track.at(5.0).x == pytest.approx(0.250)
    assert track.at(5.011).x == pytest.approx(0.251)
    assert track.at(6.9) == track.latest
    assert track.at(99.0) is None  # it is to come
    assert track.at(0.0).x > 0.05  # that long ago is forgotten
    assert not track.is_set_back(5.9)  # two messages have changed places
    assert track.is_set_back(1.0)
    track.add(1.0, Pose(7.0, 0.0))
    assert track.at(0.0).x == track.at(2.0).x == 7.0
    assert track.at(5.0) is None
    assert math.isclose(track.latest.x, 7.0)


def test_track_of_odometry_without_times_does_not_grow_for_ever():
    track = Track()
    for number in range(20_000):
        track.add(0.0, Pose(float(number), 0.0))
    assert len(track._times) == len(track._poses) <= 4000
    assert track.latest.x == 19_999.0
