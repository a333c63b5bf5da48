"""What pages send is checked before anything is done."""

import pytest
from metacontrol_dashboard.state.requests import RequestError, read_limits, read_request


def test_limit_for_all_objectives():
    request = read_request({"action": "set_limit", "quality": "noise", "value": 2})
    assert (request.texts, request.value) == ({"objective": "", "quality": "noise"}, 2.0)


def test_supposed_failures_and_limits():
    request = read_request({"action": "suppose", "failed": ["rudder"], "limits": {"noise": 0.5}})
    assert (request.failed, request.limits) == (("rudder",), {"noise": 0.5})


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        {},
        {"action": "explode"},
        {"action": ["pause"]},
        {"action": "deploy"},
        {"action": "deploy", "configuration": "a\nb"},
        {"action": "approve", "id": 3},
        {"action": "approve", "id": "x" * 1000},
        {"action": "set_limit", "value": 1},
        {"action": "set_limit", "quality": "noise"},
        {"action": "set_limit", "quality": "noise", "value": True},
        {"action": "set_limit", "quality": "noise", "value": float("nan")},
        {"action": "set_limit", "quality": "noise", "value": 10**400},
        {"action": "suppose", "failed": "rudder"},
        {"action": "suppose", "failed": ["x"] * 1000},
        {"action": "suppose", "limits": {"noise": "much"}},
    ],
)
def test_nonsense_is_refused(data):
    with pytest.raises(RequestError):
        read_request(data)


def test_limits_are_numbers_by_names():
    assert read_limits({"noise": 1}) == {"noise": 1.0}
    with pytest.raises(RequestError):
        read_limits([1])
