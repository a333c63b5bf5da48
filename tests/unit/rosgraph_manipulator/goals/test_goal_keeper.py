"""The pending goal of an action, told from its messages."""

import genpy
import pytest
from actionlib import msg as actionlib_test_messages
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosgraph_manipulator.goals.clients import Client
from rosgraph_manipulator.goals.goal_keeper import (
    CONFIRMATIONS,
    LATE_STATUSES,
    LONGEST_WAIT,
    UNNAMED_STATUSES,
    GoalKeeper,
)

CLIENT = Client("/script", "http://host:1")


def goal(goal_id, stamp=1):
    return actionlib_test_messages.TestActionGoal(goal_id=GoalID(id=goal_id, stamp=genpy.Time(stamp)))


def status(goal_id, state):
    return listed((goal_id, state))


def listed(*goals):
    return GoalStatusArray(
        status_list=[GoalStatus(goal_id=GoalID(id=name, stamp=genpy.Time(1)), status=state) for name, state in goals]
    )


def result(goal_id, state):
    return actionlib_test_messages.TestActionResult(status=GoalStatus(goal_id=GoalID(id=goal_id), status=state))


def to_send(keeper, now):
    return keeper.to_send(now)[0]


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


@pytest.mark.parametrize("names", [("b",), ("",), ("b", "c"), ("", ""), ("b", "")])
@pytest.mark.parametrize("end", [result, status])
def test_goal_is_kept_when_the_server_rejects_newer_ones(keeper, names, end):
    keeper = GoalKeeper()
    keeper.on_goal(goal("a"), CLIENT)
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    for number, name in enumerate(names):
        keeper.on_goal(goal(name, 2 + number))
        keeper.on_status(status("a", GoalStatus.ACTIVE))  # published before the server heard of the newer one
    for number, name in enumerate(names):
        told = end(name or f"server-{number}", GoalStatus.REJECTED)
        (keeper.on_result if end is result else keeper.on_status)(told)
    assert (keeper.pending, keeper.client) == (goal("a"), CLIENT)
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.is_delivered and not keeper.strays - {"a"}
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    assert keeper.pending is None


def test_adopted_goal_that_ended_meanwhile_does_not_come_back_when_a_newer_one_is_rejected():
    keeper = GoalKeeper()
    keeper.adopt(goal("a"))
    keeper.on_goal(goal("b", 2))
    keeper.on_result(result("b", GoalStatus.REJECTED))
    keeper.on_status(status("b", GoalStatus.REJECTED))
    assert keeper.pending is None


def test_rejection_may_come_before_the_message_of_a_goal_without_an_id(keeper):
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.on_result(result("server-1", GoalStatus.REJECTED))
    keeper.on_goal(goal(""))
    assert keeper.pending_id == "a"
    keeper.on_goal(goal(""))  # another one
    assert keeper.pending_id == ""
    keeper.on_status(status("server-2", GoalStatus.ACTIVE))
    assert keeper.pending_id == "server-2"


def test_end_of_which_no_message_comes_is_no_end_of_a_much_later_goal(keeper):
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.on_result(result("server-1", GoalStatus.REJECTED))
    for _ in range(LATE_STATUSES):
        keeper.on_status(status("server-1", GoalStatus.REJECTED))
    keeper.on_goal(goal(""))
    assert keeper.pending_id == ""


def late(keeper, end="server-1"):
    """A goal without an id comes so long after the server has told its end that nobody remembers that."""
    for _ in range(LATE_STATUSES + 1):
        keeper.on_status(status(end, GoalStatus.REJECTED))
    keeper.on_goal(goal("", 0))


def test_goal_without_an_id_that_comes_late_after_its_end_is_given_up_for_the_one_at_work(keeper):
    late(keeper)
    for _ in range(UNNAMED_STATUSES + 1):
        keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending_id == "a"
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    assert keeper.pending is None


