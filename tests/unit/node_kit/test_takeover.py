"""The parameter that carries a goal over a restart."""

import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st
from node_kit.takeover import TakeoverError, decode_parameter

GOAL_TYPE = "move_base_msgs/MoveBaseActionGoal"


@given(st.binary(min_size=1))
def test_data_come_back(data):
    assert decode_parameter({"type": GOAL_TYPE, "data": base64.b64encode(data).decode()}, GOAL_TYPE) == data


@pytest.mark.parametrize(
    "value",
    [
        "goal",
        {},
        {"type": "std_msgs/String", "data": "AAAA"},
        {"type": GOAL_TYPE, "data": ""},
        {"type": GOAL_TYPE, "data": "?"},
        {"type": GOAL_TYPE, "data": 3},
        {"type": GOAL_TYPE, "data": "A" * 200_000},
    ],
)
def test_other_values_are_refused(value):
    with pytest.raises(TakeoverError):
        decode_parameter(value, GOAL_TYPE)
