"""What the relay of an action makes of the ends that its goals find behind it."""

import pytest
from actionlib_msgs.msg import GoalStatus
from rosgraph_manipulator.goals.relay import Ending, Link, ServedFunctions


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


NAVIGATES = {"f_navigate": ["/move_base"], "f_pick": ["/arm", "/camera"]}


def test_only_the_function_that_the_relay_was_given_concerns_it():
    served = ServedFunctions("f_navigate")
    served.launched("/rosgraph_launcher", NAVIGATES)
    served.served_by(["/arm"])
    assert not served.concern({"f_pick"})
    assert served.concern({"f_pick", "f_navigate"})


def test_functions_whose_nodes_serve_the_action_concern_the_relay_and_all_do_until_they_are_known():
    served = ServedFunctions()
    served.served_by(["/move_base"])
    assert served.concern({"f_pick"})
    assert not served.concern(set())
    served.launched("/rosgraph_launcher", NAVIGATES)
    served.served_by(["/move_base"])
    assert (served.concern({"f_pick"}), served.concern({"f_navigate"})) == (False, True)
    served.served_by([])  # while there is no server, or one that nobody has launched
    assert (served.concern({"f_pick"}), served.concern({"f_navigate"})) == (False, True)


def test_server_that_several_functions_share_on_two_hosts_concerns_them_all():
    served = ServedFunctions()
    served.launched("/rosgraph_launcher", NAVIGATES)
    served.launched("/rosgraph_launcher_box", {"f_explore": ["/move_base"], "f_pick": ["/arm"]})
    served.served_by(["/move_base"])
    assert [served.concern({name}) for name in ("f_navigate", "f_explore", "f_pick")] == [True, True, False]
