"""The base drives to places: never too fast, and it stands in the end."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_manipulation.handling.driving import AT_PLACE, SPEED, TURN_RATE, has_arrived, speeds
from robot_formulas.geometry import Pose

PLACES = st.builds(Pose, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
STILL = (0.0, 0.0, 0.0)


@given(PLACES)
def test_speeds_lead_to_the_place_and_keep_their_limits(to_go):
    forward, left, turn = speeds(to_go)
    assert math.hypot(forward, left) <= SPEED + 1e-9
    assert abs(turn) <= TURN_RATE
    assert forward * to_go.x >= 0.0
    assert left * to_go.y >= 0.0
    assert turn * to_go.yaw >= 0.0


@given(PLACES)
def test_the_base_arrives(to_go):
    base = Pose(0.0, 0.0, 0.0)
    velocity = STILL
    for _ in range(600):
        left_to_go = base.inverse() @ to_go
        if has_arrived(left_to_go, velocity):
            break
        velocity = speeds(left_to_go)
        base = base @ Pose(*(0.05 * part for part in velocity))
    assert has_arrived(base.inverse() @ to_go, velocity)


def test_a_base_that_still_moves_or_is_elsewhere_has_not_arrived():
    assert has_arrived(Pose(0.0, 0.0), STILL)
    assert not has_arrived(Pose(0.0, 0.0), (0.0, 0.05, 0.0))
    assert not has_arrived(Pose(2 * AT_PLACE, 0.0), STILL)
    assert not has_arrived(Pose(0.0, 0.0, 2 * AT_PLACE), STILL)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_place_that_is_not_finite_gives_no_speed(bad):
    for to_go in (Pose(bad, 0.5, 0.5), Pose(0.5, bad, 0.5), Pose(0.5, 0.5, bad)):
        assert speeds(to_go) == (0.0, 0.0, 0.0)
        assert not has_arrived(to_go, STILL)
