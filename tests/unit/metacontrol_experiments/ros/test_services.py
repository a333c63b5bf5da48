"""Calls of services of the running system."""

from types import SimpleNamespace

import rospy
from metacontrol_experiments.ros import services


def test_fields_of_a_request_may_have_any_names(monkeypatch):
    monkeypatch.setattr(services, "rospy", SimpleNamespace(**vars(rospy)))
    monkeypatch.setattr(services.rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(services.rospy, "ServiceProxy", lambda name, kind: lambda **fields: (name, kind, fields))
    fields = {"name": "box", "kind": 3, "service": ""}
    assert services.call("/spawn", str, **fields) == ("/spawn", str, fields)
