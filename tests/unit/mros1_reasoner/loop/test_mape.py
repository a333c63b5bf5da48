import itertools
import math
from dataclasses import replace

import pytest
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import DESIGNS, OBJECTIVE, application


class Counting:
    """Passes calls on to a reasoner and counts the analyses."""

    def __init__(self, reasoner):
        self.reasoner, self.count, self.error = reasoner, 0, None

    def infer(self, facts, properties):
        self.count += 1
        if self.error:
            raise self.error
        return self.reasoner.infer(facts, properties)


@pytest.fixture
def counting(reasoner):
    return Counting(reasoner)


@pytest.fixture
def core(knowledge_base, counting):
    """A loop in which scan_slow runs."""
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings())
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    assert core.step(0.0) == []
    return core


def violate(core, start, end):
    """Report a level every half second and step; return (time, decision) of what was decided."""
    found, period = [], 0.5
    for i in range(math.floor((end - start) / period) + 1):
        now = start + i * period
        core.observe_level(now, "safety", 0.9)
        found += [(now, decision) for decision in core.step(now)]
    return found


def fail(core, now, *components):
    for component in components:
        core.observe_component(now, component, "FALSE", stamp=now - 0.1)
    return core.step(now)


def test_killed_laser_takes_the_camera_design_of_highest_utility_that_keeps_the_limits(core):
    (decision,) = fail(core, 1.0, "laser")
    assert decision.to_configuration == "camera_slow"
    assert decision.from_configuration == "scan_slow"
    assert decision.trigger == "component:laser"
    assert decision.state == DECIDED
    assert decision.stamp_monitored == pytest.approx(0.9)
    assert not decision.degraded
    refused = {c.name: c.refused_because for c in decision.candidates}
    assert refused["scan_slower"] == "requires laser, which does not work"
    assert refused["camera_fast"] == "energy 0.7 > 0.62; safety 0.7 > 0.6"
    assert refused["camera_slower"] == ""
    assert len(refused) == len(DESIGNS)


def test_no_facts_no_analysis(core, counting):
    before = counting.count
    for i in range(10):
        core.observe_level(1.0 + i / 10, "safety", 0.3 + i / 100)
        core.step(1.0 + i / 10)
    assert counting.count == before + 1  # the first level is new, the others stay on the same side of the limit


def test_violation_counts_once_most_of_the_last_levels_tell_it(core):
    ((when, decision),) = violate(core, 1.0, 3.5)
    assert when == pytest.approx(2.0)  # the third of five
    assert decision.trigger == "qa:safety"
    assert decision.stamp_monitored == pytest.approx(1.0)
    assert decision.to_configuration == "scan_slower"  # the most useful one but for the one that violates


def test_violation_holds_between_ticks(core):
    core.observe_level(1.0, "safety", 0.9)
    assert core.step(1.0) == []
    assert core.due(1.0) == pytest.approx(3.0)
    assert core.step(3.0)[0].trigger == "qa:safety"


def test_single_bad_level_among_good_ones_does_not_count(core):
    for i in range(50):
        core.observe_level(float(i), "safety", 0.9 if i % 4 == 3 else 0.3)
        assert core.step(float(i)) == []


def test_every_other_level_over_the_limit_counts(core):
    """A window in which the limit is violated without a break would never be filled."""
    found = []
    for i in range(10):
        core.observe_level(float(i), "safety", 0.58 if i % 2 else 0.75)
        found += core.step(float(i))
    assert len(found) == 1
    assert found[0].trigger == "qa:safety"


def test_level_that_is_too_old_counts_no_more(core):
    core.observe_level(1.0, "safety", 0.9)
    core.step(1.0)
    assert core.step(20.0) == []


def test_stale_quality_is_not_known(core):
    assert violate(core, 1.0, 1.5) == []
    core.observe_stale("safety")
    assert core.step(4.0) == []


def test_cool_down_holds_for_qualities(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(cool_down=5.0))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    ((when, decision),) = violate(core, 1.0, 2.0)
    core.report(when + 0.5, decision.id, True)
    ((again, _),) = violate(core, 3.0, 8.0)
    assert again == pytest.approx(when + 0.5 + 5.0)