def test_goal_without_an_id_is_kept_while_no_server_could_name_it(keeper):
    keeper.server_changes(True)
    keeper.on_goal(goal("", 0))
    for _ in range(2 * UNNAMED_STATUSES):
        keeper.on_status(status("a", GoalStatus.ABORTED))
    assert keeper.pending_id == ""


def test_goal_whose_message_comes_after_the_server_has_listed_it_keeps_its_own_content():
    keeper = GoalKeeper()
    late(keeper)
    wanted = goal("b", 3)
    wanted.goal.goal = 7
    keeper.on_status(status("b", GoalStatus.ACTIVE))
    keeper.on_goal(wanted, CLIENT)
    assert (keeper.pending.goal.goal, keeper.client) == (7, CLIENT)
    repeated = goal("b", 3)
    repeated.goal.goal = 9  # of somebody who takes its id: the server has the first
    keeper.on_goal(repeated)
    assert keeper.pending.goal.goal == 7


def test_goal_that_the_server_has_named_keeps_its_client_when_we_repeat_it():
    keeper = GoalKeeper()
    keeper.on_goal(goal("", 0), CLIENT)
    keeper.on_status(status("server-1", GoalStatus.ACTIVE))
    keeper.on_goal(keeper.pending)
    assert (keeper.pending_id, keeper.client) == ("server-1", CLIENT)


def test_ends_from_before_the_keeper_are_none_of_a_goal_without_an_id():
    keeper = GoalKeeper()
    keeper.on_goal(goal(""))
    keeper.on_status(status("server-1", GoalStatus.REJECTED))
    keeper.on_status(status("server-2", GoalStatus.ACTIVE))
    assert keeper.pending_id == "server-2"


def test_goal_without_an_id_does_not_take_that_of_the_goal_that_it_replaces(keeper):
    keeper.on_goal(goal(""))
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.on_result(result("a", GoalStatus.PREEMPTED))
    keeper.on_status(status("server-1", GoalStatus.ACTIVE))
    assert keeper.pending_id == "server-1"


@pytest.mark.parametrize("name", ["b", ""])
def test_flood_of_goals_that_are_rejected_leaves_the_one_at_work(keeper, name):
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    for number in range(100):
        keeper.on_goal(goal(name and f"{name}{number}", 2))
    for number in range(100):
        keeper.on_result(result(f"{name or 'server'}{number}", GoalStatus.REJECTED))
    assert keeper.pending_id == "a"


def test_message_with_the_id_of_the_pending_goal_does_not_change_it(keeper):
    keeper.on_goal(goal("a", 7))
    assert keeper.pending == goal("a")


@pytest.mark.parametrize("cancel", [GoalID(), GoalID(id="a"), GoalID(stamp=genpy.Time(1))])
def test_cancelled_goal_does_not_come_back_when_a_newer_one_is_rejected(keeper, cancel):
    keeper.on_goal(goal("b", 2))
    keeper.on_cancel(cancel)
    keeper.on_result(result("b", GoalStatus.REJECTED))
    assert keeper.pending is None


@pytest.mark.parametrize("state", [GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.PREEMPTED])
def test_goal_that_another_one_has_replaced_does_not_come_back_when_that_one_ends(keeper, state):
    keeper.on_goal(goal("b", 2))
    keeper.on_result(result("b", state))
    assert keeper.pending is None


def test_goal_that_another_one_has_replaced_does_not_come_back_when_a_later_one_is_rejected(keeper):
    keeper.on_goal(goal("b", 2))
    keeper.on_status(status("b", GoalStatus.ACTIVE))
    keeper.on_goal(goal("c", 3))
    keeper.on_result(result("c", GoalStatus.REJECTED))
    assert keeper.pending_id == "b"
    keeper.on_result(result("b", GoalStatus.REJECTED))
    assert keeper.pending is None


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


