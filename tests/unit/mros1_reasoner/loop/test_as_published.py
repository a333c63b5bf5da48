"""The profile of the published reasoner: what it does, with all its defects."""

from pathlib import Path

import pytest
import yaml
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import DESIGNS, OBJECTIVE, application

PROFILE = Path(__file__).parents[4] / "catkin_ws/src/mros1_reasoner/config/as_published.yaml"
LEVELS = {"safety": 0.3, "energy": 0.9, "performance": 0.9}
"""Of a design that keeps the last limit, safety, and violates the other one."""
HUNGRY = {**DESIGNS, "scan_hungry": (LEVELS, ["laser", "base"])}


@pytest.fixture
def start(load, reasoner, tmp_path):
    """Return a function that makes a loop of a model, in which scan_slow runs."""

    def make(designs=DESIGNS, **changes):
        base = load(application(designs))
        reasoner.load(base.ontology)
        settings = Parameters({**yaml.safe_load(PROFILE.read_text()), **changes}).settings(base)
        core = Mape(base, reasoner, [OBJECTIVE], settings)
        core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
        assert core.step(0.0) == []
        return core

    return make


def deploy(core, now, decision):
    core.report(now, decision.id, True)
    return decision.to_configuration


def violated(core, now, quality="energy"):
    """What is decided on one level over its limit."""
    core.observe_level(now, quality, 0.9)
    return core.step(now)


def test_every_parameter_of_the_profile_is_a_setting():
    assert set(yaml.safe_load(PROFILE.read_text())) <= set(Settings.__dataclass_fields__)


def test_single_level_over_the_limit_counts_also_right_after_a_change(start):
    core = start()
    (first,) = violated(core, 1.0)
    assert deploy(core, 1.1, first) == "scan_slower"
    (second,) = violated(core, 1.2)
    assert second.trigger == "qa:energy" and second.stamp_monitored == 1.2


def test_only_the_last_limit_counts_in_the_choice(start):
    (decision,) = violated(start(HUNGRY), 1.0)
    assert decision.to_configuration == "scan_hungry"
    (decision,) = violated(start(HUNGRY, only_last_limit=False), 1.0)
    assert decision.to_configuration == "scan_slower"


def test_observed_levels_correct_nothing(start):
    core = start()
    core.observe_level(1.0, "safety", 0.61)  # twice what is expected; twice the expected one of the others is above 0.6
    (decision,) = core.step(1.0)
    assert decision.to_configuration == "scan_slower" and decision.corrections == ()


def test_design_that_failed_never_comes_back_and_then_nothing_is_done(start):
    core, seen = start(), []
    for number in range(6):
        now = 1000.0 * (number + 1)
        (decision,) = violated(core, now)
        if not decision.to_configuration:
            break
        seen.append(deploy(core, now + 1.0, decision))
    assert seen == ["scan_slower", "camera_slow", "camera_slower"]
    assert "stays with camera_slower: nothing is done: " in decision.explanation
    assert not any(candidate.chosen for candidate in decision.candidates)


def test_nothing_is_done_where_no_design_keeps_the_limit(start):
    core = start({name: entry for name, entry in DESIGNS.items() if name in ("scan_slow", "camera_fast")})
    core.observe_component(1.0, "laser", "FALSE")
    (decision,) = core.step(1.0)
    assert decision.to_configuration == "" and "camera_fast would be a makeshift" in decision.explanation


def test_component_that_works_again_is_a_reason_to_choose_anew(start):
    core = start()
    core.observe_component(1.0, "laser", "FALSE")
    (decision,) = core.step(1.0)
    assert deploy(core, 2.0, decision) == "camera_slow"
    core.observe_component(9.0, "laser", "RECOVERED")
    (decision,) = core.step(9.0)
    assert deploy(core, 9.5, decision) == "scan_slow"
    assert [core.step(now) for now in (20.0, 500.0)] == [[], []]


def test_end_of_the_cause_of_a_violation_is_no_way_back(start):
    core = start()
    (decision,) = violated(core, 1.0)
    assert deploy(core, 1.1, decision) == "scan_slower"
    for second in range(2, 300):
        core.observe_level(float(second), "energy", 0.1)
        assert core.step(float(second)) == []