def test_cool_down_does_not_hold_for_components(core):
    ((when, decision),) = violate(core, 1.0, 2.0)
    core.report(when + 0.5, decision.id, True)
    (second,) = fail(core, when + 0.6, "laser")
    assert second.to_configuration == "camera_slow"


def test_one_request_at_a_time(core):
    (first,) = fail(core, 1.0, "laser")
    assert fail(core, 1.5, "camera") == []
    assert core.pending == first
    executed = core.report(2.0, first.id, True)
    assert (executed.state, executed.id, executed.stamp_executed) == (EXECUTED, first.id, 2.0)
    (refusal,) = core.step(2.0)
    assert refusal.state == FAILED
    assert refusal.to_configuration == ""


def test_failed_reconfiguration_is_logged_and_another_tried_after_the_back_off(core):
    (first,) = fail(core, 1.0, "laser")
    failed = core.report(2.0, first.id, False, "it did not come up")
    assert failed.state == FAILED
    assert "it did not come up" in failed.explanation
    assert core.step(2.5) == []
    (second,) = core.step(core.due(2.5))
    assert second.to_configuration == "camera_slower"
    refused = {c.name: c.refused_because for c in second.candidates}
    assert "could not be deployed (it did not come up)" in refused["camera_slow"]


def test_failure_that_is_not_the_designs_own_is_tried_again(core):
    (first,) = fail(core, 1.0, "laser")
    core.report(2.0, first.id, False, "no manipulator", blame=False)
    (second,) = core.step(3.0)
    assert second.to_configuration == first.to_configuration
    core.report(3.0, second.id, False, "no manipulator", blame=False)
    assert core.step(4.0) == []  # the back-off has doubled
    assert core.step(5.0)


def test_entries_of_the_error_log_expire(core):
    (first,) = fail(core, 1.0, "laser")
    core.report(2.0, first.id, False)
    (second,) = core.step(3.0)
    core.report(3.5, second.id, False, blame=False)
    (third,) = core.step(70.0)
    assert third.to_configuration == "camera_slow"


def test_degraded_design_is_taken_and_left_when_the_component_returns(core):
    core.objectives["o_move"] = Objective("o_move", "f_move", {"safety": 0.25})
    (decision,) = fail(core, 1.0, "laser")
    assert decision.degraded
    assert decision.to_configuration == "camera_slow"
    core.report(2.0, decision.id, True)
    core.observe_component(10.0, "laser", "RECOVERED")
    (second,) = core.step(10.0)
    assert second.to_configuration == "scan_slower"
    assert second.trigger == "component:laser"
    assert not second.degraded


def test_return_of_a_component_changes_nothing_that_works_where_that_is_not_wanted(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(always_improve=False))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    (decision,) = fail(core, 1.0, "laser")
    core.report(2.0, decision.id, True)
    core.observe_component(10.0, "laser", "RECOVERED")
    assert core.step(10.0) == []
    assert core.step(10.1) == []
    assert core.facts.components["laser"] == "TRUE"


def test_return_of_a_component_is_used_where_the_setting_says_so(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(always_improve=True))
    core.observe_active(0.0, "f_move", "camera_slow", "STABLE")
    core.observe_component(1.0, "laser", "FALSE")
    assert core.step(1.0) == []
    core.observe_component(2.0, "laser", "TRUE")
    (decision,) = core.step(2.0)
    assert decision.to_configuration == "scan_slow"


def test_where_nothing_can_be_done_it_is_said_once(core):
    (refusal,) = fail(core, 1.0, "base")
    assert refusal.state == FAILED
    assert refusal.to_configuration == ""
    assert "no design can be deployed without base" in refusal.explanation
    core.observe_component(2.0, "camera", "FALSE")
    assert core.step(2.0) == []
    core.observe_component(3.0, "camera", "TRUE")
    core.observe_component(3.0, "base", "TRUE")
    core.step(3.0)
    assert core.step(3.1) == []
    assert len(fail(core, 4.0, "base")) == 1