def test_adopted_goal_is_kept_until_the_new_server_has_it():
    keeper = GoalKeeper()
    keeper.server_changes(True)
    keeper.adopt(goal("a"))
    keeper.server_changes(False)
    keeper.on_status(GoalStatusArray())  # the new server's, before the goal was sent to it
    assert to_send(keeper, 0.0).goal_id.id == "a"


@pytest.mark.parametrize("is_adopted", [True, False])
@pytest.mark.parametrize("at_work", [("old", "new"), ("old",)])
def test_goal_at_work_that_was_replaced_is_a_stray_once_the_server_has_taken_the_newer_one(is_adopted, at_work):
    keeper = GoalKeeper()
    keeper.server_changes(True)
    (keeper.adopt if is_adopted else keeper.on_goal)(goal("old"))
    keeper.on_goal(goal("new"))
    keeper.on_status(listed(*((name, GoalStatus.ACTIVE) for name in at_work)))
    assert keeper.strays == ({"old"} if "new" in at_work else set())


def test_goal_at_work_that_was_cancelled_is_a_stray():
    keeper = GoalKeeper()
    keeper.server_changes(True)
    keeper.on_goal(goal("old"))
    keeper.on_cancel(GoalID(id="old"))
    keeper.on_status(status("old", GoalStatus.ACTIVE))
    assert keeper.strays == {"old"}


def test_goal_of_which_the_server_heard_first_is_no_stray():
    keeper = GoalKeeper()
    keeper.server_changes(True)
    keeper.on_status(status("new", GoalStatus.ACTIVE))
    keeper.server_changes(False)
    assert keeper.strays == frozenset()
    keeper.on_goal(goal("new"))
    assert keeper.strays == frozenset() and keeper.pending_id == "new" and keeper.is_at_work


def test_goal_at_work_of_which_no_message_has_come_is_missed(keeper):
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.missed == frozenset()
    keeper.on_cancel(GoalID(id="a"))
    assert keeper.missed == frozenset()
    keeper.on_status(status("b", GoalStatus.ACTIVE))
    assert keeper.missed == {"b"}


def test_goal_that_a_new_server_lacks_is_sent_again_and_again_until_it_has_it(keeper):
    keeper.server_changes(True)
    keeper.server_changes(False)
    assert to_send(keeper, 10.0).goal_id.id == "a"
    assert to_send(keeper, 10.05) is None  # the server has not had the time to tell that it has it
    assert to_send(keeper, 10.15).goal_id.id == "a"
    assert not keeper.is_delivered
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert to_send(keeper, 20.0) is None
    assert keeper.is_delivered


def test_every_new_server_is_sent_the_goal_at_once(keeper):
    to_send(keeper, 10.0)
    keeper.server_changes(True)
    keeper.server_changes(False)
    assert to_send(keeper, 10.1).goal_id.id == "a"


def test_goal_that_was_cancelled_meanwhile_is_not_sent(keeper):
    keeper.server_changes(True)
    keeper.on_cancel(GoalID(id="a"))
    keeper.server_changes(False)
    assert to_send(keeper, 10.0) is None
    assert keeper.is_delivered


def waited_for(client=CLIENT):
    keeper = GoalKeeper()
    keeper.on_goal(goal("a"), client)
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    return keeper


def next_server(keeper, takes_over=False, died=True, why_gone=""):
    """Let the server end, and another one come; return why the goal was dropped."""
    reason = "".join(keeper.keep_for_next_server({CLIENT: why_gone} if why_gone else {}, died))
    keeper.server_changes(True)
    keeper.on_status(status("a", GoalStatus.ACTIVE) if takes_over else GoalStatusArray())
    keeper.server_changes(False)
    sent = to_send(keeper, 0.0)
    if sent:
        keeper.on_goal(sent)  # it comes back on the topic
        keeper.on_status(status("a", GoalStatus.ACTIVE))
    return reason


