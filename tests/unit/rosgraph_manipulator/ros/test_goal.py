"""Cancellations of the pending goal, and what is stored of goals, without ROS."""

import base64
import threading

import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosgraph_manipulator.goals.clients import Client
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


SERVER, MANIPULATOR = "wait/resume_goal", "~kept_goals/wait"


def around(monkeypatch, pending, parameters, ended=()):
    """Give it parameters to write, and the clients that have ended."""
    monkeypatch.setattr(rospy, "set_param", parameters.__setitem__)
    monkeypatch.setattr(rospy, "get_param", parameters.get)
    monkeypatch.setattr(rospy, "delete_param", parameters.pop)
    pending._for_server, pending._for_manipulator = SERVER, MANIPULATOR
    pending._action, pending._goal_type, pending._stored = "wait", "actionlib/TestActionGoal", (None, ())
    pending._lock, pending._server = threading.RLock(), None
    pending._clients = type(
        "Clients",
        (),
        {
            "of": staticmethod(lambda goal: CLIENTS.get(goal.goal_id.id)),
            "why_gone": staticmethod(lambda client: "it has ended" if client in ended else ""),
        },
    )


CLIENTS = {"b": Client("/b", "http://host:1"), "c": Client("/c", "http://host:2")}


@pytest.fixture
def stored(monkeypatch, pending):
    """The parameters that the manipulator writes of the goals."""
    parameters = {}
    around(monkeypatch, pending, parameters)
    return parameters


def id_of(parameter):
    return msg.TestActionGoal().deserialize(base64.b64decode(parameter["data"])).goal_id.id


def ids(parameters):
    """The goal for the next server, and those for the next manipulator."""
    return id_of(parameters[SERVER]), [id_of(one) for one in parameters[MANIPULATOR]]


def tell(pending, *states):
    status = GoalStatusArray(
        status_list=[GoalStatus(goal_id=GoalID(id=goal_id), status=state) for goal_id, state in states]
    )
    status._connection_header = pending
    pending._on_status(status)


def send(pending, goal_id):
    pending._on_goal(msg.TestActionGoal(goal_id=GoalID(rospy.Time(100), goal_id)))


def test_goal_at_work_stays_stored_until_the_server_has_taken_a_newer_one(pending, stored):
    tell(pending, ("a", GoalStatus.ACTIVE))
    assert ids(stored) == ("a", ["a"])
    send(pending, "b")
    assert ids(stored) == ("a", ["a", "b"])
    tell(pending, ("a", GoalStatus.ACTIVE), ("b", GoalStatus.PENDING))
    assert ids(stored) == ("a", ["a", "b"])
    tell(pending, ("a", GoalStatus.PREEMPTED), ("b", GoalStatus.ACTIVE))
    assert ids(stored) == ("b", ["b"])
    tell(pending, ("b", GoalStatus.SUCCEEDED))
    assert not stored


def test_goal_without_an_id_is_stored_only_when_the_server_has_named_it(pending, stored):
    tell(pending, ("a", GoalStatus.ACTIVE))
    send(pending, "")
    assert ids(stored) == ("a", ["a"])
    tell(pending, ("a", GoalStatus.ACTIVE), ("server-1", GoalStatus.PENDING))
    assert ids(stored) == ("a", ["a", "server-1"])


def test_parameter_that_the_server_may_have_deleted_is_not_written_because_of_a_newer_goal(pending, stored):
    tell(pending, ("a", GoalStatus.ACTIVE))
    del stored[SERVER]
    send(pending, "b")
    assert list(stored) == [MANIPULATOR]


@pytest.fixture
def two_stored(pending, stored):
    """What a manipulator has left that died while a goal of /b was at work, and one of /c had just come."""
    send(pending, "b")
    tell(pending, ("a", GoalStatus.PREEMPTING), ("b", GoalStatus.ACTIVE))
    send(pending, "c")
    return stored


def next_manipulator(monkeypatch, parameters, adopt=True, ended=()):
    pending = PendingGoal.__new__(PendingGoal)
    pending._keeper = GoalKeeper()
    around(monkeypatch, pending, parameters, ended)
    pending._recall(msg.TestActionGoal, adopt)
    return pending


@pytest.mark.parametrize(("ended", "kept"), [("", ["b", "c"]), ("b", ["c"]), ("c", ["b"]), ("bc", [])])
def test_next_manipulator_takes_both_goals_over_whose_clients_are_there(monkeypatch, two_stored, ended, kept):
    pending = next_manipulator(monkeypatch, two_stored, ended=[CLIENTS[goal_id] for goal_id in ended])
    taken = [(goal.goal_id.id, client) for goal, client in pending._keeper.kept]
    assert taken == [(goal_id, CLIENTS[goal_id]) for goal_id in kept]
    assert ids(two_stored) == (kept[0], kept) if kept else not two_stored


@pytest.mark.parametrize("spoilt", [None, 3, {}, [None], [3], [{}], [{"type": "a/B"}]])
def test_next_manipulator_goes_on_with_what_there_is_for_the_server(monkeypatch, two_stored, spoilt):
    two_stored[MANIPULATOR] = spoilt
    pending = next_manipulator(monkeypatch, two_stored)
    assert pending._keeper.kept_ids == ("b",)


@pytest.mark.parametrize("spoilt", [None, 3, {}, {"type": "a/B"}, {"type": "actionlib/TestActionGoal", "data": "?"}])
def test_goals_of_another_time_are_deleted(monkeypatch, two_stored, spoilt):
    two_stored[SERVER] = two_stored[MANIPULATOR][1] = spoilt
    pending = next_manipulator(monkeypatch, two_stored)
    assert pending._keeper.pending_id is None and not two_stored


def test_goals_are_deleted_where_nothing_is_adopted(monkeypatch, two_stored):
    pending = next_manipulator(monkeypatch, two_stored, adopt=False)
    assert pending._keeper.pending_id is None and not two_stored
