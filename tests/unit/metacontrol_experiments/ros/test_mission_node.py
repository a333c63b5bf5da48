"""How a mission ends, whatever happens on its way."""

from unittest import mock

import pytest
import rospy
from metacontrol_experiments.ros import mission_node
from metacontrol_experiments.ros.mission_node import MissionNode


class Mission(MissionNode):
    """A mission without ROS, in which an error occurs."""

    is_over = False
    start_up = _make_goal = _advance = _ending = mock.Mock()

    def __init__(self, error):
        self.error, self.done = error, []
        self._goal = mock.Mock(cancel=lambda: self.done.append("cancelled"))

    def _begin(self):
        self.done.append("begun")

    def _now(self):
        return 0.0

    def _loop(self):
        if self.error:
            raise self.error

    def _give_up(self, now, reason, *, interrupted):
        self.done.append((reason, interrupted))

    def _end(self):
        self.done.append("MISSION_END")


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (KeyboardInterrupt(), ("interrupted", True)),
        (SystemExit(1), ("SystemExit: 1", False)),
        (ValueError("no\nsuch thing"), ("ValueError: no such thing", False)),
    ],
)
def test_mission_is_ended_and_its_goal_cancelled_whatever_the_error(error, told):
    mission = Mission(error)
    with pytest.raises(type(error)) as caught:
        mission.drive()
    assert caught.value is error
    assert mission.done == ["begun", told, "cancelled", "MISSION_END"]


def test_mission_whose_name_somebody_takes_ends_with_that_reason(monkeypatch):
    mission = Mission(None)
    mission._inbox = mock.Mock()
    mission._give_up = lambda now, reason, **_: (mission.done.append(reason), setattr(mission, "is_over", True))
    mission._clock, mission._check = mock.Mock(take_jump=lambda: None), lambda: None
    monkeypatch.setattr(mission_node.rospy, "is_shutdown", lambda: True)
    monkeypatch.setattr(mission_node.rospy, "get_time", lambda: 1.0)
    MissionNode._loop(mission)
    assert mission.done == ["another node has taken the mission's name"]


def test_event_of_a_mission_that_was_shut_down_is_shown_all_the_same(monkeypatch):
    mission = Mission(None)
    mission._events = mock.Mock(publish=mock.Mock(side_effect=rospy.ROSException("publish() to a closed topic")))
    mission._tell = mission.done.append
    monkeypatch.setattr(mission_node.rospy, "is_shutdown", lambda: True)
    mission._publish_event(rospy.Time(3), "MISSION_END", "", {})
    assert [event.kind for event in mission.done] == ["MISSION_END"]
    monkeypatch.setattr(mission_node.rospy, "is_shutdown", lambda: False)
    with pytest.raises(rospy.ROSException):
        mission._publish_event(rospy.Time(3), "MISSION_END", "", {})


def test_mission_that_ends_by_itself_keeps_its_goal():
    mission = Mission(None)
    mission.drive()
    assert mission.done == ["begun", "MISSION_END"]