@pytest.mark.parametrize("died", [True, False])
def test_goal_whose_client_is_gone_is_dropped_when_its_server_ends(died):
    keeper = waited_for()
    reason = next_server(keeper, died=died, why_gone="its client /script has ended")
    assert reason == "goal a is not sent to the next server: its client /script has ended"
    assert keeper.pending is None


def test_goal_that_servers_take_over_is_kept_over_any_number_of_deaths():
    keeper = waited_for()
    assert [next_server(keeper, takes_over=True) for _ in range(20)] == [""] * 20
    assert keeper.pending_id == "a"


@pytest.mark.parametrize(("client", "takes_over"), [(CLIENT, False), (None, False), (None, True)])
def test_goal_that_nobody_may_wait_for_is_repeated_a_few_times_after_deaths(client, takes_over):
    keeper = waited_for(client)
    assert [next_server(keeper, takes_over) for _ in range(3)] == [""] * 3
    assert "has died 4 times" in next_server(keeper, takes_over)
    assert keeper.pending is None


@pytest.mark.parametrize("client", [CLIENT, None])
def test_goal_is_sent_again_after_every_change_that_somebody_asks_for(client):
    keeper = waited_for(client)
    assert [next_server(keeper, died=False) for _ in range(20)] == [""] * 20
    assert keeper.pending_id == "a"


def test_new_goal_of_the_same_client_is_counted_anew():
    keeper = waited_for()
    assert [next_server(keeper) for _ in range(3)] == [""] * 3
    keeper.on_goal(goal("b", 2), CLIENT)
    assert next_server(keeper) == ""
    assert keeper.pending_id == "b"
    assert keeper.client == CLIENT


def test_without_a_goal_there_is_nothing_to_drop():
    assert GoalKeeper().keep_for_next_server({CLIENT: "its client /script has ended"}, died=True) == []


OTHER = Client("/other", "http://host:2")


def in_doubt(goals=("b",), changing=False, client=OTHER):
    """A goal of CLIENT is at work, and newer ones come, of which the server has not told yet whether it takes them."""
    keeper = waited_for()
    keeper.server_changes(changing)
    for number, name in enumerate(goals):
        keeper.on_goal(goal(name, 2 + number), client)
    return keeper


def first(keeper):
    wanted, client = keeper.first_for_next_server
    assert keeper.first_id == (wanted and wanted.goal_id.id)
    return keeper.first_id, client


def tell_nothing(keeper):
    """A server shows that it has heard of no goal."""
    for _ in range(CONFIRMATIONS):
        keeper.on_status(GoalStatusArray())


@pytest.mark.parametrize("changing", [True, False])
@pytest.mark.parametrize("goals", [("b",), ("b", "c"), ("",)])
def test_next_server_begins_with_the_goal_at_work_and_then_decides_on_newer_ones(changing, goals):
    keeper = in_doubt(goals, changing)
    assert keeper.keep_for_next_server({}, died=False) == []
    assert first(keeper) == ("a", CLIENT)
    keeper.server_changes(True)
    keeper.on_status(status("a", GoalStatus.ACTIVE))  # the next server's
    keeper.server_changes(False)
    assert not keeper.strays
    for name in reversed(goals):
        sent = to_send(keeper, 0.0)
        assert sent.goal_id.id == name
        keeper.on_status(listed(("a", GoalStatus.ACTIVE), (name or "server-1", GoalStatus.REJECTED)))
    assert keeper.is_delivered and (keeper.pending_id, keeper.client) == ("a", CLIENT)


def test_next_server_that_takes_the_newer_goal_replaces_the_other_one():
    keeper = in_doubt()
    keeper.server_changes(True)
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.server_changes(False)
    assert to_send(keeper, 0.0).goal_id.id == "b"
    keeper.on_status(listed(("a", GoalStatus.PREEMPTED), ("b", GoalStatus.ACTIVE)))
    assert keeper.is_delivered and first(keeper) == ("b", OTHER)
    keeper.on_result(result("b", GoalStatus.SUCCEEDED))
    keeper.on_status(status("b", GoalStatus.SUCCEEDED))
    assert keeper.pending is None and first(keeper) == (None, None)


