"""How a mission ends, whatever happens on its way."""

from unittest import mock

import pytest
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


def test_mission_that_ends_by_itself_keeps_its_goal():
    mission = Mission(None)
    mission.drive()
    assert mission.done == ["begun", "MISSION_END"]
