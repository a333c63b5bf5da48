import math
import subprocess
import sys

import genpy
import numpy as np
import pytest
from pybullet_simulator.messages.sensors import depth_image, laser_scan, point_cloud, read_depth
from pybullet_simulator.robot.laser_and_camera import (
    FULL_LIGHT,
    DepthProjector,
    SensorError,
    measure_depth,
    measure_ranges,
)
from pybullet_simulator.robot.robot import Robot

NOW = genpy.Time(1)


def measure(ranges, noise=0.01, seed=1):
    return measure_ranges(ranges, 0.06, 10.0, noise, np.random.default_rng(seed))


def test_laser_noise_has_its_deviation_and_seed():
    measured = measure(np.full(4000, 5.0))
    assert np.mean(measured) == pytest.approx(5.0, abs=0.001)
    assert np.std(measured) == pytest.approx(0.01, rel=0.1)
    assert np.array_equal(measured, measure(np.full(4000, 5.0)))


def test_out_of_range_is_infinite_and_too_close_is_range_min():
    assert measure([math.inf, 10.0, 12.0, 0.0], noise=0.0).tolist() == pytest.approx([math.inf] * 3 + [0.06])


@pytest.mark.parametrize("ranges", [[], [1.0, math.nan], [-1.0], [[1.0]]])
def test_bad_raw_scan_is_refused(ranges):
    with pytest.raises(SensorError):
        measure(ranges)


def test_points_lie_where_the_pixels_look():
    camera = Robot().camera
    depth = np.full((camera.height, camera.width), 2.0, dtype=np.float32)
    projector = DepthProjector(camera.width, camera.height, camera.field_of_view)
    points = projector.points(depth, 0.05, 8.0).reshape(camera.height, camera.width, 3)
    assert np.allclose(points[..., 0], 2.0)
    assert points[0, 0, 1] == pytest.approx(2.0 * math.tan(math.radians(30.0)), rel=0.01)
    assert points[0, 0, 2] > 0.0 > points[-1, -1, 2]
    assert points[0, -1, 1] < 0.0


def test_pixels_out_of_range_have_no_point():
    depth = np.array([[1.0, math.inf], [math.nan, 9.0]], dtype=np.float32)
    assert DepthProjector(2, 2, 1.0).points(depth, 0.05, 8.0).shape == (1, 3)


def test_depth_noise_grows_with_the_square_of_the_depth_and_repeats():
    deviations = []
    for metres in (1.0, 4.0):
        true = np.full((100, 100), metres, dtype=np.float32)
        measured = measure_depth(true, 1.0, 0.01, np.random.default_rng(1))
        assert np.array_equal(measured, measure_depth(true, 1.0, 0.01, np.random.default_rng(1)))
        deviations.append(np.std(measured))
    assert deviations == pytest.approx([0.01, 0.16], rel=0.1)


@pytest.mark.parametrize(("light", "share"), [(1.0, 1.0), (FULL_LIGHT, 1.0), (FULL_LIGHT / 2, 0.5), (0.0, 0.0)])
def test_camera_loses_pixels_in_the_dark(light, share):
    depth = measure_depth(np.full((100, 100), 2.0, dtype=np.float32), light, 0.0, np.random.default_rng(1))
    assert np.isfinite(depth).mean() == pytest.approx(share, abs=0.03)


def test_nothing_stays_nothing_for_the_camera():
    depth = measure_depth(np.full((2, 2), np.inf, dtype=np.float32), 1.0, 0.01, np.random.default_rng(1))
    assert np.isinf(depth).all()


def test_depth_image_survives_its_message():
    camera = Robot().camera
    depth = np.random.default_rng(0).random((camera.height, camera.width), dtype=np.float32)
    message = depth_image(camera, depth, NOW)
    assert np.array_equal(read_depth(message), depth)
    message.data = message.data[:-1]
    with pytest.raises(SensorError, match="bytes"):
        read_depth(message)
    message.encoding = "mono8"
    with pytest.raises(SensorError, match="mono8"):
        read_depth(message)


def test_cloud_and_scan_describe_themselves():
    cloud = point_cloud(np.ones((5, 3), dtype=np.float32), "camera_link", NOW)
    assert (cloud.width, cloud.point_step, len(cloud.data)) == (5, 12, 60)
    laser = Robot().front_laser
    scan = laser_scan(laser, np.ones(laser.rays, dtype=np.float32), NOW)
    assert scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment == pytest.approx(scan.angle_max)


def test_drivers_do_not_load_the_simulation():
    modules = "pybullet_simulator.messages.sensors, pybullet_simulator.robot.laser_and_camera"
    code = f"import sys, {modules}; print('pybullet' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
