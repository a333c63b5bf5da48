"""An operator gets an answer, whoever hangs."""

import asyncio
import threading
from types import SimpleNamespace as Thing

import pytest
from metacontrol_dashboard.ros import operator
from metacontrol_dashboard.ros.operator import Operator
from metacontrol_dashboard.state.requests import read_request
from rospy.exceptions import TransportException

DEADLINE_S = 30
SUPPOSED = Thing(decisions=(), note="nothing", after={})


@pytest.fixture
def follower(monkeypatch):
    monkeypatch.setattr(operator.rospy, "get_time", lambda: 1.0)
    monkeypatch.setattr(operator.rospy, "wait_for_service", lambda *_: None)
    return Thing(suppose=lambda *_: SUPPOSED)


@pytest.fixture
def hung(monkeypatch, follower):
    """Let services and the manipulator accept every request, and answer none before the test ends."""
    released = threading.Event()

    def hang(*_):
        released.wait()
        return Thing(success=True, ok=True, done=True, message="late", text="late")

    monkeypatch.setattr(operator.rospy, "ServiceProxy", lambda *_: hang)
    monkeypatch.setattr(operator.client, "request", hang)
    monkeypatch.setattr(operator, "_DEADLINES", dict.fromkeys(operator._DEADLINES, 0.05))
    yield released
    released.set()


def asked(asking, *actions):
    async def ask():
        requests = [{"action": action, "configuration": "a"} for action in actions]
        return await asyncio.gather(*(asking.act(read_request(request)) for request in requests))

    return asyncio.run(asyncio.wait_for(ask(), DEADLINE_S))


@pytest.mark.parametrize("action, who", [("pause", "reasoner"), ("deploy", "rosgraph_manipulator")])
def test_who_hangs_is_told_in_one_line(hung, follower, action, who):
    [answer] = asked(Operator(follower), action)
    assert answer["ok"] is False
    assert answer["message"].startswith(f"{who} has not answered {action} within 0.05 s") and who in answer["message"]


def test_hung_reasoner_delays_nothing_that_needs_none(hung, follower, monkeypatch):
    asking = Operator(follower)
    asked(asking, "pause", "resume", "lock", "unlock")
    monkeypatch.setattr(operator, "_DEADLINES", dict.fromkeys(operator._DEADLINES, DEADLINE_S))
    [refused, supposed] = asked(asking, "pause", "suppose")
    assert refused == {
        "ok": False,
        "message": "reasoner has not answered the last 4 requests: look at that node",
    }
    assert (supposed["ok"], supposed["message"]) == (True, "nothing")


def test_reasoner_that_goes_on_is_asked_again(hung, follower, monkeypatch):
    asking = Operator(follower)
    asked(asking, "pause", "resume", "lock", "unlock")
    monkeypatch.setattr(operator, "_DEADLINES", dict.fromkeys(operator._DEADLINES, DEADLINE_S))
    hung.set()
    for answer in asking._waiting["reasoner"]:
        answer.result(DEADLINE_S)
    assert asked(asking, "pause") == [{"ok": True, "message": "late"}]


def test_connection_that_breaks_is_told(follower, monkeypatch):
    def broken(*_):
        raise TransportException("unable to send")

    monkeypatch.setattr(operator.rospy, "ServiceProxy", lambda *_: broken)
    assert asked(Operator(follower), "lock") == [{"ok": False, "message": "unable to send"}]