def test_causes_at_once_are_all_told_and_the_first_is_the_trigger(core):
    violate(core, 1.0, 1.5)
    core.observe_level(2.2, "safety", 0.9)
    (decision,) = fail(core, 2.2, "laser")
    assert decision.trigger == "qa:safety"
    assert len(decision.causes) == 2
    assert "component laser" in decision.causes[1]


HAPPENINGS = {
    "safety too high": "qa:safety",
    "laser fails": "component:laser",
    "base fails": "component:base",
    "camera recovers": "component:camera",
    "configuration fails": "component:scan_slow",
    "task fails": "task:o_move",
}


def let_happen(core, happening, now):
    match happening:
        case "safety too high":
            core.observe_level(now, "safety", 0.9, stamp=now - 3.0)
        case "laser fails" | "base fails":
            core.observe_component(now, happening.split()[0], "FALSE")
        case "camera recovers":
            core.observe_component(now, "camera", "FALSE")
            core.observe_component(now, "camera", "TRUE")
        case "configuration fails":
            core.observe_active(now, "f_move", "scan_slow", "FAILED")
        case "task fails":
            core.observe_task(now, "o_move", True, message="goal aborted")


@pytest.mark.parametrize("count", [2, 3])
def test_whatever_happens_at_once_is_told_in_one_decision(knowledge_base, counting, count):
    for happenings in itertools.combinations(HAPPENINGS, count):
        core = Mape(knowledge_base, counting, [OBJECTIVE], Settings())
        core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
        core.step(0.0)
        for happening in happenings:
            let_happen(core, happening, 10.0)
        (decision,) = core.step(10.0)
        assert {cause.trigger for cause in decision.reasons} == {HAPPENINGS[happening] for happening in happenings}
        assert len(decision.causes) == count
        assert decision.trigger != "component:camera", "a recovery does not call for a change where something is wrong"


def test_objective_may_want_what_the_settings_do_not(knowledge_base, counting):
    for asks, settings, expected in ((True, False, 1), (False, True, 0), (None, False, 0), (None, True, 1)):
        objective = replace(OBJECTIVE, always_improve=asks)
        core = Mape(knowledge_base, counting, [objective], Settings(always_improve=settings))
        core.observe_active(0.0, "f_move", "camera_slow", "STABLE")
        core.observe_component(1.0, "laser", "FALSE")
        core.step(1.0)
        core.observe_component(2.0, "laser", "TRUE")
        assert len(core.step(2.0)) == expected


def test_improvement_waits_for_the_cool_down(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(always_improve=True, cool_down=5.0))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    (decision,) = fail(core, 1.0, "laser")
    core.report(2.0, decision.id, True)
    core.observe_component(3.0, "laser", "TRUE")
    assert core.step(3.0) == []
    (second,) = core.step(core.due(3.0))
    assert (second.to_configuration, second.stamp_analysed) == ("scan_slow", 2.0 + 5.0)


def test_limits_that_the_operator_raises_are_used_where_improving_is_wanted(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(always_improve=True))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    core.step(0.0)
    core.operator.set_nfr("o_move", "safety", 0.9)
    core.operator.set_nfr("o_move", "energy", 0.9)
    (decision,) = core.step(1.0)
    assert (decision.trigger, decision.to_configuration) == ("operator", "scan_fast")


def test_running_configuration_is_taken_over_without_a_request(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(desired="scan_slow"))
    assert core.step(0.0) == []
    core.observe_active(1.0, "f_move", "camera_slow", "STABLE")
    assert core.step(100.0) == []
    assert core.facts.groundings == {"o_move": "camera_slow"}


def test_without_a_running_configuration_one_is_asked_for_after_the_grace(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(start_grace=15.0))
    assert core.step(0.0) == []
    assert core.due(0.0) == 15.0
    (decision,) = core.step(15.0)
    assert (decision.trigger, decision.from_configuration, decision.to_configuration) == ("initial", "", "scan_slow")


def test_desired_configuration_is_asked_for_first(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(start_grace=0.0, desired="scan_slower"))
    assert core.step(0.0)[0].to_configuration == "scan_slower"


