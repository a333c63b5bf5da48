"""What move_base offers beside its action, where the master is in trouble for a moment."""

from types import SimpleNamespace

import pytest
import rospy
from move_base.parameters.reconfiguration import ServerDescription
from move_base.ros import move_base as module
from move_base.ros import reconfigure
from move_base.ros.move_base import MoveBaseNode

SERVICES = ["~make_plan", "~planner/make_plan", "~clear_costmaps"]


@pytest.fixture
def offering(monkeypatch):
    """Return a function that has a node offer everything, and returns what is offered: services, then servers."""
    offered = []
    monkeypatch.setattr(module, "OFFER_AGAIN", 0.001)
    monkeypatch.setattr(module, "servers", lambda _: [ServerDescription(name, "MoveBase") for name in ("a", "b")])
    monkeypatch.setattr(rospy, "Service", lambda name, *_: offered.append(name))
    monkeypatch.setattr(reconfigure, "offer", lambda ones, *_: offered.extend(one.namespace for one in ones))

    def offer():
        node = object.__new__(MoveBaseNode)
        node._parameters = SimpleNamespace(global_planner="planner")
        node._offer_the_rest()
        return offered

    return offer


@pytest.mark.parametrize("failures", [0, 1, 3])
def test_each_service_and_server_is_offered_once_it_can_be(offering, failing, failures):
    error = ConnectionResetError("reset by peer")
    failing(reconfigure, "offer", error, lambda ones, *_: ones[0].namespace == "b", times=failures)
    assert offering() == [*SERVICES, "a", "b"]


def test_what_can_never_be_offered_is_left_out_with_one_warning(offering, failing, monkeypatch):
    warnings = []
    monkeypatch.setattr(rospy, "logwarn", lambda text, *values: warnings.append(text % values))
    error = ValueError("could not convert string to float: ''")
    failing(reconfigure, "offer", error, lambda one, *_: one == [ServerDescription("a", "MoveBase")], times=1)
    assert offering() == [*SERVICES, "b"]
    assert warnings == [f"~a is not offered: {error}: correct the parameters of that name"]


def test_values_of_another_type_are_shown_as_their_defaults():
    server = object.__new__(reconfigure._Server)
    server._description, server._names = None, ["stop_time_buffer", "prune_plan", "vx_samples"]
    server.config = {"stop_time_buffer": 0.2, "prune_plan": True, "vx_samples": 3}
    server._present = lambda *_: {"stop_time_buffer": "", "prune_plan": "false", "vx_samples": 5.0}
    server._copy_from_parameter_server()
    assert server.config == {"stop_time_buffer": 0.2, "prune_plan": False, "vx_samples": 5}