def test_flood_of_goals_that_are_rejected_leaves_the_one_at_work_though_some_are_listed_as_pending():
    keeper = waited_for()
    for number in range(100):
        keeper.on_goal(goal(f"b{number}", 2))
        keeper.on_status(listed(("a", GoalStatus.ACTIVE), (f"b{number}", GoalStatus.PENDING)))
    assert first(keeper) == ("a", CLIENT)
    for number in range(100):
        keeper.on_result(result(f"b{number}", GoalStatus.REJECTED))
    assert keeper.pending_id == "a"


def test_flood_of_goals_before_any_status_leaves_the_first():
    keeper = GoalKeeper()
    for number in range(100):
        keeper.on_goal(goal(f"b{number}", 2))
    for number in reversed(range(1, 100)):
        keeper.on_result(result(f"b{number}", GoalStatus.REJECTED))
    assert keeper.pending_id == "b0"


@pytest.mark.parametrize("state", [GoalStatus.RECALLED, GoalStatus.PREEMPTED, GoalStatus.ABORTED])
@pytest.mark.parametrize("was_active", [True, False])
def test_goal_is_kept_when_the_server_gives_a_newer_one_up_for_it(state, was_active):
    keeper = in_doubt()  # its stamp is older, say, or its frame is unknown
    if was_active:
        keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", GoalStatus.ACTIVE)))
    keeper.on_result(result("b", state))
    keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", state)))
    assert (keeper.pending_id, first(keeper)) == ("a", ("a", CLIENT))
    keeper.on_result(result("a", GoalStatus.SUCCEEDED))
    keeper.on_status(listed(("a", GoalStatus.SUCCEEDED), ("b", state)))
    assert keeper.pending is None


@pytest.mark.parametrize("state", [GoalStatus.REJECTED, GoalStatus.RECALLED])
def test_goal_is_kept_at_once_when_the_server_has_never_taken_a_newer_one(state):
    keeper = in_doubt()
    keeper.on_result(result("b", state))
    assert first(keeper) == ("a", CLIENT)


@pytest.mark.parametrize("goes_on", [True, False])
def test_goal_comes_back_when_the_newer_one_is_cancelled_only_where_the_server_goes_on_with_it(goes_on):
    keeper = in_doubt()
    keeper.on_cancel(GoalID(id="b"))
    keeper.on_status(status("a", GoalStatus.ACTIVE if goes_on else GoalStatus.PREEMPTED))
    assert keeper.pending_id == ("a" if goes_on else None)
    keeper.on_goal(goal("c", 3))
    keeper.on_result(result("c", GoalStatus.REJECTED))
    assert keeper.pending_id == ("a" if goes_on else None)


def test_cancelled_goal_that_the_server_takes_after_all_has_its_client():
    keeper = in_doubt()
    keeper.on_cancel(GoalID(id="b"))  # it may have been on its way
    for _ in range(5):
        keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", GoalStatus.ACTIVE)))
    assert (keeper.pending_id, first(keeper)) == ("b", ("b", OTHER))
    keeper.on_status(listed(("a", GoalStatus.PREEMPTED), ("b", GoalStatus.SUCCEEDED)))
    assert keeper.pending is None


def test_goal_that_is_cancelled_during_a_change_ends_the_one_that_it_would_have_replaced():
    keeper = in_doubt(changing=True)
    keeper.on_cancel(GoalID(id="b"))
    assert first(keeper) == (None, None)
    keeper.on_status(status("a", GoalStatus.ACTIVE))  # the next server has taken it before
    keeper.server_changes(False)
    assert keeper.strays == {"a"}
    keeper.on_status(status("a", GoalStatus.PREEMPTED))
    assert keeper.pending is None