@pytest.mark.parametrize("state", ["RECONFIGURING", "RECOVERING"])
def test_while_the_manipulator_is_busy_nothing_is_asked(core, state):
    core.observe_active(1.0, "f_move", "scan_slow", state)
    assert fail(core, 1.5, "laser") == []
    core.observe_active(2.0, "f_move", "scan_slow", "STABLE")
    assert core.step(2.0)[0].to_configuration == "camera_slow"


def test_levels_while_nodes_come_back_do_not_count(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(cool_down=5.0))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    core.observe_active(1.0, "f_move", "scan_slow", "RECOVERING")
    assert violate(core, 1.0, 3.0) == []
    core.observe_active(3.0, "f_move", "scan_slow", "STABLE")
    ((when, _),) = violate(core, 3.0, 10.0)
    assert when == pytest.approx(3.0 + 5.0)


def test_manipulator_that_stays_busy_is_waited_for_only_so_long(core):
    core.observe_active(1.0, "f_move", "scan_slow", "RECONFIGURING")
    assert fail(core, 1.5, "laser") == []
    assert core.step(1.0 + Settings().busy_limit)


def test_first_deployment_that_vanishes_while_it_is_made_keeps_nothing_busy(knowledge_base, counting):
    core = Mape(knowledge_base, counting, [OBJECTIVE], Settings(start_grace=0.0))
    (decision,) = core.step(0.0)
    core.observe_active(1.0, "f_move", decision.to_configuration, "RECONFIGURING")
    core.observe_active(3.0, "f_move", "", "")
    core.report(3.1, decision.id, False, "lost", blame=False)
    (again,) = core.step(10.0)
    assert again.state == DECIDED
    core.observe_active(50.0, "f_move", decision.to_configuration, "RECONFIGURING")
    assert core.view.running["o_move"].busy_since == 50.0


def test_failed_configuration_is_replaced(core):
    core.observe_active(1.0, "f_move", "scan_slow", "FAILED")
    (decision,) = core.step(1.0)
    assert decision.trigger == "component:scan_slow"
    assert (decision.state, decision.to_configuration) == (DECIDED, "scan_slower")


def test_after_failed_configurations_a_degraded_one_is_better_than_none(core):
    core.observe_active(1.0, "f_move", "scan_slow", "FAILED")
    (first,) = fail(core, 1.0, "camera")
    core.report(2.0, first.id, False)
    core.observe_active(2.0, "f_move", "scan_slower", "FAILED")
    (second,) = core.step(3.0)
    assert (second.from_configuration, second.to_configuration, second.degraded) == ("scan_slower", "scan_fast", True)


def test_change_by_somebody_else_is_taken_over(core):
    core.observe_active(1.0, "f_move", "camera_slow", "RECONFIGURING")
    core.observe_active(2.0, "f_move", "camera_slow", "STABLE")
    assert fail(core, 3.0, "laser") == []
    assert core.facts.groundings == {"o_move": "camera_slow"}


@pytest.mark.parametrize("is_late", [False, True])
def test_change_that_is_taken_back_is_not_believed_for_an_answer_that_comes_late(core, is_late):
    (decision,) = fail(core, 1.0, "laser")
    assert decision.to_configuration == "camera_slow"
    core.observe_active(2.0, "f_move", "scan_slow", "RECONFIGURING")
    core.observe_active(3.0, "f_move", "camera_slow", "STABLE")
    if not is_late:
        core.report(3.0, decision.id, True)
    core.observe_active(3.1, "f_move", "scan_slow", "RECONFIGURING")
    core.observe_active(3.2, "f_move", "scan_slow", "STABLE")
    if is_late:
        core.report(3.3, decision.id, True)
    running = core.view.running["o_move"]
    assert (running.design, running.state) == ("scan_slow", "STABLE")
    assert core.view.active["f_move"] == ("scan_slow", "STABLE")
    assert "was taken back" in core.view.why_failed("o_move", "camera_slow")


def test_function_that_vanishes_runs_no_more_for_an_answer_that_comes_late(core):
    (decision,) = fail(core, 1.0, "laser")
    core.observe_active(3.0, "f_move", "camera_slow", "STABLE")
    core.observe_active(3.1, "f_move", "", "")
    core.report(3.3, decision.id, True)
    assert core.view.running["o_move"].design is None
    assert not core.active


