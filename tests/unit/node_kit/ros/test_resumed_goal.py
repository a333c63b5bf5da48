"""A goal to take over stays where it is until a server has it: a server that dies while it starts loses nothing."""

import base64
import io
import threading

import pytest
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


def test_goal_is_there_for_the_next_server_until_one_has_started(parameters):
    parameters[NAME] = stored("g1")
    assert take_resumed_goal("move_base", MoveBaseActionGoal).goal_id.id == "g1"
    goal = take_resumed_goal("move_base", MoveBaseActionGoal)  # the first server was killed
    server = Server(parameters)
    start_with(server, goal)
    assert server.told == ["initialized", "has g1, 0 parameters", "status"]
    assert take_resumed_goal("move_base", MoveBaseActionGoal) is None


def test_what_is_no_goal_is_deleted_at_once(parameters):
    parameters[NAME] = {"type": "move_base_msgs/MoveBaseActionGoal", "data": "?"}
    assert take_resumed_goal("move_base", MoveBaseActionGoal) is None
    assert parameters == {}


def test_server_without_a_goal_just_starts(parameters):
    server = Server(parameters)
    start_with(server, None)
    assert server.told == ["initialized", "status"]
    assert server.started
