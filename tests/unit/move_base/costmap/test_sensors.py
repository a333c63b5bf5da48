"""Messages become observations; broken ones are refused with a reason."""

import math
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from move_base.costmap.sensors import (
    FLOAT32,
    MAX_RAYS,
    SensorError,
    cloud_observation,
    points_observation,
    scan_observation,
)
from move_base.parameters.parameters import ObservationSource

SCAN = ObservationSource("scan", "LaserScan", "front/scan", raytrace_range=12.0, inf_is_valid=True)
CLOUD = ObservationSource("point_cloud", "PointCloud2", "camera/depth/points")


def header(frame="front_laser"):
    return SimpleNamespace(frame_id=frame, stamp=SimpleNamespace(to_sec=lambda: 5.0))


def scan(ranges, **changes):
    fields = {"angle_min": 0.0, "angle_increment": math.pi / 2, "range_min": 0.1, "range_max": 10.0, "header": header()}
    return SimpleNamespace(ranges=ranges, **{**fields, **changes})


def cloud(points, **changes):
    fields = [SimpleNamespace(name=name, offset=4 * i, datatype=7) for i, name in enumerate("xyz")]
    data = b"".join(struct.pack("<fff", *point) for point in points)
    values = {
        "fields": fields,
        "width": len(points),
        "height": 1,
        "point_step": 12,
        "row_step": 12 * len(points),
        "is_bigendian": False,
        "data": data,
        "header": header("camera_link"),
    }
    return SimpleNamespace(**{**values, **changes})


def test_scan_becomes_points():
    observation = scan_observation(scan([1.0, 2.0]), SCAN)
    assert observation.points == pytest.approx(np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]), abs=1e-6)
    assert (observation.frame, observation.stamp, observation.ordered) == ("front_laser", 5.0, True)


def test_ray_without_return_reaches_as_far_as_it_clears():
    observation = scan_observation(scan([math.inf, 2.0, math.nan, 0.01]), SCAN)
    assert observation.hits.tolist() == [False, True]
    assert np.hypot(*observation.points[:, :2].T) == pytest.approx([12.0, 2.0])


def test_ray_without_return_is_dropped_unless_valid():
    source = ObservationSource("scan", "LaserScan", "front/scan")
    assert len(scan_observation(scan([math.inf, 2.0]), source).points) == 1


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (scan([]), "no ranges"),
        (scan([1.0], angle_increment=0.0), "angle"),
        (scan([1.0], range_max=math.nan), "not finite"),
        (scan([1.0] * 9), "full turn"),
        (scan([1.0] * (MAX_RAYS + 1), angle_increment=1e-5), "more than 20000"),
        (scan([1.0], header=header("")), "no frame_id"),
    ],
)
def test_broken_scan_is_refused(message, reason):
    with pytest.raises(SensorError, match=reason):
        scan_observation(message, SCAN)


def test_cloud_becomes_its_finite_points():
    observation = cloud_observation(cloud([(1.0, 2.0, 3.0), (math.nan, 0.0, 0.0), (4.0, 5.0, 6.0)]), CLOUD)
    assert observation.points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    assert not observation.ordered


def test_cloud_of_the_former_type_becomes_its_finite_points():
    points = [SimpleNamespace(x=1.0, y=2.0, z=3.0), SimpleNamespace(x=math.nan, y=0.0, z=0.0)]
    observation = points_observation(SimpleNamespace(points=points, header=header("bumper")), CLOUD)
    assert observation.points.tolist() == [[1.0, 2.0, 3.0]]
    assert (observation.frame, observation.ordered) == ("bumper", False)
    assert points_observation(SimpleNamespace(points=[], header=header()), CLOUD).points.shape == (0, 3)


def test_empty_cloud_is_an_observation_of_nothing():
    assert len(cloud_observation(cloud([]), CLOUD).points) == 0


COORDINATES = st.floats(-9.0, 9.0, width=32) | st.sampled_from([math.nan, math.inf])


@given(st.lists(st.tuples(*[COORDINATES] * 3), max_size=6), st.permutations("xyz"), st.booleans(), st.data())
def test_points_are_the_same_however_they_are_laid_out(points, names, is_bigendian, data):
    before, after, row_gap = (4 * data.draw(st.integers(0, 1)) for _ in range(3))
    rows = data.draw(st.sampled_from([1, len(points)])) if points else 1
    step = before + 12 + after
    filled = np.zeros((rows, len(points) // rows * step + row_gap), dtype=np.uint8)
    kind = ">f4" if is_bigendian else "<f4"
    for place, point in enumerate(points):
        row, column = divmod(place, len(points) // rows)
        values = np.array([point["xyz".index(name)] for name in names], dtype=kind)
        filled[row, column * step + before :][:12] = np.frombuffer(values.tobytes(), dtype=np.uint8)
    fields = [
        SimpleNamespace(name=name, offset=before + 4 * place, datatype=FLOAT32) for place, name in enumerate(names)
    ]
    layout = {"fields": fields, "point_step": step, "row_step": filled.shape[1], "is_bigendian": is_bigendian}
    message = cloud([], data=filled.tobytes(), width=len(points) // rows, height=rows, **layout)
    assert cloud_observation(message, CLOUD).points.tolist() == [list(p) for p in points if np.isfinite(p).all()]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"fields": []}, "x, y, z"),
        ({"width": 5}, "bytes"),
        ({"point_step": 4}, "point_step"),
        ({"width": 10**9}, "more than"),
    ],
)
def test_broken_cloud_is_refused(changes, reason):
    with pytest.raises(SensorError, match=reason):
        cloud_observation(cloud([(1.0, 2.0, 3.0)], **changes), CLOUD)


@given(st.binary(max_size=64), st.integers(0, 8), st.integers(0, 8), st.integers(0, 32), st.integers(0, 64))
def test_no_cloud_does_more_than_be_refused(data, width, height, point_step, row_step):
    message = cloud([], data=data, width=width, height=height, point_step=point_step, row_step=row_step)
    try:
        observation = cloud_observation(message, CLOUD)
    except SensorError:
        return
    assert np.isfinite(observation.points).all()
