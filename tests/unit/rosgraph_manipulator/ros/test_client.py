"""What the commands read from the manipulator, and where they send requests."""

import pytest
import rospy
from rosgraph_manipulator.ros import client


@pytest.fixture
def parameters(monkeypatch):
    found = {}
    monkeypatch.setattr(rospy, "get_param", found.get)
    return found


@pytest.mark.parametrize(
    ("name", "action"),
    [
        ("rosgraph_manipulator/reconfiguration_action_name", "change_it"),
        ("reconfiguration_action_name", "change_it"),  # from the file that is the node's argument
        ("another", "rosgraph_manipulator_action_server"),
    ],
)
def test_request_goes_to_the_action_that_the_manipulator_offers(parameters, monkeypatch, name, action):
    monkeypatch.setattr(client, "_ask", lambda asked, _kind, goal: (asked, goal.desired_configuration_name))
    parameters[name] = "change_it"
    assert client.request("fast") == (action, "fast")
