"""What fails is repaired before another design is taken, or beside it, by what each is expected to lose."""

from itertools import pairwise

import pytest
from metacontrol_bags.decision import ADVISED, DECIDED, EXECUTED, FAILED, PROPOSED
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from ontology_text import APP, assertion, typed

SETTINGS = Settings(history=1, violation_window=0.0, cool_down=0.5)
# A filling station: pouring needs a valve and a scale, pumping a motor, ladling nothing.
LEVELS = {"pour": 0.9, "pump": 0.6, "ladle": 0.1}
NEEDS = {"pour": ("valve", "scale"), "pump": ("motor",), "ladle": ()}
SLOW, QUICK = (20.0, 0.9, 2), (1.0, 0.9, 2)


def model(repairs, designs):
    text = typed(APP + "f_fill", v.FUNCTION) + typed(APP + "performance", v.QA_TYPE)
    text += assertion(APP + "performance", v.QA_SIGN, "-1", v.XSD + "decimal")
    for component in ("valve", "scale", "motor"):
        text += typed(APP + component, v.COMPONENT)
    for design in designs:
        value = f"{APP}{design}_performance"
        text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_fill")
        text += typed(value, v.QA_VALUE) + assertion(APP + design, v.HAS_QA_ESTIMATION, value)
        text += assertion(value, v.IS_QA_TYPE, APP + "performance")
        text += assertion(value, v.HAS_VALUE, LEVELS[design], v.XSD + "decimal")
        for component in NEEDS[design]:
            text += assertion(APP + component, v.REQUIRED_BY, APP + design)
    for component, numbers in repairs.items():
        iri = f"{APP}repair_of_{component}"
        text += typed(iri, v.REPAIR) + assertion(iri, v.REPAIRS, APP + component)
        for link, number in zip((v.REPAIR_DURATION, v.REPAIR_SUCCESS, v.REPAIR_ATTEMPTS), numbers, strict=True):
            text += assertion(iri, link, number, v.XSD + "decimal")
    return text


@pytest.fixture
def loop(tmp_path):
    """Return a function that makes a loop in which pouring runs."""

    def make(running="pour", designs=tuple(LEVELS), limits=None, repairable=None, **settings):
        (tmp_path / "station.owl").write_text(model({"valve": QUICK} if repairable is None else repairable, designs))
        knowledge_base = read_knowledge_base([tmp_path / "station.owl"], utility="performance")
        reasoner = RuleEngine()
        reasoner.load(knowledge_base.ontology)
        objective = Objective("o_fill", "f_fill", limits or {})
        core = Mape(knowledge_base, reasoner, [objective], Settings(**{**vars(SETTINGS), **settings}))
        if running:
            core.observe_active(0.0, "f_fill", running, "RUNNING")
            core.step(0.0)
        return core

    return make


def test_quick_repair_comes_first(loop):
    core = loop()
    core.observe_component(10.0, "valve", "FALSE")
    (decision,) = core.step(10.0)
    assert (decision.state, decision.repair) == (DECIDED, "valve")
    assert decision.from_configuration == decision.to_configuration == "pour"
    assert "valve is repaired first (1 s, succeeds in 90%): expected loss" in decision.explanation
    assert "of a change to pump" in decision.explanation
    assert "attempt 1 of 2" in decision.explanation
    assert not any(candidate.chosen for candidate in decision.candidates)
    assert all(candidate.lost_because for candidate in decision.candidates)


def test_levels_of_the_time_without_the_component_lead_to_no_change(loop):
    core = loop(limits={"performance": 0.5}, history=5, violation_window=2.0, cool_down=1.0)
    for now in range(10):
        core.observe_level(now, "performance", 0.9)
    core.observe_component(10.0, "valve", "FALSE")
    (repair,) = core.step(10.0)
    core.observe_level(10.5, "performance", 0.4)
    core.observe_level(11.0, "performance", 0.1)
    core.observe_component(11.1, "valve", "TRUE")
    assert [d.id for d in core.step(11.1)] == [repair.id]
    core.observe_level(11.5, "performance", 0.3)  # it fills up again
    seconds = [12.0 + 0.5 * number for number in range(20)]
    decided = []
    for now in seconds:
        core.observe_level(now, "performance", 0.9)
        decided += core.step(now, heartbeat=True)
    assert decided == []


def test_nothing_else_is_decided_while_the_repair_goes_on(loop):
    core = loop()
    core.observe_component(10.0, "valve", "FALSE")
    core.step(10.0)
    assert [d for t in (10.1, 10.5, 11.0) for d in core.step(t, heartbeat=True)] == []


