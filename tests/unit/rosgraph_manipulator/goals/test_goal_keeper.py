"""The pending goal of an action, told from its messages."""

import genpy
import pytest
from actionlib import msg as actionlib_test_messages
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosgraph_manipulator.goals.goal_keeper import GoalKeeper


def goal(goal_id, stamp=1):
    return actionlib_test_messages.TestActionGoal(goal_id=GoalID(id=goal_id, stamp=genpy.Time(stamp)))


def status(goal_id, state):
    return GoalStatusArray(status_list=[GoalStatus(goal_id=GoalID(id=goal_id, stamp=genpy.Time(1)), status=state)])


def result(goal_id, state):
    return actionlib_test_messages.TestActionResult(status=GoalStatus(goal_id=GoalID(id=goal_id), status=state))


@pytest.fixture
def keeper():
    keeper = GoalKeeper()
    keeper.on_goal(goal("a"))
    return keeper


def test_goal_is_pending_until_it_ends(keeper):
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending_id == "a"
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    assert keeper.pending is None


def test_newer_goal_replaces_the_pending_one(keeper):
    keeper.on_goal(goal("b", 2))
    keeper.on_result(result("a", GoalStatus.PREEMPTED))
    assert keeper.pending_id == "b"


def test_server_that_is_being_replaced_does_not_end_the_goal_by_dropping_it(keeper):
    keeper.server_changes(True)
    keeper.on_result(result("a", GoalStatus.ABORTED))
    assert keeper.pending_id == "a"


def test_goal_reached_while_the_server_is_being_replaced_is_not_resurrected(keeper):
    keeper.server_changes(True)
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    assert keeper.pending is None


@pytest.mark.parametrize("end", [result, status])
def test_goal_that_arrives_after_its_own_end_is_not_pending(end):
    keeper = GoalKeeper()
    (keeper.on_result if end is result else keeper.on_status)(end("a", GoalStatus.SUCCEEDED))
    keeper.on_goal(goal("a"))
    assert keeper.pending is None


def test_finished_goal_sent_again_by_ourselves_is_not_taken_as_new(keeper):
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    keeper.on_goal(goal("a"))
    assert keeper.pending is None


@pytest.mark.parametrize(
    ("cancel", "ends"),
    [
        (GoalID(id="a"), True),
        (GoalID(id="b"), False),
        (GoalID(), True),
        (GoalID(stamp=genpy.Time(1)), True),
        (GoalID(stamp=genpy.Time(0, 5)), False),
        (GoalID(id="b", stamp=genpy.Time(2)), True),
    ],
)
def test_cancel_follows_the_rules_of_actionlib(keeper, cancel, ends):
    keeper.on_cancel(cancel)
    assert (keeper.pending is None) is ends


def test_cancelled_goal_that_the_server_goes_on_with_was_sent_after_the_cancellation(keeper):
    keeper.on_cancel(GoalID())
    keeper.on_status(status("a", GoalStatus.ACTIVE))  # it may have been on its way
    assert keeper.pending is None
    for _ in range(5):
        keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending_id == "a"
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    assert keeper.pending is None


@pytest.mark.parametrize("state", [GoalStatus.PREEMPTING, GoalStatus.PREEMPTED])
def test_cancelled_goal_that_the_server_gives_up_stays_cancelled(keeper, state):
    keeper.on_cancel(GoalID())
    keeper.on_status(status("a", state))
    for _ in range(5):
        keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending is None


def test_goal_cancelled_during_a_change_stays_cancelled_though_the_old_server_has_it(keeper):
    keeper.server_changes(True)
    keeper.on_cancel(GoalID())
    for _ in range(5):
        keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending is None


def test_goal_without_an_id_takes_the_one_that_the_server_gave_it():
    keeper = GoalKeeper()
    keeper.on_goal(goal(""))
    keeper.on_status(status("server-1", GoalStatus.ACTIVE))
    assert keeper.pending.goal_id.id == "server-1"


def test_adopted_goal_is_kept_while_the_server_has_it_at_work():
    keeper = GoalKeeper()
    keeper.adopt(goal("a"))
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending_id == "a"


def test_adopted_goal_that_ended_meanwhile_is_dropped():
    keeper = GoalKeeper()
    keeper.adopt(goal("a"))
    keeper.on_status(GoalStatusArray())
    assert keeper.pending is None


def test_adopted_goal_is_kept_while_its_server_is_replaced():
    keeper = GoalKeeper()
    keeper.server_changes(True)
    keeper.adopt(goal("a"))
    keeper.on_status(GoalStatusArray())
    assert keeper.pending_id == "a"
    assert not keeper.is_at_work


def test_goal_at_work_that_is_not_pending_is_a_stray():
    keeper = GoalKeeper()
    keeper.on_goal(goal("new"))
    keeper.on_status(status("old", GoalStatus.ACTIVE))
    assert keeper.strays == {"old"}


def test_goal_that_a_new_server_lacks_is_sent_again_and_again_until_it_has_it(keeper):
    keeper.server_changes(True)
    keeper.server_changes(False)
    assert keeper.to_send(10.0).goal_id.id == "a"
    assert keeper.to_send(10.05) is None  # the server has not had the time to tell that it has it
    assert keeper.to_send(10.15).goal_id.id == "a"
    assert not keeper.is_delivered
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.to_send(20.0) is None
    assert keeper.is_delivered


def test_every_new_server_is_sent_the_goal_at_once(keeper):
    keeper.to_send(10.0)
    keeper.server_changes(True)
    keeper.server_changes(False)
    assert keeper.to_send(10.1).goal_id.id == "a"


def test_goal_that_was_cancelled_meanwhile_is_not_sent(keeper):
    keeper.server_changes(True)
    keeper.on_cancel(GoalID(id="a"))
    keeper.server_changes(False)
    assert keeper.to_send(10.0) is None
    assert keeper.is_delivered
