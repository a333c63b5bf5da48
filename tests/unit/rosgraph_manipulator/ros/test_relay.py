"""The relay of an action, whose two sides call back while they hold locks of actionlib."""

import threading

import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from bad_input.unconnected import unconnected
from helpers.waiting import wait_for
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding, LaunchedFunction, LaunchedFunctions
from rosgraph_manipulator.ros import relay as module
from rosgraph_manipulator.ros.relay import Relay


class Lock:
    """A lock of actionlib that tells how many threads wait for it."""

    def __init__(self, lock):
        self.lock, self.waiting = lock, set()

    def __enter__(self):
        self.waiting.add(threading.get_ident())
        self.lock.acquire()
        self.waiting.discard(threading.get_ident())

    def __exit__(self, *_):
        self.lock.release()


@pytest.fixture
def relay(monkeypatch):
    ends = []
    monkeypatch.setattr(module, "is_connected", lambda _: True)
    with unconnected():
        relay = Relay("asked", "wait", msg.TestAction)
    monkeypatch.setattr(rospy, "on_shutdown", ends.append)
    relay._server.lock = Lock(relay._server.lock)
    spinning = threading.Thread(target=relay.spin, daemon=True)
    spinning.start()
    wait_for(lambda: ends, "it spins")
    yield relay
    ends[0]()


def send(relay, name):
    """Send a goal; return how it is followed behind the relay."""
    machines = relay._client.manager.statuses
    before = len(machines)
    relay._server.internal_goal_callback(msg.TestActionGoal(goal_id=GoalID(id=name)))
    wait_for(lambda: len(machines) > before, "the goal is sent")
    machine = machines[-1]()
    machine.mutex = Lock(machine.mutex)
    return machine


def succeed(machine):
    status = GoalStatus(machine.action_goal.goal_id, GoalStatus.SUCCEEDED, "")
    machine.update_result(msg.TestActionResult(status=status))


def status(relay, name):
    (found,) = [entry.status.status for entry in relay._server.status_list if entry.status.goal_id.id == name]
    return found


def while_held(lock, work, meanwhile):
    """Do work in a thread that has the lock, after another thread has done something or waits for the lock."""

    def do():
        with lock:
            other.start()
            wait_for(lambda: not other.is_alive() or other.ident in lock.waiting, "the other thread gets no further")
            work()

    other = threading.Thread(target=meanwhile, daemon=True)
    thread = threading.Thread(target=do, daemon=True)
    thread.start()
    wait_for(lambda: not thread.is_alive() and not other.is_alive(), "no thread waits for the other")


def test_goal_that_ends_while_another_is_taken_back(relay):
    first = send(relay, "first")
    send(relay, "second")
    cancel = GoalID(id="second")
    while_held(relay._server.lock, lambda: relay._server.internal_cancel_callback(cancel), lambda: succeed(first))
    wait_for(lambda: status(relay, "first") == GoalStatus.SUCCEEDED, "the first has ended")


def test_goal_that_ends_while_it_is_taken_back(relay):
    machine = send(relay, "only")
    cancel = GoalID(id="only")
    while_held(machine.mutex, lambda: succeed(machine), lambda: relay._server.internal_cancel_callback(cancel))
    wait_for(lambda: status(relay, "only") == GoalStatus.SUCCEEDED, "it has ended")


def test_goal_that_is_taken_back_while_its_end_is_passed_on(relay):
    machine = send(relay, "only")
    cancel = GoalID(id="only")
    while_held(relay._server.lock, lambda: relay._server.internal_cancel_callback(cancel), lambda: succeed(machine))
    wait_for(lambda: status(relay, "only") == GoalStatus.SUCCEEDED, "it has ended")


def test_recovery_of_a_function_that_does_not_serve_the_action_keeps_no_goal_waiting(relay):
    launched = LaunchedFunctions(functions=[LaunchedFunction("f_go", "c", 1, "STABLE", ["/server"], [], "")])
    launched._connection_header = {"callerid": "/rosgraph_launcher"}
    relay._on_launched(launched)
    status_array = GoalStatusArray()
    status_array._connection_header = {"callerid": "/server"}
    relay._client.last_status_msg = status_array
    relay._on_configuration(ActiveConfiguration(functions=[FunctionGrounding("f_pick", "p", "RECOVERING")]))
    machine = send(relay, "only")
    machine.update_result(msg.TestActionResult(status=GoalStatus(machine.action_goal.goal_id, GoalStatus.ABORTED, "")))
    wait_for(lambda: status(relay, "only") == GoalStatus.ABORTED, "the client is told")
