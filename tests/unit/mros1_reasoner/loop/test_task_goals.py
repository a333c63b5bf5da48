"""What the goals of an action tell of an objective's task, also to a reasoner that comes in between."""

from types import SimpleNamespace

import pytest
from actionlib_msgs.msg import GoalStatus
from mros1_reasoner.loop.task_goals import TaskGoals

ACTIVE, ABORTED, SUCCEEDED = GoalStatus.ACTIVE, GoalStatus.ABORTED, GoalStatus.SUCCEEDED


def goals(**states):
    """Return the statuses of goals that were sent one after another."""
    listed = [
        SimpleNamespace(goal_id=SimpleNamespace(stamp=float(stamp), id=name), status=status)
        for stamp, (name, status) in enumerate(states.items())
    ]
    return SimpleNamespace(status_list=listed)


def news(*arrays):
    known = TaskGoals({})
    return [known.take("o_move", array) for array in arrays]


@pytest.mark.parametrize("status", [ABORTED, GoalStatus.REJECTED, GoalStatus.LOST, SUCCEEDED, GoalStatus.PREEMPTED])
def test_goal_that_had_ended_before_is_no_news(status):
    old = goals(a=status)
    assert news(old, old, goals(), old) == [None] * 4


def test_goal_that_follows_one_that_had_ended_is_news():
    assert news(goals(a=ABORTED), goals(a=ABORTED, b=ACTIVE), goals(a=ABORTED, b=ABORTED)) == [None, False, True]
    assert news(goals(a=ABORTED), goals(a=ABORTED, b=ABORTED)) == [None, True]


@pytest.mark.parametrize("status", [ACTIVE, GoalStatus.PENDING, GoalStatus.PREEMPTING, GoalStatus.RECALLING])
def test_goal_that_is_at_work_at_first_is_heeded(status):
    assert news(goals(a=status), goals(a=status), goals(a=ABORTED), goals(a=ABORTED)) == [False, None, True, None]
    assert news(goals(z=ABORTED, a=status), goals(a=ABORTED)) == [False, True]


def test_first_goal_of_a_server_that_had_none_is_news_however_it_ends():
    assert news(goals(), goals(a=ABORTED)) == [None, True]


def test_each_objective_has_an_action_of_its_own():
    known = TaskGoals({})
    assert known.take("o_move", goals()) is None
    assert known.take("o_grip", goals(a=ABORTED)) is None
    assert known.take("o_move", goals(a=ABORTED)) is True


@pytest.mark.parametrize(("status", "told"), [(ABORTED, True), (SUCCEEDED, False)])
def test_end_of_a_goal_that_a_reasoner_before_has_left_at_work_is_news(status, told):
    known = TaskGoals({"o_move": "a", "o_grip": "b"})
    assert known.at_work == {"o_move": "a", "o_grip": "b"}
    assert known.take("o_move", goals(a=status)) is told
    assert known.take("o_move", goals(a=status)) is None
    assert known.at_work == {"o_grip": "b"}
    assert known.take("o_grip", goals(c=ABORTED)) is None  # another one
    assert known.at_work == {}


def test_goals_at_work_are_those_that_have_not_ended():
    known = TaskGoals({})
    known.take("o_move", goals(a=ACTIVE))
    assert known.at_work == {"o_move": "a"}
    known.take("o_move", goals(a=ACTIVE, b=GoalStatus.PENDING))
    assert known.at_work == {"o_move": "b"}
    known.take("o_move", goals(b=SUCCEEDED))
    assert known.at_work == {}