def test_goal_at_work_is_not_kept_when_its_client_is_gone_though_a_newer_one_is_in_doubt():
    keeper = in_doubt()
    assert keeper.clients == {CLIENT, OTHER}
    assert keeper.keep_for_next_server({CLIENT: "its client has ended"}, died=False) == [
        "goal a is not sent to the next server: its client has ended"
    ]
    assert first(keeper) == ("b", OTHER)


def test_goal_at_work_goes_on_when_the_client_of_a_newer_one_is_gone():
    keeper = in_doubt()
    assert keeper.keep_for_next_server({OTHER: "its client has ended"}, died=False) == [
        "goal b is not sent to the next server: its client has ended"
    ]
    assert (keeper.pending_id, first(keeper)) == ("a", ("a", CLIENT))


def test_goal_at_work_goes_on_when_a_newer_one_has_been_repeated_often_enough():
    keeper = in_doubt(client=None)
    for _ in range(3):
        assert keeper.keep_for_next_server({}, died=True) == []
    assert "has died 4 times" in "".join(keeper.keep_for_next_server({}, died=True))
    assert keeper.pending_id == "a"


def test_next_server_that_takes_nothing_over_is_sent_the_goal_at_work_first():
    keeper = in_doubt()
    keeper.server_changes(True)
    tell_nothing(keeper)
    keeper.server_changes(False)
    assert [keeper.to_send(now) for now in (0.0, 0.05)] == [(goal("a"), CLIENT), (None, None)]
    keeper.on_goal(goal("a"))  # it comes back on the topic
    assert (keeper.pending_id, first(keeper)) == ("b", ("a", CLIENT))
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.to_send(0.06) == (goal("b", 2), OTHER)
    keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", GoalStatus.REJECTED)))
    assert keeper.is_delivered and keeper.pending_id == "a"


@pytest.mark.parametrize("changing", [True, False])
@pytest.mark.parametrize("is_rejected", [True, False])
def test_goal_that_the_next_server_may_have_heard_itself_is_not_replaced_by_the_one_before(changing, is_rejected):
    keeper = waited_for()
    keeper.server_changes(True)
    tell_nothing(keeper)
    keeper.server_changes(changing)
    keeper.on_goal(goal("b", 2), OTHER)
    keeper.on_status(GoalStatusArray())  # it was sent before
    keeper.server_changes(False)
    assert to_send(keeper, 0.0) is None
    keeper.on_status(status("b", GoalStatus.REJECTED if is_rejected else GoalStatus.ACTIVE))
    assert (keeper.pending_id, keeper.is_delivered) == (("a", False) if is_rejected else ("b", True))
    assert to_send(keeper, 1.0) == (goal("a") if is_rejected else None)


def test_goal_at_work_is_sent_after_a_while_to_a_server_whose_clock_stands_still():
    keeper = in_doubt()
    keeper.server_changes(True)
    keeper.on_status(GoalStatusArray())
    keeper.server_changes(False)
    assert [to_send(keeper, now) for now in (0.0, LONGEST_WAIT - 0.1)] == [None, None]
    assert to_send(keeper, LONGEST_WAIT) == goal("a")


@pytest.mark.parametrize("is_taken", [True, False])
def test_goal_that_was_to_be_sent_is_not_the_next_one_any_more_when_the_server_has_taken_a_newer_one(is_taken):
    keeper = in_doubt(changing=True)
    tell_nothing(keeper)
    keeper.server_changes(False)
    assert to_send(keeper, 0.0) == goal("a")
    keeper.on_goal(goal("c", 3))
    keeper.on_status(status("c", GoalStatus.ACTIVE if is_taken else GoalStatus.REJECTED))
    assert keeper.next_id == (None if is_taken else "a")


def test_flood_of_goals_during_a_change_leaves_the_one_at_work():
    keeper = waited_for()
    keeper.server_changes(True)
    keeper.on_status(GoalStatusArray())  # the next server's, which takes nothing over
    for number in range(100):
        keeper.on_goal(goal(f"b{number}", 2))
    tell_nothing(keeper)
    keeper.server_changes(False)
    assert keeper.to_send(0.0) == (goal("a"), CLIENT)


