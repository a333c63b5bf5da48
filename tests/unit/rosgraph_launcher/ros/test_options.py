"""The parameters of the node rosgraph_launcher."""

import pytest
import rospy
from node_kit.parameters import ParameterError
from rosgraph_launcher.ros import launcher


@pytest.fixture
def parameters(monkeypatch):
    own = {}
    monkeypatch.setattr(rospy, "get_param", lambda name, default=None: own if name == "~" else default)
    monkeypatch.setattr(rospy, "get_name", lambda: "/rosgraph_launcher")
    return own


@pytest.mark.parametrize("name", ["shutdown_timeout", "sigint_timeout"])
def test_time_that_no_clock_can_wait_for_is_refused(parameters, name):
    parameters[name] = 86_400
    assert getattr(launcher.read_options(), name) == 86_400.0
    parameters[name] = 3e6
    with pytest.raises(ParameterError, match=f"/rosgraph_launcher/{name}.*at most 86400"):
        launcher.read_options()
