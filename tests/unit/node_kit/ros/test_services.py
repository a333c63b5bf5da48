"""Calls of services of the running system."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from node_kit.ros import services


def test_fields_of_a_request_may_have_any_names(monkeypatch):
    monkeypatch.setattr(services, "rospy", SimpleNamespace(**vars(rospy)))
    monkeypatch.setattr(services.rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(services.rospy, "ServiceProxy", lambda name, kind: lambda **fields: (name, kind, fields))
    fields = {"name": "box", "kind": 3, "service": ""}
    assert services.call("/spawn", str, **fields) == ("/spawn", str, fields)


def test_service_that_never_answers_is_named(monkeypatch):
    forever = threading.Event()
    monkeypatch.setattr(services, "rospy", SimpleNamespace(**vars(rospy)))
    monkeypatch.setattr(services.rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(services.rospy, "ServiceProxy", lambda name, kind: lambda *_: forever.wait())
    monkeypatch.setattr(services, "ANSWER_S", 0.1)
    with pytest.raises(rospy.ROSException, match=r"^/reasoner/feasible has not answered within 0.1 s: look at"):
        services.call_within(0.1, "/reasoner/feasible", str, "")
    forever.set()


@pytest.mark.parametrize("failing", ["wait_for_service", "ServiceProxy"])
def test_error_of_the_system_is_told_with_the_service(monkeypatch, failing):
    def refuse(*_):
        raise ConnectionResetError("reset by peer")

    monkeypatch.setattr(services, "rospy", SimpleNamespace(**vars(rospy)))
    monkeypatch.setattr(services.rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(services.rospy, failing, refuse)
    with pytest.raises(rospy.ServiceException, match=r"^/reasoner/feasible: reset by peer$"):
        services.call_within(0.1, "/reasoner/feasible", str, "")
