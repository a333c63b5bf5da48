"""In a dry run the loop tells what it would do, once, and has nothing done."""

import pytest
from metacontrol_bags.decision import ADVISED, FAILED
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import OBJECTIVE


@pytest.fixture
def core(knowledge_base, reasoner):
    core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings(dry_run=True))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    assert core.step(0.0) == []
    return core


def test_advice_is_given_once_and_nothing_is_under_way(core):
    core.observe_component(1.0, "laser", "FALSE")
    (advice,) = core.step(1.0)
    assert (advice.state, advice.from_configuration, advice.to_configuration) == (ADVISED, "scan_slow", "camera_slow")
    assert core.pending is None
    assert core.step(2.0, heartbeat=True) == []


def test_other_causes_bring_other_advice(core):
    core.observe_component(1.0, "laser", "FALSE")
    core.step(1.0)
    core.observe_component(2.0, "camera", "FALSE")
    (refusal,) = core.step(2.0)
    assert (refusal.state, refusal.to_configuration) == (FAILED, "")
    core.observe_component(3.0, "camera", "TRUE")
    (advice,) = core.step(3.0)
    assert (advice.state, advice.to_configuration) == (ADVISED, "camera_slow")


def test_advice_is_given_again_after_the_cause_has_gone(core):
    for now, status, count in ((1.0, "FALSE", 1), (2.0, "TRUE", 0), (3.0, "FALSE", 1)):
        core.observe_component(now, "laser", status)
        assert len(core.step(now)) == count
