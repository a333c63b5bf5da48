"""Cancellations of the pending goal, and what is stored of goals, without ROS."""

import base64
import threading

import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosgraph_manipulator.goals.goal_keeper import GoalKeeper
from rosgraph_manipulator.ros.goal import PendingGoal


@pytest.fixture
def pending(monkeypatch):
    """A goal that was sent at 99 s, at 100 s."""
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(100))
    pending = PendingGoal.__new__(PendingGoal)
    pending._keeper = GoalKeeper()
    pending._keeper.on_goal(msg.TestActionGoal(goal_id=GoalID(rospy.Time(99), "a")))
    return pending


@pytest.mark.parametrize("changing", [False, True])
@pytest.mark.parametrize(
    ("goal_id", "left"),
    [
        (GoalID(rospy.Time(1000), ""), "a"),  # as servers do: one that is from the future counts for the named goal
        (GoalID(rospy.Time(1000), "b"), "a"),
        (GoalID(rospy.Time(1000), "a"), None),
        (GoalID(rospy.Time(99), ""), None),
        (GoalID(), None),
    ],
)
def test_goal_is_cancelled_by_what_servers_heed(pending, changing, goal_id, left):
    pending._keeper.server_changes(changing)
    pending._on_cancel(goal_id)
    assert pending._keeper.pending_id == left


@pytest.fixture
def stored(monkeypatch, pending):
    """The parameters that the manipulator writes of the goal."""
    parameters = {}
    monkeypatch.setattr(rospy, "set_param", parameters.__setitem__)
    monkeypatch.setattr(rospy, "delete_param", parameters.pop)
    pending._parameters, pending._goal_type, pending._stored = ("wait/resume_goal",), "actionlib/TestActionGoal", None
    pending._lock, pending._server = threading.RLock(), None
    pending._clients = type("Clients", (), {"of": staticmethod(lambda goal: None)})
    return parameters


def stored_id(parameters):
    data = base64.b64decode(parameters["wait/resume_goal"]["data"])
    return msg.TestActionGoal().deserialize(data).goal_id.id


def tell(pending, *states):
    status = GoalStatusArray(
        status_list=[GoalStatus(goal_id=GoalID(id=goal_id), status=state) for goal_id, state in states]
    )
    status._connection_header = pending
    pending._on_status(status)


def test_goal_at_work_stays_stored_until_the_server_has_taken_a_newer_one(pending, stored):
    tell(pending, ("a", GoalStatus.ACTIVE))
    assert stored_id(stored) == "a"
    pending._on_goal(msg.TestActionGoal(goal_id=GoalID(rospy.Time(100), "b")))
    tell(pending, ("a", GoalStatus.ACTIVE), ("b", GoalStatus.PENDING))
    assert stored_id(stored) == "a"
    tell(pending, ("a", GoalStatus.PREEMPTED), ("b", GoalStatus.ACTIVE))
    assert stored_id(stored) == "b"
    tell(pending, ("b", GoalStatus.SUCCEEDED))
    assert not stored
