"""A server with one goal at a time takes new goals, whatever the stamps of former ones and of cancellations."""

import threading
from unittest.mock import Mock

import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus
from helpers.waiting import wait_for
from metacontrol_manipulation.ros import approach, builder
from metacontrol_manipulation.ros.action_server import SimpleServer


class Server(SimpleServer):
    """The server without topics; each goal ends when it is let go."""

    def __init__(self):
        self.let_go = threading.Event()
        super().__init__("test", msg.TestAction, self.execute, auto_start=False)
        self.action_server.started = True
        self.action_server.status_pub, self.action_server.result_pub = Mock(), Mock()

    def execute(self, _goal):
        wait_for(lambda: self.let_go.is_set() or self.is_preempt_requested(), "the goal is let go")
        (self.set_preempted if self.is_preempt_requested() else self.set_succeeded)()

    def send(self, name, stamp):
        self.action_server.internal_goal_callback(
            msg.TestActionGoal(goal_id=GoalID(id=name, stamp=rospy.Time.from_sec(stamp)))
        )

    def status_of(self, name):
        return next(one.status.status for one in self.action_server.status_list if one.status.goal_id.id == name)

    def wait(self, name, *statuses):
        wait_for(lambda: self.status_of(name) in statuses, lambda: f"{name} is {self.status_of(name)}", 20.0)


@pytest.fixture
def server(clock):
    server = Server()
    yield server
    server.let_go.set()
    with server.terminate_mutex:
        server.need_to_terminate = True
    server.execute_thread.join()
    server.action_server.status_list.clear()


@pytest.mark.parametrize("stamp", [1e9, 1000.0])
def test_goal_is_taken_after_one_from_the_future_or_from_before_the_clock_was_set_back(server, clock, stamp):
    server.let_go.set()
    server.send("a", stamp)
    server.wait("a", GoalStatus.SUCCEEDED)
    clock.set_to(5.0)
    server.send("b", 5.0)
    server.wait("b", GoalStatus.SUCCEEDED)


def test_later_goal_takes_the_place_of_one_that_is_under_way(server):
    server.send("a", 1000.0)
    server.wait("a", GoalStatus.ACTIVE)
    server.send("b", 1000.1)
    server.wait("a", GoalStatus.PREEMPTED)
    server.wait("b", GoalStatus.ACTIVE)
    server.send("c", 999.0)  # it was sent before
    server.wait("c", GoalStatus.RECALLED)


def test_cancellation_from_the_future_ends_no_later_goal(server):
    server.let_go.set()
    server.action_server.internal_cancel_callback(GoalID(stamp=rospy.Time(1_000_000_000)))
    server.send("a", 1000.0)
    server.wait("a", GoalStatus.SUCCEEDED)


@pytest.mark.parametrize(
    ("module", "action", "make"),
    [
        (approach, "move_position", approach.Approach),
        (builder, "build", lambda: builder.Builder(Mock(), Mock())),
    ],
)
def test_nodes_of_this_package_have_this_server(clock, monkeypatch, module, action, make):
    assert module.SimpleServer is SimpleServer
    server = Mock()
    monkeypatch.setattr(module, "SimpleServer", server)
    monkeypatch.setattr(rospy, "get_param", lambda *_: {})
    monkeypatch.setattr(rospy, "get_name", lambda: "/node")
    for name in ("start_with", "take_resumed_goal"):
        monkeypatch.setattr(builder, name, Mock())
    make()
    assert server.call_args.args[0] == action
