"""A faster variant is taken again when the cause of a violation is gone, and not again and again."""

import pytest
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import OBJECTIVE


class Robot:
    """A robot whose safety is what is expected of the design that runs, times a factor."""

    def __init__(self, core, designs):
        self.core, self.designs, self.now, self.running, self.changes = core, designs, 0.0, "", []

    def start(self, design):
        self.core.observe_active(0.0, "f_move", design, "STABLE")
        self.running = design
        return self

    def run(self, seconds, factor, quality="safety"):
        for _ in range(round(seconds * 2)):
            self.now += 0.5
            level = self.designs[self.running].expected[quality] * factor
            self.core.observe_level(self.now, quality, level)
            for decision in self.core.step(self.now, heartbeat=True):
                if decision.state == DECIDED:
                    self.core.report(self.now, decision.id, True)
                    self.running = decision.to_configuration
                    self.changes.append((self.now, decision.trigger, self.running, decision.explanation))
        return self


@pytest.fixture
def robot(knowledge_base, reasoner):
    def make(**settings):
        return Robot(Mape(knowledge_base, reasoner, [OBJECTIVE], Settings(**settings)), knowledge_base.designs)

    return make


def test_after_a_transient_violation_the_faster_design_is_taken_again(robot):
    robot = robot().start("scan_slow").run(10, 1.0).run(10, 2.2)
    assert [change[2] for change in robot.changes] == ["scan_slower"]
    robot.run(600, 1.0)
    assert [change[2] for change in robot.changes] == ["scan_slower", "scan_slow"]
    assert robot.changes[1][0] <= 20.0 + 1.5 + Settings().calm + 0.5, "three good levels, and the calm"
    assert f"what made safety violate the limit has been gone for {Settings().calm:.1f} s" in robot.changes[1][3]


def test_a_lasting_cause_keeps_the_slower_design(robot):
    robot = robot().start("scan_slow").run(10, 1.0).run(600, 2.2)
    assert [change[2] for change in robot.changes] == ["scan_slower"]


def test_no_way_back_where_that_is_not_wanted(robot):
    robot = robot(always_improve=False).start("scan_slow").run(10, 1.0).run(10, 2.2).run(600, 1.0)
    assert [change[2] for change in robot.changes] == ["scan_slower"]


def test_cause_that_comes_and_goes_is_met_with_longer_and_longer_calm(robot):
    robot = robot().start("scan_slow").run(10, 1.0)
    for _ in range(60):
        robot.run(5, 2.2).run(5, 1.0)
    back = [when for when, _, design, _ in robot.changes if design == "scan_slow"]
    assert 1 <= len(back) <= 6, "600 s, in which it could have changed 120 times"


def test_stale_levels_say_nothing_of_the_end_of_a_cause(robot):
    robot = robot().start("scan_slow").run(10, 1.0).run(10, 2.2)
    robot.core.observe_stale("safety")
    for second in range(60):
        assert robot.core.step(robot.now + second, heartbeat=True) == []
