"""What the end of a request for a repair means."""

import types

import actionlib
import pytest
import rospy
from actionlib import CommState
from actionlib_msgs.msg import GoalStatus
from metacontrol_msgs.msg import RepairResult
from mros1_reasoner.ros import repairs as module
from mros1_reasoner.ros.repairs import ACKNOWLEDGE_WAIT, RepairRequests


class Handle:
    """A goal of the manipulator, as far as it is known."""

    def __init__(self):
        self.state, self.status, self.result, self.is_cancelled = CommState.WAITING_FOR_GOAL_ACK, None, None, False

    def get_comm_state(self):
        return self.state

    def get_goal_status(self):
        return self.status

    def get_goal_status_text(self):
        return ""

    def get_result(self):
        return self.result

    def cancel(self):
        self.is_cancelled = True


@pytest.fixture
def asked(monkeypatch):
    """Return requests, of which one was sent, with its handle, the clock, how it ended, and a way to end it."""
    found = types.SimpleNamespace(handle=Handle(), now=100.0, ends=[])

    class Client:
        def __init__(self, *_):
            pass

        def wait_for_server(self, _):
            return True

        def send_goal(self, _, on_change):
            found.on_change = on_change
            return found.handle

    monkeypatch.setattr(actionlib, "ActionClient", Client)
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(1))
    monkeypatch.setattr(module.time, "monotonic", lambda: found.now)

    def end(status, result):
        found.handle.state, found.handle.status, found.handle.result = CommState.DONE, status, result
        found.on_change(found.handle)

    found.end = end
    found.requests = RepairRequests(
        lambda work: work(), lambda decision, ok, why, *, blame: found.ends.append((decision, ok, why, blame))
    )
    found.requests.ask("d-1", "valve")
    return found


@pytest.mark.parametrize(
    ("status", "result", "ok", "was_tried"),
    [
        (GoalStatus.SUCCEEDED, RepairResult(True, ""), True, True),
        (GoalStatus.ABORTED, RepairResult(False, "jammed"), False, True),
        (GoalStatus.REJECTED, RepairResult(False, "it is being repaired already"), False, False),
        (GoalStatus.LOST, None, False, False),
    ],
)
def test_only_a_repair_that_was_tried_counts(asked, status, result, ok, was_tried):
    asked.end(status, result)
    assert [(found[1], found[3]) for found in asked.ends] == [(ok, was_tried)]


def test_request_that_died_with_its_manipulator_is_given_up_and_does_not_count(asked):
    assert asked.requests.next_look == asked.now + ACKNOWLEDGE_WAIT
    asked.now += ACKNOWLEDGE_WAIT
    asked.requests.look()
    assert asked.handle.is_cancelled
    ((_, ok, why, blame),) = asked.ends
    assert "said nothing" in why and not ok and not blame


def test_request_that_is_acknowledged_is_waited_for(asked):
    asked.handle.state = CommState.ACTIVE
    asked.requests.look()
    asked.now += 100.0 * ACKNOWLEDGE_WAIT
    asked.requests.look()
    assert asked.ends == [] and asked.requests.next_look == float("inf")