def test_repair_has_succeeded_when_the_component_works_again(loop):
    core = loop()
    core.observe_component(10.0, "valve", "FALSE")
    (decision,) = core.step(10.0)
    assert core.report(10.8, decision.id, ok=True) is None  # what the manipulator does may not help
    core.observe_component(11.0, "valve", "TRUE")
    (outcome,) = core.step(11.0)
    assert (outcome.id, outcome.state, outcome.stamp_executed) == (decision.id, EXECUTED, 11.0)
    assert outcome.explanation.endswith("; valve works again")
    assert [d for t in (11.0, 12.0) for d in core.step(t, heartbeat=True)] == []


def test_slow_repair_goes_on_beside_another_design(loop):
    core = loop(repairable={"valve": SLOW})
    core.observe_component(10.0, "valve", "FALSE")
    (change,) = core.step(10.0)
    assert (change.to_configuration, change.repair) == ("pump", "")
    assert "a repair of valve first (20 s, succeeds in 90%) has an expected loss of" in change.explanation
    core.report(11.0, change.id, ok=True)
    (repair,) = core.step(11.0)
    assert (repair.repair, repair.to_configuration) == ("valve", "pump")
    assert "valve is repaired (attempt 1 of 2) while pump runs" in repair.explanation
    core.observe_component(30.0, "valve", "TRUE")
    assert [d.state for d in core.step(30.0)] == [EXECUTED]
    assert core.step(30.1)[0].to_configuration == "pour"


def test_change_follows_a_repair_that_fails(loop):
    core = loop(repairable={"valve": (1.0, 0.9, 1)})
    core.observe_component(10.0, "valve", "FALSE")
    (repair,) = core.step(10.0)
    outcome = core.report(10.5, repair.id, ok=False, message="valve/reset: jammed")
    assert outcome.state == FAILED
    assert outcome.explanation.endswith("; failed: valve/reset: jammed")
    (change,) = core.step(10.5)
    assert change.to_configuration == "pump"
    core.report(11.5, change.id, ok=True)
    assert [d for t in range(12, 200) for d in core.step(float(t), heartbeat=True)] == []  # no attempt is left


def test_repair_that_could_not_be_tried_uses_no_attempt_and_is_asked_for_more_and_more_rarely(loop):
    core = loop(designs=("pour",), repairable={"valve": (1.0, 0.9, 1)})
    core.observe_component(10.0, "valve", "FALSE")
    now, asked = 10.0, []
    while now < 100.0:
        for decision in core.step(now, heartbeat=True):
            if decision.state == DECIDED:
                asked.append(now)
                assert "attempt 1 of 1" in decision.explanation
                core.report(now, decision.id, ok=False, message="it is being repaired already", blame=False)
        now += 0.5
    waits = [later - earlier for earlier, later in pairwise(asked)]
    assert len(waits) > 3 and waits == sorted(waits) and waits[-1] > 4.0 * waits[0]


def test_repair_without_effect_has_failed_after_a_while(loop):
    core = loop(repairable={"valve": (1.0, 0.9, 1)})
    core.observe_component(10.0, "valve", "FALSE")
    (repair,) = core.step(10.0)
    core.report(10.5, repair.id, ok=True)
    due = core.due(10.5)
    assert core.step(due - 0.1) == []
    (outcome,) = core.step(due)
    assert outcome.state == FAILED
    assert "valve does not work after" in outcome.explanation
    assert core.step(due)[0].to_configuration == "pump"


def test_attempts_follow_each_other_where_there_is_nothing_else(loop):
    core = loop(designs=("pour",), repairable={"valve": (5.0, 0.5, 3)})
    core.observe_component(10.0, "valve", "FALSE")
    now, seen = 10.0, []
    while now < 100.0:
        for decision in core.step(now, heartbeat=True):
            seen.append((decision.state, decision.repair))
            if decision.state == DECIDED:
                core.report(now, decision.id, ok=False, message="no")
        now += 0.5
    assert [state for state, repair in seen if repair] == [DECIDED] * 3
    assert seen[-1] == (FAILED, "")  # no design can be deployed without valve
    core.observe_component(100.0, "valve", "TRUE")  # somebody has repaired it
    core.step(100.0)
    core.observe_component(200.0, "valve", "FALSE")
    assert core.step(200.0)[0].repair == "valve"


def test_component_that_fails_again_soon_is_not_repaired_for_ever(loop):
    core, repaired = loop(), 0
    for start in range(10, 60, 5):
        core.observe_component(start, "valve", "FALSE")
        for decision in core.step(float(start)):
            repaired += bool(decision.repair)
            if not decision.repair:
                core.report(start + 0.5, decision.id, ok=True)
        core.observe_component(start + 1.0, "valve", "TRUE")
        core.step(start + 1.0)
    assert repaired == 2


def test_share_of_success_follows_what_was_seen(loop):
    core = loop(repairable={"valve": (3.0, 0.9, 5)}, backoff=0.0)
    core.observe_component(10.0, "valve", "FALSE")
    texts = []
    for now in (10.0, 11.0, 12.0, 13.0):
        decision = core.step(now)[0]
        texts.append(decision.explanation)
        if not decision.repair:
            break
        core.report(now + 0.5, decision.id, ok=False)
    assert "succeeds in 90%" in texts[0]
    assert "succeeds in 60%" in texts[1]
    assert "pump" in core.pending.to_configuration  # a repair that keeps failing is not worth the wait


