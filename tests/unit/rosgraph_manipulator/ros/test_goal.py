"""Cancellations of the pending goal, without ROS."""

import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID
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
