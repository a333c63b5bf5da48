"""Times of paths: limits are kept, the path is followed."""

import numpy as np
import pytest
from arm_motion.panda import HOME, JOINTS, LOWER, MAX_ACCELERATION, MAX_VELOCITY, UPPER
from arm_motion.timing import TOLERANCE, timed
from hypothesis import given
from hypothesis import strategies as st

postures = st.lists(st.floats(0.0, 1.0), min_size=JOINTS, max_size=JOINTS).map(
    lambda shares: LOWER + np.array(shares) * (UPPER - LOWER)
)
paths = st.one_of(
    st.lists(postures, min_size=1, max_size=6),
    st.tuples(postures, st.integers(0, 2**32 - 1)).map(  # many short steps, as of a line or a smooth path
        lambda given: list(
            given[0] + np.cumsum(np.random.default_rng(given[1]).normal(0.0, 0.02, (30, JOINTS)), axis=0)
        )
    ),
)


def distance(point, path):
    """Return how far a point is from a path."""
    first, ways = np.array(path[:-1]), np.diff(path, axis=0)
    squares = np.maximum((ways**2).sum(1), 1e-18)
    share = np.clip(((point - first) * ways).sum(1) / squares, 0.0, 1.0)
    return np.linalg.norm(first + share[:, None] * ways - point, axis=1).min()


@given(path=paths, speed=st.floats(0.05, 1.0))
def test_velocities_and_accelerations_keep_the_limits(path, speed):
    motion = timed(path, speed)
    assert (np.abs(motion.velocities) <= MAX_VELOCITY * speed * (1 + 1e-9)).all()
    accelerations = np.diff(motion.velocities, axis=0) / np.diff(motion.times)[:, None]
    assert (np.abs(accelerations) <= MAX_ACCELERATION * speed**2 * (1 + 1e-6)).all()


@given(path=paths)
def test_between_its_points_a_motion_keeps_the_limits_too(path):
    motion = timed(path)
    middles = (motion.times[1:] + motion.times[:-1]) / 2.0
    for time in middles:
        assert (np.abs(motion.at(time)[1]) <= MAX_VELOCITY * 1.01).all()


@given(path=paths)
def test_a_motion_stays_by_its_path(path):
    if len(path) > 1:
        motion = timed(path)
        assert max(distance(point, path) for point in motion.positions) <= TOLERANCE + 1e-9


@given(path=paths)
def test_a_motion_begins_and_ends_at_rest(path):
    motion = timed(path)
    assert np.allclose(motion.positions[0], path[0])
    assert np.allclose(motion.positions[-1], path[-1], atol=1e-5)
    assert not motion.velocities[0].any()
    assert not motion.velocities[-1].any()
    assert (np.diff(motion.times) > 0.0).all()


@given(path=paths)
def test_velocities_are_the_slopes_of_positions(path):
    motion = timed(path)
    if len(motion.times) > 1:
        means = np.diff(motion.positions, axis=0) / np.diff(motion.times)[:, None]
        assert np.allclose(means, (motion.velocities[1:] + motion.velocities[:-1]) / 2.0, atol=0.02)


def test_a_long_way_of_one_joint_takes_the_time_of_its_limits():
    far = HOME.copy()
    far[1] += 1.5
    v, a = MAX_VELOCITY[1], MAX_ACCELERATION[1]
    assert timed([HOME, far]).duration == pytest.approx(1.5 / v + v / a, rel=0.02)


def test_a_corner_is_no_stop():
    corner, end = HOME.copy(), HOME.copy()
    corner[0] += 0.5
    end[:2] += 0.5
    through = timed([HOME, corner, end]).duration
    assert through < 0.95 * (timed([HOME, corner]).duration + timed([corner, end]).duration)


def test_half_the_speed_takes_twice_as_long():
    path = [HOME, HOME + 0.3]
    assert timed(path, 0.5).duration == pytest.approx(2.0 * timed(path).duration)


def test_a_path_that_goes_nowhere_takes_no_time():
    motion = timed([HOME, HOME])
    assert motion.duration == 0.0
    assert np.allclose(motion.at(0.0)[0], HOME)


def test_outside_its_times_a_motion_rests():
    motion = timed([HOME, HOME + 0.3])
    for time, joints in ((-1.0, HOME), (motion.duration + 1.0, HOME + 0.3)):
        assert np.allclose(motion.at(time)[0], joints)
        assert not motion.at(time)[1].any()


@pytest.mark.parametrize(("path", "speed"), [([], 1.0), ([HOME], 0.0), ([HOME], 1.5)])
def test_what_cannot_be_timed_is_refused(path, speed):
    with pytest.raises(ValueError, match="speed"):
        timed(path, speed)