def test_two_components_are_repaired_at_the_same_time(loop):
    core = loop(repairable={"valve": QUICK, "scale": QUICK})
    core.observe_component(10.0, "valve", "FALSE")
    core.observe_component(10.0, "scale", "FALSE")
    first = core.step(10.0)
    second = core.step(10.0)
    assert [d.repair for d in (*first, *second)] == ["scale", "valve"]
    core.observe_component(11.0, "valve", "TRUE")
    core.observe_component(11.0, "scale", "TRUE")
    assert [d.state for d in core.step(11.0)] == [EXECUTED, EXECUTED]


def test_component_that_can_not_be_repaired_makes_a_change_necessary(loop):
    core = loop()
    core.observe_component(10.0, "valve", "FALSE")
    core.observe_component(10.0, "scale", "FALSE")
    assert core.step(10.0)[0].to_configuration == "pump"


def test_design_whose_limit_is_violated_too_is_replaced(loop):
    core = loop(limits={"performance": 0.5}, level_timeout=1000.0)
    core.observe_component(10.0, "valve", "FALSE")
    core.observe_level(10.0, "performance", 0.2)
    decision = core.step(10.0)[0]
    assert (decision.repair, decision.to_configuration) == ("", "pump")


def test_limit_that_is_violated_during_a_repair_counts(loop):
    core = loop(limits={"performance": 0.5}, level_timeout=1000.0)
    core.observe_component(10.0, "valve", "FALSE")
    assert core.step(10.0)[0].repair == "valve"
    core.observe_level(10.5, "performance", 0.2)
    assert core.step(10.5)[0].to_configuration == "pump"


def test_makeshift_is_no_alternative(loop):
    core = loop(limits={"performance": 0.7}, repairable={"valve": SLOW})
    core.observe_component(10.0, "valve", "FALSE")
    assert core.step(10.0)[0].repair == "valve"  # pumping would not keep the limit


def test_what_runs_first_may_need_a_repair(loop):
    core = loop(running="", designs=("pour",), start_grace=0.0)
    core.observe_component(1.0, "valve", "FALSE")
    found = [decision for now in (1.0, 1.1, 1.2) for decision in core.step(now)]
    assert [decision.repair for decision in found if decision.state == DECIDED] == ["valve"]
    core.observe_component(2.0, "valve", "TRUE")
    found = [decision for now in (2.0, 2.1, 2.2) for decision in core.step(now)]
    assert [d.to_configuration for d in found if d.state == DECIDED] == ["pour"]


def test_operator_approves_a_repair(loop):
    core = loop(approval=True)
    core.observe_component(10.0, "valve", "FALSE")
    (proposal,) = core.step(10.0)
    assert (proposal.state, proposal.repair) == (PROPOSED, "valve")
    assert core.step(10.5, heartbeat=True) == []
    assert core.operator.approve(proposal.id, 11.0).state == DECIDED
    core.observe_component(12.0, "valve", "TRUE")
    assert [d.state for d in core.step(12.0)] == [EXECUTED]


def test_rejected_repair_makes_way_for_a_change(loop):
    core = loop(approval=True)
    core.observe_component(10.0, "valve", "FALSE")
    (proposal,) = core.step(10.0)
    assert core.operator.reject(proposal.id, 11.0).state == FAILED
    assert core.step(11.0)[0].to_configuration == "pump"


def test_dry_run_advises_a_repair_once(loop):
    core = loop(dry_run=True)
    core.observe_component(10.0, "valve", "FALSE")
    found = [decision for now in (10.0, 11.0, 12.0) for decision in core.step(now, heartbeat=True)]
    assert [(decision.state, decision.repair) for decision in found] == [(ADVISED, "valve")]


def test_repairs_can_be_switched_off(loop):
    core = loop(repairs=False)
    core.observe_component(10.0, "valve", "FALSE")
    assert core.step(10.0)[0].to_configuration == "pump"
    assert core.step(10.0) == []


def test_locked_objective_is_repaired(loop):
    core = loop(repairable={"valve": SLOW})
    core.operator.lock("o_fill")
    core.observe_component(10.0, "valve", "FALSE")
    assert core.step(10.0)[0].repair == "valve"


def test_missing_manipulator_uses_up_no_attempt(loop):
    core = loop(designs=("pour",), repairable={"valve": (1.0, 0.9, 1)})
    core.observe_component(10.0, "valve", "FALSE")
    (repair,) = core.step(10.0)
    core.report(10.5, repair.id, ok=False, message="not there", blame=False)
    found = [decision for tick in range(21, 60) for decision in core.step(tick / 2)]
    assert [decision.repair for decision in found if decision.state == DECIDED] == ["valve"]
