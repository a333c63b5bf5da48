import math

import numpy as np
import pytest
from pybullet_simulator.robot.motion_sensors import Errors, Imu, Localisation, Odometry, Slip
from pybullet_simulator.robot.random_errors import Normals, Wander
from robot_formulas.geometry import Pose


def test_wandering_error_has_its_deviation_and_changes_slowly():
    wander = Wander(0.5, 2.0, Normals(1, 1))
    errors = np.array([wander.advance(0.1) for _ in range(40_000)])
    assert np.std(errors) == pytest.approx(0.5, rel=0.1)
    lagged = np.corrcoef(errors[:-20], errors[20:])[0, 1]  # 2 s apart
    assert lagged == pytest.approx(math.exp(-1.0), abs=0.1)


def test_streams_of_one_seed_are_independent_and_repeat():
    one, same, other = Normals(1, 1), Normals(1, 1), Normals(1, 2)
    numbers = [one.next() for _ in range(2500)]
    assert numbers == [same.next() for _ in range(2500)]
    assert abs(np.corrcoef(numbers, [other.next() for _ in range(2500)])[0, 1]) < 0.1


def test_wheels_drift_per_metre_and_the_gyro_keeps_the_heading():
    odometry = Odometry(Errors(odometry_drift=0.01), 1)
    for _ in range(100):
        odometry.advance(Pose(0.1, 0.0, 0.0), (5.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.02)
    assert odometry.wheels.yaw == pytest.approx(0.1)
    assert (odometry.filtered.x, odometry.filtered.y, odometry.filtered.yaw) == pytest.approx((10.1, 0.0, 0.0))
    assert odometry.velocity[0] == pytest.approx(5.05)


def test_gyro_noise_makes_the_filtered_heading_wander():
    headings = []
    for seed in range(100):
        odometry = Odometry(Errors(gyro=0.02), seed)
        for _ in range(100):
            odometry.advance(Pose(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.02)
        headings.append(odometry.filtered.yaw)
    assert np.std(headings) == pytest.approx(0.02 * 0.02 * 10.0, rel=0.3)


def test_slip_is_larger_sideways():
    factors = []
    slip = Slip(0.01, 1)
    for _ in range(20_000):
        slip.advance(0.1)
        factors.append(slip.factors)
    ahead, left, turn = np.std(factors, axis=0)
    assert (ahead, turn) == pytest.approx((0.01, 0.01), rel=0.15)
    assert left == pytest.approx(0.03, rel=0.15)


def test_perfect_parts_make_no_error():
    assert Slip(0.0, 1).factors == (1.0, 1.0, 1.0)
    assert Localisation(0.0, 1).locate(Pose(1.0, 2.0, 0.5)) == Pose(1.0, 2.0, 0.5)
    assert Imu(0.0, 1).measure((0.0, 0.0), 0.0, 0.02) == (0.0, 0.0)


def test_localisation_error_has_its_deviation():
    localisation = Localisation(0.05, 3)
    errors = []
    for _ in range(20_000):
        localisation.advance(1.0)
        found = localisation.locate(Pose(1.0, 2.0, 0.0))
        errors.append((found.x - 1.0, found.y - 2.0, found.yaw))
    assert np.std(errors, axis=0) == pytest.approx((0.05, 0.05, 0.005), rel=0.1)


def test_imu_tells_the_mean_acceleration_of_its_sample():
    assert Imu(0.0, 1).measure((0.02, -0.01), 0.0, 0.02) == pytest.approx((1.0, -0.5))
