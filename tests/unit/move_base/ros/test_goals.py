"""Goals of the action from their arrival on: none moves the base before its frame is known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from move_base.ros.frames import pose_in
from move_base.ros.goals import FRAME_PATIENCE, GoalServer
from move_base_msgs.msg import MoveBaseGoal
from node_kit.io.inbox import Inbox
from robot_formulas.geometry import transform_of


class Handle:
    """A goal's handle that notes what its client is told."""

    def __init__(self, stamp, frame="map", name=""):
        self.id = GoalID(rospy.Time.from_sec(stamp), name or f"goal at {stamp:g}")
        self.goal = MoveBaseGoal()
        self.goal.target_pose.header.frame_id = frame
        self.goal.target_pose.pose.orientation.w = 1.0
        self.told = []

    def get_goal(self):
        return self.goal

    def get_goal_id(self):
        return self.id

    def set_accepted(self, _text):
        self.told.append("accepted")

    def set_canceled(self, _result, text):
        self.told.append(text)

    def set_aborted(self, _result, text):
        self.told.append(text)


class Frames:
    """Frames by their transform to the map."""

    def __init__(self):
        self.known = {}

    def lookup(self, _target, source, _stamp):
        return self.known.get(source)


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(rospy, "get_time", lambda: clock.now)
    monkeypatch.setattr(rospy.Time, "now", staticmethod(lambda: rospy.Time.from_sec(clock.now)))
    return clock


@pytest.fixture
def server(clock, monkeypatch):
    """A goal server without a master; `moves` tells whether the base has a command in force."""
    silent = SimpleNamespace(publish=lambda _: None)
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: silent)
    monkeypatch.setattr(rospy, "Subscriber", lambda *_, **__: None)
    monkeypatch.setattr("move_base.ros.goals._Server", lambda *_, **__: None)
    base = SimpleNamespace(moves=False, goals=0)

    def begin(_goal, _now):
        base.moves, base.goals = True, base.goals + 1

    def cancel(stop):
        base.moves = base.moves and not stop

    server = GoalServer(Frames(), "map", begin, cancel, None)
    server.base, server.clock = base, clock
    assert isinstance(server._requests, Inbox)
    return server


def arrives(server, *handles):
    for handle in handles:
        server._on_goal(handle)
    server.take_requests(server.clock.now)


def test_base_stands_still_while_a_new_goal_waits_for_its_frame(server):
    old, new = Handle(100.0), Handle(100.0, "attic", "new")
    arrives(server, old)
    assert server.base.moves
    arrives(server, new)
    assert not server.base.moves
    assert old.told[-1] == "preempted by a newer goal"
    server._frames.known["attic"] = np.eye(4)
    server.take_requests(server.clock.now)
    assert server.base.moves


def test_base_goes_on_with_a_new_goal_whose_frame_is_known(server):
    stops = []
    cancel, server._cancel = server._cancel, lambda stop: (stops.append(stop), cancel(stop))
    arrives(server, Handle(100.0), Handle(100.0, name="new"))
    assert server.base.goals == 2
    assert stops == [False]


def test_goal_whose_frame_stays_unknown_ends_in_time_although_the_clock_is_set_back(server):
    handle = Handle(100.0, "attic")
    arrives(server, handle)
    server.clock.now = 10.0
    server.reset_time(server.clock.now)
    server.take_requests(server.clock.now)
    assert handle.told == ["accepted"]
    server.clock.now += FRAME_PATIENCE + 0.1
    server.take_requests(server.clock.now)
    assert handle.told[-1] == "the goal's frame 'attic' has no transform to 'map'"


def test_older_goal_does_not_replace_a_newer_one(server):
    newer, older = Handle(100.0), Handle(99.0)
    arrives(server, newer, older)
    assert older.told[-1] == "a newer goal is active"
    assert newer.told == ["accepted"]


def test_goal_from_the_future_does_not_shut_out_later_ones(server):
    ahead, later = Handle(3700.0), Handle(100.0)
    arrives(server, ahead, later)
    assert ahead.told[-1] == "preempted by a newer goal"
    assert later.told == ["accepted"]


def test_goal_from_before_the_clock_was_set_back_does_not_shut_out_later_ones(server):
    before, later = Handle(100.0), Handle(99.6)
    arrives(server, before)
    server.clock.now = 99.5
    server.reset_time(server.clock.now)
    arrives(server, later)
    assert before.told[-1] == "preempted by a newer goal"
    assert later.told == ["accepted"]


@pytest.mark.parametrize(
    ("rotation", "position", "expected"),
    [
        ((1.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)),  # a laser mounted upside down
        ((-0.5, 0.5, -0.5, 0.5), (0.5, 0.0, 2.0), (2.0, -0.5, -math.pi / 2)),  # a camera's optical frame
    ],
)
def test_pose_in_a_tilted_frame_is_transformed_in_space(rotation, position, expected):
    frames, stamped = Frames(), PoseStamped()
    frames.known["sensor"] = transform_of((0.0, 0.0, 0.3), rotation)
    stamped.header.frame_id = "/sensor"
    stamped.pose.position.x, stamped.pose.position.y, stamped.pose.position.z = position
    stamped.pose.orientation.w = 1.0
    found = pose_in("map", stamped, frames)
    assert (found.x, found.y, found.yaw) == pytest.approx(expected)


def test_goal_in_a_tilted_frame_is_begun_where_it_is(server):
    begun = []
    server._begin = lambda goal, _now: begun.append((goal.x, goal.y))
    server._frames.known["sensor"] = transform_of((0.0, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0))
    handle = Handle(100.0, "sensor")
    handle.goal.target_pose.pose.position.x = handle.goal.target_pose.pose.position.y = 1.0
    arrives(server, handle)
    assert begun == [pytest.approx((1.0, -1.0))]