def test_client_that_repeats_a_goal_that_the_server_may_go_back_to_is_known():
    keeper = in_doubt()
    keeper.on_goal(goal("a"), OTHER)
    assert (keeper.pending_id, first(keeper)) == ("b", ("a", OTHER))


def test_client_that_replaces_its_own_goal_and_cancels_the_new_one_wants_neither():
    keeper = in_doubt(client=CLIENT)
    keeper.on_cancel(GoalID(id="b"))
    keeper.on_status(status("a", GoalStatus.ACTIVE))  # it has been asked to end
    assert first(keeper) == (None, None)
    assert keeper.strays == {"a"}


def test_goal_that_the_server_has_taken_and_that_is_cancelled_brings_no_older_one_back():
    keeper = in_doubt()
    keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", GoalStatus.PENDING)))
    keeper.on_cancel(GoalID(id="b"))
    keeper.on_status(listed(("a", GoalStatus.ACTIVE), ("b", GoalStatus.RECALLING)))
    assert first(keeper) == (None, None)


@pytest.mark.parametrize("end", [GoalID(id="b"), result("b", GoalStatus.SUCCEEDED)])
def test_goal_that_was_replaced_does_not_come_back_when_another_one_follows_in_a_change(end):
    keeper = in_doubt(changing=True)
    (keeper.on_cancel if isinstance(end, GoalID) else keeper.on_result)(end)
    keeper.on_goal(goal("c", 3), OTHER)
    assert first(keeper) == ("c", OTHER)
    keeper.server_changes(False)
    keeper.on_result(result("c", GoalStatus.REJECTED))
    assert keeper.pending is None


def test_newer_goal_comes_first_when_servers_die_again_and_again_of_the_one_at_work():
    keeper = in_doubt()
    begun = []
    for _ in range(3):
        assert keeper.keep_for_next_server({}, died=True) == []
        begun.append(keeper.first_id)
        keeper.server_changes(True)
        keeper.on_status(GoalStatusArray())
        keeper.server_changes(False)
    assert begun == ["a", "b", "b"]
    assert keeper.to_send(0.0) == (goal("b", 2), OTHER)
    keeper.on_result(result("b", GoalStatus.REJECTED))
    assert keeper.to_send(1.0) == (goal("a"), CLIENT)


@pytest.mark.parametrize("client", [CLIENT, OTHER])
def test_goal_that_is_not_sent_since_its_client_is_gone_leaves_no_older_one_of_that_client_at_work(client):
    keeper = in_doubt(changing=True, client=client)
    keeper.on_status(status("a", GoalStatus.ACTIVE))  # the next server has taken it
    keeper.server_changes(False)
    assert keeper.to_send(0.0) == (goal("b", 2), client)
    keeper.client_is_gone(client)
    assert keeper.is_delivered
    assert (keeper.pending_id, keeper.strays) == ((None, {"a"}) if client == CLIENT else ("a", frozenset()))


def replaced_before():
    """A goal was replaced while its server was about to end, and a newer one of the other's client follows."""
    keeper = GoalKeeper()
    keeper.on_goal(goal("a"), CLIENT)
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.server_changes(True)
    keeper.on_goal(goal("b", 2), OTHER)
    keeper.on_status(listed(("a", GoalStatus.PREEMPTED), ("b", GoalStatus.ACTIVE)))  # the old server's
    keeper.on_goal(goal("c", 3), OTHER)
    keeper.on_status(status("b", GoalStatus.ACTIVE))  # the next server has taken it
    keeper.server_changes(False)
    return keeper


def test_goal_that_was_replaced_does_not_come_back_when_the_client_of_the_others_is_gone():
    keeper = replaced_before()
    assert to_send(keeper, 0.0) == goal("c", 3)
    keeper.client_is_gone(OTHER)
    assert (keeper.pending_id, keeper.strays) == (None, {"b"})


