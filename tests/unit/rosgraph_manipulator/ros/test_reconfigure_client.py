"""Values that are given to servers of dynamic_reconfigure, without ROS."""

from types import SimpleNamespace

import pytest
from dynamic_reconfigure.msg import Config, DoubleParameter
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.ros import reconfigure_client
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient
from rospy.exceptions import TransportTerminated


@pytest.fixture
def given(monkeypatch):
    """The values that servers got."""
    given = []

    def service(name, _kind):
        def call(config):
            given.append((name, {one.name: one.value for one in config.doubles}))
            return SimpleNamespace(config=Config(doubles=[DoubleParameter(*one) for one in given[-1][1].items()]))

        return call

    monkeypatch.setattr(reconfigure_client.rospy, "ServiceProxy", service)
    return given


def test_server_gets_the_values(given):
    ReconfigureClient().set("/base/planner", {"max_vel_x": 0.9})
    assert given == [("/base/planner/set_parameters", {"max_vel_x": 0.9})]


def test_change_for_which_there_is_no_thread_fails_alone_and_is_not_made_later(given, no_thread):
    no_thread()
    client = ReconfigureClient()
    with pytest.raises(DeploymentError, match="/base/planner does not take the parameters: no thread"):
        client.set("/base/planner", {"max_vel_x": 0.3})
    client.set("/base/planner", {"max_vel_x": 0.9})
    assert [values["max_vel_x"] for _, values in given] == [0.9]


@pytest.mark.parametrize("error", [TransportTerminated("Broken pipe"), ConnectionResetError(104, "reset by peer")])
def test_server_that_ends_during_the_call_fails_the_change_alone(monkeypatch, error):
    def end(_config):
        raise error

    monkeypatch.setattr(reconfigure_client.rospy, "ServiceProxy", lambda *_: end)
    with pytest.raises(DeploymentError, match="/base/planner does not take the parameters: "):
        ReconfigureClient().set("/base/planner", {"max_vel_x": 0.3})