def test_answer_is_believed_that_comes_before_the_state(core):
    (decision,) = fail(core, 1.0, "laser")
    core.observe_active(2.0, "f_move", "scan_slow", "STABLE")
    core.report(2.1, decision.id, True)
    assert core.view.running["o_move"].design == "camera_slow"


def test_objectives_are_served_one_after_the_other(knowledge_base, counting):
    objectives = [OBJECTIVE, Objective("o_other", "f_move", {"energy": 0.35})]
    core = Mape(knowledge_base, counting, objectives, Settings())
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    core.step(0.0)
    (first,) = fail(core, 1.0, "laser")
    core.report(2.0, first.id, True)
    (second,) = core.step(2.0)
    assert (first.objective, second.objective) == ("o_move", "o_other")
    assert (first.to_configuration, second.to_configuration) == ("camera_slow", "camera_slower")
    assert first.id != second.id


def test_level_of_a_named_grounding_is_of_that_one_only(knowledge_base, counting):
    objectives = [OBJECTIVE, Objective("o_other", "f_move", {"safety": 0.6})]
    core = Mape(knowledge_base, counting, objectives, Settings())
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    core.observe_level(1.0, "safety", 0.9, "fg_o_other_scan_slow")
    core.step(1.0)
    (decision,) = core.step(3.0)
    assert decision.objective == "o_other"


def test_binding_error_breaks_the_grounding(core):
    core.observe_binding(1.0, "fg_o_move_scan_slow", True)
    (decision,) = core.step(1.0)
    assert decision.trigger == "component:scan_slow"
    with pytest.raises(MapeError, match="no objective is grounded so"):
        core.observe_binding(1.0, "fg_nothing", True)


@pytest.mark.parametrize("level", [math.nan, math.inf, -math.inf])
def test_level_that_is_not_finite_is_refused(core, level):
    with pytest.raises(MapeError, match="not a finite number"):
        core.observe_level(1.0, "safety", level)


def test_unknown_names_are_refused(core):
    with pytest.raises(MapeError, match="Unsupported QA TYPE received: comfort"):
        core.observe_level(1.0, "comfort", 0.5)
    with pytest.raises(MapeError, match="component sonar is not in the model"):
        core.observe_component(1.0, "sonar", "FALSE")
    with pytest.raises(MapeError, match="unknown status 'MAYBE'"):
        core.observe_component(1.0, "laser", "MAYBE")
    with pytest.raises(MapeError, match="no FunctionDesign of f_move"):
        core.observe_active(1.0, "f_move", "unheard_of", "STABLE")
    with pytest.raises(MapeError, match="not under way"):
        core.report(1.0, "decision-9", True)


def test_analysis_that_fails_is_tried_again(core, counting):
    counting.error = ReasonerError("no")
    core.observe_component(1.0, "laser", "FALSE")
    with pytest.raises(ReasonerError):
        core.step(1.0)
    counting.error = None
    assert core.step(1.1)[0].to_configuration == "camera_slow"


def test_heartbeat_takes_new_levels_in(core, counting):
    core.observe_level(1.0, "safety", 0.3)
    core.step(1.0)
    core.observe_level(2.0, "safety", 0.4)
    before = counting.count
    core.step(2.0, heartbeat=True)
    core.step(2.1, heartbeat=True)
    assert counting.count == before + 1
    assert core.facts.levels["o_move", "safety"] == 0.4


def test_names_of_qualities_do_not_matter(load, pellet):
    text = application().replace("safety", "noise").replace("energy", "cost").replace("performance", "joy")
    knowledge_base = load(text)
    pellet.load(knowledge_base.ontology)
    core = Mape(knowledge_base, pellet, [Objective("o", "f_move", {"noise": 0.6})], Settings(utility="joy"))
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    core.observe_level(0.0, "noise", 0.9)
    core.step(0.0)
    (decision,) = core.step(2.0)
    assert decision.trigger == "qa:noise"
