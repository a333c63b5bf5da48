"""The pinhole camera: pixels, points and what a camera_info must have."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_manipulation.perception.camera import MAST_CAMERA, Camera, CameraError, mounted


@given(st.floats(0, 639), st.floats(0, 479), st.floats(0.3, 3.0))
def test_a_point_is_seen_at_the_pixel_that_it_was_found_at(u, v, depth):
    point = MAST_CAMERA.back_project((u, v), depth)
    assert MAST_CAMERA.project(point) == pytest.approx((u, v), abs=1e-6)


def test_the_middle_of_the_image_is_where_the_camera_looks():
    camera = Camera.from_info(640, 480, (500, 0, 319.5, 0, 500, 239.5, 0, 0, 1), mounted(0.1, 0.2, 1.0, math.pi / 4))
    assert camera.project((1.1, 0.2, 0.0)) == pytest.approx((319.5, 239.5))


def test_left_is_left_and_down_is_near():
    left, near = MAST_CAMERA.project([(0.9, 0.3, 0.4), (0.6, 0.0, 0.4)])
    middle = MAST_CAMERA.project((0.9, 0.0, 0.4))
    assert left[0] < middle[0] < 640
    assert near[1] > middle[1]


def test_what_is_behind_the_camera_has_no_pixel():
    assert np.isnan(MAST_CAMERA.project((-3.0, 0.0, 1.0))).all()


def test_rays_lead_where_back_projection_leads():
    assert MAST_CAMERA.position + 1.3 * MAST_CAMERA.rays[100, 200] == pytest.approx(
        MAST_CAMERA.back_project((200, 100), 1.3)
    )


def test_the_field_of_view_is_that_of_the_data_sheet():
    down = MAST_CAMERA.rays[[0, -1], 320] @ MAST_CAMERA.pose[:3, :3]
    assert math.degrees(math.atan(down[1][1] + 0.5 / MAST_CAMERA.fy)) == pytest.approx(30.0)


@pytest.mark.parametrize("k", [(), (0, 0, 320, 0, 500, 240, 0, 0, 1), (math.nan,) * 9])
def test_an_empty_camera_info_is_refused(k):
    with pytest.raises(CameraError, match="calibrated"):
        Camera.from_info(640, 480, k, np.eye(4))