def test_goal_that_was_replaced_does_not_come_back_at_the_next_change():
    keeper = replaced_before()
    assert len(keeper.keep_for_next_server({OTHER: "its client has ended"}, died=False)) == 2
    assert first(keeper) == (None, None)


def test_goal_at_work_that_is_not_sent_since_its_client_is_gone_leaves_the_newer_one():
    keeper = in_doubt(changing=True)
    tell_nothing(keeper)
    keeper.server_changes(False)
    assert keeper.to_send(0.0) == (goal("a"), CLIENT)
    keeper.client_is_gone(CLIENT)
    assert keeper.to_send(1.0) == (goal("b", 2), OTHER)


def test_nothing_is_left_of_goals_that_are_dropped():
    keeper = in_doubt()
    keeper.drop()
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    assert keeper.pending is None and first(keeper) == (None, None)


@pytest.mark.parametrize("is_at_work", [True, False])
def test_adopted_goal_goes_on_beside_a_newer_one_only_where_the_server_has_it(is_at_work):
    keeper = GoalKeeper()
    keeper.adopt(goal("a"), CLIENT)
    keeper.on_goal(goal("b", 2), OTHER)
    keeper.on_status(status("a", GoalStatus.ACTIVE) if is_at_work else GoalStatusArray())
    assert first(keeper) == (("a", CLIENT) if is_at_work else ("b", OTHER))


def adopted(former, changing=False):
    keeper = GoalKeeper()
    keeper.server_changes(changing)
    assert former.kept_ids == tuple(wanted.goal_id.id for wanted, _ in former.kept)
    for wanted, client in former.kept:
        keeper.adopt(wanted, client)
    assert keeper.kept == former.kept
    return keeper


def test_all_goals_are_adopted_while_the_server_is_replaced():
    keeper = adopted(in_doubt(("b", "c")), changing=True)
    assert (keeper.kept_ids, first(keeper)) == (("a", "b", "c"), ("a", CLIENT))
    keeper.on_status(status("a", GoalStatus.ACTIVE))
    keeper.server_changes(False)
    assert keeper.to_send(0.0) == (goal("c", 3), OTHER)


def test_goal_that_servers_die_of_may_come_first_again_for_another_keeper_but_both_are_kept():
    keeper = in_doubt()
    for _ in range(2):
        assert keeper.keep_for_next_server({}, died=True) == []
    assert first(keeper) == ("b", OTHER)
    assert adopted(keeper).kept_ids == ("a", "b")


def test_goals_that_no_server_has_heard_are_all_adopted():
    keeper = GoalKeeper()
    keeper.server_changes(True)
    keeper.on_goal(goal("a"), CLIENT)
    keeper.on_goal(goal("b", 2), OTHER)
    keeper = adopted(keeper, changing=True)
    keeper.on_status(status("b", GoalStatus.REJECTED))
    assert first(keeper) == ("a", CLIENT)


@pytest.mark.parametrize(
    ("told", "pending", "following"),
    [
        ([("a", GoalStatus.ACTIVE), ("b", GoalStatus.PENDING)], "b", "a"),
        ([("a", GoalStatus.ACTIVE), ("b", GoalStatus.REJECTED)], "a", "a"),
        ([("a", GoalStatus.ACTIVE)], "a", "a"),
        ([("a", GoalStatus.PREEMPTED), ("b", GoalStatus.ACTIVE)], "b", "b"),
        ([("a", GoalStatus.PREEMPTED), ("b", GoalStatus.SUCCEEDED)], None, None),
        ([], None, None),
    ],
)
def test_server_tells_which_of_the_adopted_goals_goes_on(told, pending, following):
    keeper = adopted(in_doubt())
    keeper.on_status(listed(*told))
    assert (keeper.pending_id, first(keeper)[0]) == (pending, following)
