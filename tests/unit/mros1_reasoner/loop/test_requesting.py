"""Requests to a manipulator that is lost under way."""

import pytest
from mros1_reasoner.loop.requesting import ACKNOWLEDGE_WAIT, Answer, Requesting, Wanted

DEADLINE = 60.0
WANTED = Wanted("f_carry", "on_tracks")


class Manipulator:
    """An action of a manipulator that takes every goal."""

    name = "/barn/rosgraph_manipulator_action_server"

    def __init__(self):
        self.goals = []

    def is_there(self):
        return True

    def send(self, wanted, done):
        self.goals.append(Goal(wanted, done))
        return self.goals[-1]


class Goal:
    """A goal of which the manipulator has told nothing yet."""

    def __init__(self, wanted, done):
        self.wanted, self.done = wanted, done
        self.acknowledged = self.cancelled = False

    def is_acknowledged(self):
        return self.acknowledged

    def cancel(self):
        self.cancelled = True


class Rig:
    """Requests, with what comes of them."""

    def __init__(self):
        self.now, self.reports, self.manipulator = 100.0, [], Manipulator()
        self.requesting = Requesting(
            self.manipulator,
            self.manipulator,
            DEADLINE,
            lambda: self.now,
            lambda *outcome, blame: self.reports.append((*outcome, blame)),
            self.reports.append,
            lambda _line: None,
            lambda _failures, _reason: None,
        )

    def look_at(self, now):
        self.now = now
        self.requesting.look()
        return self.reports


@pytest.fixture
def rig():
    rig = Rig()
    rig.requesting.ask("d1", WANTED)
    return rig


def test_request_of_which_no_manipulator_tells_is_given_up_soon_and_blames_nobody(rig):
    assert rig.requesting.next_look == 100.0 + ACKNOWLEDGE_WAIT
    assert rig.look_at(100.0 + ACKNOWLEDGE_WAIT - 0.1) == []
    ((decision, ok, why, blame),) = rig.look_at(100.0 + ACKNOWLEDGE_WAIT)
    assert (decision, ok, blame) == ("d1", False, False)
    assert "said nothing" in why
    (goal,) = rig.manipulator.goals
    assert goal.cancelled, "a manipulator that only hung must not carry it out later"


def test_acknowledged_request_has_its_whole_time(rig):
    rig.manipulator.goals[0].acknowledged = True
    assert rig.look_at(100.0 + ACKNOWLEDGE_WAIT) == []
    assert rig.requesting.next_look == 100.0 + DEADLINE
    ((_, ok, why, blame),) = rig.look_at(100.0 + DEADLINE)
    assert (ok, blame) == (False, True)
    assert "no result within 60 s" in why


def test_answer_that_comes_after_it_was_given_up_changes_nothing(rig):
    rig.look_at(100.0 + ACKNOWLEDGE_WAIT)
    rig.manipulator.goals[0].done(Answer(True, "", 1))
    assert len(rig.reports) == 1


def test_release_of_which_no_manipulator_tells_is_asked_for_again(rig):
    rig.manipulator.goals[0].done(Answer(True, "", 1))
    rig.now = 200.0
    rig.requesting.release(["f_carry"])
    rig.look_at(200.0 + ACKNOWLEDGE_WAIT)
    rig.now = 300.0
    rig.requesting.release(["f_carry"])
    assert [goal.wanted.configuration for goal in rig.manipulator.goals] == ["on_tracks", "", ""]
