"""What move_base offers beside its action, where the master is in trouble for a moment."""

from types import SimpleNamespace

import pytest
import rospy
from move_base.ros import move_base as module
from move_base.ros import reconfigure
from move_base.ros.move_base import MoveBaseNode


@pytest.mark.parametrize("failures", [0, 1, 3])
def test_each_service_and_server_is_offered_once_it_can_be(monkeypatch, failing, failures):
    offered = []
    monkeypatch.setattr(module, "OFFER_AGAIN", 0.001)
    monkeypatch.setattr(module, "servers", lambda _: ["a", "b"])
    monkeypatch.setattr(rospy, "Service", lambda name, *_: offered.append(name))
    monkeypatch.setattr(reconfigure, "offer", lambda descriptions, *_: offered.extend(descriptions))
    failing(reconfigure, "offer", ConnectionResetError("reset by peer"), lambda one, *_: one == ["b"], times=failures)
    node = object.__new__(MoveBaseNode)
    node._parameters = SimpleNamespace(global_planner="planner")
    node._offer_the_rest()
    assert offered == ["~make_plan", "~planner/make_plan", "~clear_costmaps", "a", "b"]
