"""What the relay of an action makes of the ends that its goals find behind it."""

import pytest
from actionlib_msgs.msg import GoalStatus
from rosgraph_manipulator.goals.relay import Ending, Link


def sent():
    link = Link()
    assert link.needs_sending(changing=False)
    link.sent = True
    return link


@pytest.mark.parametrize(
    ("state", "ending"),
    [
        (GoalStatus.SUCCEEDED, Ending.SUCCEEDED),
        (GoalStatus.ABORTED, Ending.ABORTED),
        (GoalStatus.REJECTED, Ending.ABORTED),
        (GoalStatus.PREEMPTED, Ending.CANCELLED),
    ],
)
def test_ends_are_passed_on(state, ending):
    assert sent().ended_behind(state, changing=False) is ending


@pytest.mark.parametrize("state", [GoalStatus.ABORTED, GoalStatus.PREEMPTED, GoalStatus.RECALLED, GoalStatus.LOST])
def test_goal_that_a_replaced_server_drops_is_sent_again(state):
    link = sent()
    assert link.ended_behind(state, changing=True) is None
    assert not link.needs_sending(changing=True)
    assert link.needs_sending(changing=False)


def test_goal_that_the_server_does_not_know_is_sent_again():
    link = sent()
    assert link.ended_behind(GoalStatus.LOST, changing=False) is None
    assert link.needs_sending(changing=False)


def test_goal_reached_while_the_server_is_replaced_is_reached():
    assert sent().ended_behind(GoalStatus.SUCCEEDED, changing=True) is Ending.SUCCEEDED


def test_goal_taken_back_ends_when_the_server_says_so():
    link = sent()
    assert link.cancel() is None
    assert link.ended_behind(GoalStatus.LOST, changing=True) is Ending.CANCELLED


def test_goal_taken_back_without_a_server_ends_at_once():
    link = Link()
    assert link.cancel() is Ending.CANCELLED
    assert not link.needs_sending(changing=False)
