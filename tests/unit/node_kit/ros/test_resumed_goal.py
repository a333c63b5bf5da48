"""A goal to take over stays where it is until it ends: a server that dies before loses nothing."""

import base64
import io
import threading

import pytest
from actionlib_msgs.msg import GoalID, GoalStatus
from helpers.waiting import DEADLINE_S, wait_for
from move_base_msgs.msg import MoveBaseActionGoal
from node_kit.ros import resumed_goal
from node_kit.ros.resumed_goal import start_with, take_resumed_goal

NAME = "/move_base/resume_goal"


class Server:
    """An action server that tells when it did what."""

    ns = "move_base"

    def __init__(self, parameters):
        self.lock, self.started, self.parameters, self.told = threading.RLock(), False, parameters, []

    def initialize(self):
        self.told.append("initialized")

    def internal_goal_callback(self, goal):
        self.told.append(f"has {goal.goal_id.id}, {len(self.parameters)} parameters")

    def publish_result(self, status, result):
        self.told.append(f"result {result} of {status.goal_id.id}")

    def publish_status(self):
        self.told.append("status")


@pytest.fixture
def parameters(monkeypatch):
    found = {}
    monkeypatch.setattr(resumed_goal.rospy, "resolve_name", lambda name: f"/{name}")
    monkeypatch.setattr(resumed_goal.rospy, "get_param", found.__getitem__)
    monkeypatch.setattr(resumed_goal.rospy, "delete_param", found.__delitem__)
    return found


def stored(goal_id):
    goal, buffer = MoveBaseActionGoal(), io.BytesIO()
    goal.goal_id.id = goal_id
    goal.serialize(buffer)
    return {"type": goal._type, "data": base64.b64encode(buffer.getvalue()).decode()}


def taken():
    return take_resumed_goal("move_base", MoveBaseActionGoal)


def test_goal_is_there_for_the_next_server_until_it_has_ended(parameters):
    parameters[NAME] = stored("g1")
    start_with(Server(parameters), taken())  # this server is killed
    server = Server(parameters)
    start_with(server, taken())
    assert server.told == ["initialized", "has g1, 1 parameters", "status"]
    server.publish_result(GoalStatus(goal_id=GoalID(id="g0")), "late")
    server.publish_result(GoalStatus(goal_id=GoalID(id="g1")), "reached")
    assert server.told[3:] == ["result late of g0", "result reached of g1"]
    wait_for(lambda: not parameters, "the parameter is deleted")
    assert taken() is None


@pytest.mark.parametrize("other", [stored("g2"), "nonsense"])
def test_what_is_stored_meanwhile_stays(parameters, monkeypatch, other):
    parameters[NAME] = stored("g1")
    server, read = Server(parameters), threading.Event()
    start_with(server, taken())
    parameters[NAME] = other
    monkeypatch.setattr(resumed_goal.rospy, "get_param", lambda name: read.set() or parameters[name])
    server.publish_result(GoalStatus(goal_id=GoalID(id="g1")), "preempted")
    assert read.wait(DEADLINE_S)
    wait_for(lambda: not [t for t in threading.enumerate() if t.name.endswith("(_delete_goal)")], "it has looked")
    assert parameters == {NAME: other}


def test_what_is_no_goal_is_deleted_at_once(parameters):
    parameters[NAME] = {"type": "move_base_msgs/MoveBaseActionGoal", "data": "?"}
    assert take_resumed_goal("move_base", MoveBaseActionGoal) is None
    assert parameters == {}


def test_server_without_a_goal_just_starts(parameters):
    server = Server(parameters)
    start_with(server, None)
    assert server.told == ["initialized", "status"]
    assert server.started
