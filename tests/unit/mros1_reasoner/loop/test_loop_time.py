"""A clock that is set back, by a simulation's reset or a bag that is played again, holds nothing up."""

import math
from dataclasses import replace

import pytest
from metacontrol_bags.decision import DECIDED, Cause, Decision
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.loop_time import LoopTime
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings


@pytest.fixture
def loop(knowledge_base):
    reasoner = RuleEngine()
    reasoner.load(knowledge_base.ontology)
    return Mape(knowledge_base, reasoner, [Objective("o_move", "f_move", {"safety": 0.8, "energy": 0.75})], Settings())


def run(core, begin, end, energy):
    """Let ROS time pass; carry out and return what is decided, with its time."""
    decided, now = [], begin
    while now < end:
        now += 0.5
        core.observe_level(now, "energy", energy, stamp=now)
        for decision in core.step(now, heartbeat=True):
            if decision.state == DECIDED:
                decided.append((now, decision))
                executed = core.report(now, decision.id, True)
                assert begin - 1.0 <= decision.stamp_planned <= executed.stamp_executed <= now
    return decided


@pytest.mark.parametrize("back", [0.0, 20.0, 300.0, 600.0])
def test_limit_that_is_violated_after_the_clock_was_set_back_counts_as_soon_as_ever(loop, back):
    loop.observe_active(0.0, "f_move", "scan_fast", "STABLE")
    assert run(loop, 0.0, 600.0, 0.6) == []
    loop.observe_component(600.0, "laser", "FALSE")
    assert len(run(loop, 600.0, 600.5, 0.6)) == 1
    loop.observe_component(600.5, "laser", "TRUE")
    begin = 600.5 - back
    first, _ = run(loop, begin, begin + 30.0, 0.9)[0]
    assert first - begin < 10.0
    due = loop.due(begin + 30.0)
    assert due is None or abs(due - begin) < 1000.0


def test_first_design_is_deployed_although_the_clock_is_set_back_meanwhile(loop):
    assert run(loop, 1000.0, 1001.0, 0.1) == []
    ((first, _), *_) = run(loop, 0.0, 100.0, 0.1)
    assert first < 50.0


def test_small_steps_back_are_those_of_messages_on_their_way():
    time = LoopTime()
    assert [time.take(now) for now in (10.0, 9.5, 10.0)] == [10.0, 9.5, 10.0]
    assert (time.of(9.0), time.ros(9.0)) == (9.0, 9.0)


def test_time_goes_on_where_the_clock_is_set_back():
    time = LoopTime()
    assert [time.take(now) for now in (1000.0, 5.0, 6.0, 2.0, 2000.0)] == [1000.0, 1000.0, 1001.0, 1001.0, 2999.0]
    assert time.of(1999.0) == 2998.0
    assert time.of(2990.0) == 2999.0  # a stamp of before
    assert time.of(0.0) == 0.0
    decision = Decision("d", DECIDED, "o", "t", "from", "to", stamp_planned=2999.0, reasons=(Cause(2998.0, "t", "x"),))
    assert time.told(decision) == replace(decision, stamp_planned=2000.0, reasons=(Cause(1999.0, "t", "x"),))


@pytest.mark.parametrize(("stamp", "loops"), [(-1.0, 0.0), (4294967295.0 + 4294967295e-9, math.nextafter(2.0**32, 0))])
def test_stamp_that_no_message_can_hold_becomes_the_nearest_one(stamp, loops):
    time = LoopTime()
    time.take(10.0)
    assert time.of(stamp) == loops
