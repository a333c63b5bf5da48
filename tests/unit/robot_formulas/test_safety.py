"""The formulas of safety."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robot_formulas.safety import braking_distance, closest_in_direction, physical_braking_distance, safety_risk


def test_braking_distance_is_two_and_a_half_seconds_of_travel():
    assert braking_distance(0.3) == pytest.approx(0.75)
    assert braking_distance(-0.3) == pytest.approx(0.75)


def test_braking_distance_refuses_a_gain_that_is_not_positive():
    with pytest.raises(ValueError, match="gain"):
        braking_distance(1.0, gain=0.0)


def test_physical_braking_distance():
    assert physical_braking_distance(1.0, max_deceleration=2.0, reaction_time=0.5) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("distance", "d_break", "risk"),
    [(1.0, 1.0, 0.0), (0.5, 1.0, 0.5), (0.0, 1.0, 1.0), (math.inf, 1.0, 0.0), (0.1, 0.0, 0.0), (-0.1, 1.0, 1.0)],
)
def test_safety_risk(distance, d_break, risk):
    assert safety_risk(distance, d_break) == pytest.approx(risk)


def test_safety_risk_refuses_nan():
    with pytest.raises(ValueError, match="not a number"):
        safety_risk(math.nan, 1.0)


@given(st.floats(0, 100), st.floats(0, 10))
def test_safety_risk_is_a_level(distance, d_break):
    assert 0.0 <= safety_risk(distance, d_break) <= 1.0


def test_closest_in_direction_counts_only_what_lies_ahead():
    x, y = [2.0, -0.5], [0.0, 0.0]
    assert closest_in_direction(x, y, 0.0) == pytest.approx(2.0)
    assert closest_in_direction(x, y, math.pi) == pytest.approx(0.5)


def test_closest_in_direction_keeps_the_edge_of_the_sector():
    assert closest_in_direction([0.0], [1.0], 0.0) == pytest.approx(1.0)
    assert closest_in_direction([0.0], [1.0], 0.0, half_angle_rad=math.radians(80)) == math.inf


def test_closest_in_direction_ignores_what_is_not_finite():
    assert closest_in_direction(np.array([np.nan, np.inf, 3.0]), np.array([0.0, 0.0, 0.0]), 0.0) == pytest.approx(3.0)
    assert closest_in_direction([], [], 0.0) == math.inf
