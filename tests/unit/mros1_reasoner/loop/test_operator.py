"""What an operator asks of the loop: pause, lock, approval, objectives, limits, what is feasible, saving."""

import math
from dataclasses import replace

import pytest
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED, PROPOSED
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import DESIGNS, OBJECTIVE


@pytest.fixture
def make(knowledge_base, reasoner):
    """Return a function that makes a loop in which scan_slow runs."""

    def make(**settings):
        core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings(**settings))
        core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
        assert core.step(0.0) == []
        return core

    return make


def fail(core, now, component):
    core.observe_component(now, component, "FALSE")
    return core.step(now)


def test_paused_loop_analyses_but_decides_nothing_until_resumed(make):
    core = make()
    core.operator.pause()
    assert fail(core, 1.0, "laser") == []
    assert core.analysis.objectives["o_move"].status == "IN_ERROR_COMPONENT"
    core.operator.resume()
    (decision,) = core.step(2.0)
    assert decision.to_configuration == "camera_slow"


def test_pause_lets_what_is_under_way_finish(make):
    core = make()
    (decision,) = fail(core, 1.0, "laser")
    core.operator.pause()
    assert core.report(2.0, decision.id, True).state == EXECUTED


def test_locked_objective_keeps_its_configuration_and_says_what_it_would_do(make):
    core = make()
    core.operator.lock()
    (refusal,) = fail(core, 1.0, "laser")
    assert (refusal.state, refusal.to_configuration) == (FAILED, "")
    assert "locked by the operator; camera_slow would be taken" in refusal.explanation
    core.operator.unlock()
    (decision,) = core.step(2.0)
    assert decision.to_configuration == "camera_slow"


def test_better_design_that_a_lock_has_kept_away_is_taken_afterwards(make):
    core = make(cool_down=0.0)
    core.report(2.0, fail(core, 1.0, "laser")[0].id, True)  # camera_slow runs
    core.operator.lock()
    core.observe_component(5.0, "laser", "TRUE")
    refused = [decision for now in (5.0, 6.0, 10.0) for decision in core.step(now)]
    assert {decision.state for decision in refused} == {FAILED}
    core.operator.unlock()
    decisions = [decision for now in (11.0, 20.0) for decision in core.step(now)]
    assert [decision.to_configuration for decision in decisions] == ["scan_slow"]
    assert "it may take another design again" in decisions[0].explanation


def test_lock_of_an_unknown_objective_is_refused(make):
    with pytest.raises(MapeError, match="no objective is called 'o_fly': known: o_move"):
        make().operator.lock("o_fly")


def test_proposal_waits_for_approval(make):
    core = make(approval=True)
    (proposal,) = fail(core, 1.0, "laser")
    assert (proposal.state, proposal.to_configuration) == (PROPOSED, "camera_slow")
    assert core.pending is None
    assert core.step(5.0) == []
    with pytest.raises(MapeError, match="does not wait for approval"):
        core.operator.approve("another", 5.0)
    decision = core.operator.approve(proposal.id, 5.0)
    assert (decision.state, decision.id) == (DECIDED, proposal.id)
    assert core.pending == decision
    assert core.report(6.0, decision.id, True).state == EXECUTED


def test_rejected_design_is_not_proposed_again_at_once(make):
    core = make(approval=True)
    (proposal,) = fail(core, 1.0, "laser")
    rejected = core.operator.reject(proposal.id, 2.0)
    assert (rejected.state, rejected.id) == (FAILED, proposal.id)
    assert "rejected by the operator" in rejected.explanation
    (second,) = core.step(2.0)
    assert second.to_configuration == "camera_slower"
    core.operator.reject(second.id, 3.0)
    (third,) = core.step(100.0)
    assert third.to_configuration == "camera_slow"


def test_rejected_design_is_not_proposed_again_at_once_where_no_other_is_left(make):
    core = make(approval=True)
    core.observe_component(1.0, "laser", "FALSE")
    designs = []
    for now in (1.0, 2.0, 3.0):
        (proposal,) = core.step(now)
        designs.append(proposal.to_configuration)
        core.operator.reject(proposal.id, now)
    assert designs == ["camera_slow", "camera_slower", "camera_fast"]
    (refusal,) = core.step(4.0)
    assert (refusal.state, refusal.to_configuration) == (FAILED, "")
    assert "the operator has rejected camera_fast and camera_slow and camera_slower" in refusal.explanation
    now, forgotten = 4.0, 61.0
    while (due := core.due(now)) and due < forgotten:
        assert core.step(due) == []
        now = due
    (again,) = core.step(due)
    assert (due, again.state, again.to_configuration) == (forgotten, PROPOSED, "camera_slow")


def test_proposal_is_withdrawn_when_its_cause_is_gone(make):
    core = make(approval=True)
    (proposal,) = fail(core, 1.0, "laser")
    core.observe_component(2.0, "laser", "TRUE")
    (withdrawn,) = core.step(2.0)
    assert (withdrawn.id, withdrawn.state) == (proposal.id, FAILED)
    assert "withdrawn" in withdrawn.explanation
    assert core.proposal is None


def test_proposal_is_withdrawn_when_its_objective_goes(make):
    core = make(approval=True)
    (proposal,) = fail(core, 1.0, "laser")
    core.operator.remove_objective("o_move")
    for answer in (core.operator.approve, core.operator.reject):
        with pytest.raises(MapeError, match="does not wait for approval"):
            answer(proposal.id, 2.0)
    (withdrawn,) = core.step(2.0)
    assert (withdrawn.id, withdrawn.state) == (proposal.id, FAILED)
    assert "withdrawn" in withdrawn.explanation
    assert core.proposal is None


def test_proposal_gives_way_to_a_better_one(make):
    core = make(approval=True)
    (proposal,) = fail(core, 1.0, "laser")
    core.operator.set_nfr("o_move", "energy", 0.35)
    withdrawn, second = core.step(2.0)
    assert (withdrawn.id, second.state, second.to_configuration) == (proposal.id, PROPOSED, "camera_slower")


def test_added_objective_is_grounded_and_a_removed_one_no_longer_heeded(make):
    core = make()
    core.operator.add_objective(Objective("o_more", "f_move", {"energy": 0.35}))
    core.observe_level(20.0, "energy", 0.4)
    core.step(20.0)
    (decision,) = core.step(22.0)
    assert (decision.objective, decision.to_configuration) == ("o_more", "scan_slower")
    with pytest.raises(MapeError, match="o_more is being adapted"):
        core.operator.remove_objective("o_more")
    core.report(23.0, decision.id, True)
    core.operator.remove_objective("o_more")
    (failure,) = fail(core, 24.0, "laser")
    assert failure.objective == "o_move"
    assert set(core.facts.groundings) == {"o_move"}


@pytest.mark.parametrize(
    ("objective", "message"),
    [
        (OBJECTIVE, "o_move exists already"),
        (Objective("o", "f_fly"), "no Function is called 'f_fly': known: f_move"),
        (Objective("o", "f_move", {"comfort": 1.0}), "Unsupported QA TYPE received: comfort"),
        (Objective("o", "f_move", {"safety": math.nan}), "limit of safety is nan"),
    ],
)
def test_objective_that_makes_no_sense_is_refused(make, objective, message):
    with pytest.raises(MapeError, match=message):
        make().operator.add_objective(objective)


def test_new_limit_counts_at_once(make):
    core = make()
    core.operator.set_nfr("o_move", "safety", 0.25)
    core.observe_level(1.0, "safety", 0.3)
    core.step(1.0)
    (decision,) = core.step(3.0)
    assert decision.trigger == "qa:safety"
    assert decision.to_configuration == "scan_slower"
    (cause,) = decision.reasons
    assert (cause.quality, cause.level, cause.limit, cause.rules) == ("safety", 0.3, 0.25, "QA, S9")
    assert cause.excess == pytest.approx(0.2)


def test_feasible_names_the_designs_that_can_be_deployed_the_most_useful_first(make):
    core = make()
    assert core.feasible() == {"f_move": tuple(sorted(DESIGNS, key=lambda d: -DESIGNS[d][0]["performance"]))}
    core.observe_component(1.0, "laser", "FALSE")
    assert core.feasible() == {"f_move": ("camera_fast", "camera_slow", "camera_slower")}
    core.observe_component(2.0, "base", "FALSE")
    assert core.feasible() == {"f_move": ()}


def test_saved_knowledge_base_has_the_statuses_and_loads_again(make, knowledge_base, tmp_path):
    core = make()
    core.operator.pause()
    fail(core, 1.0, "laser")
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, core.facts, core.analysis)
    again = read_knowledge_base([tmp_path / "saved.owl"])
    assert again.component_statuses["laser"] == "FALSE"
    assert [replace(o, limits=dict(o.limits)) for o in again.objectives] == [OBJECTIVE]
    assert "IN_ERROR_COMPONENT" in (tmp_path / "saved.owl").read_text()
    with pytest.raises(KnowledgeBaseError, match=r"nowhere/saved\.owl: No such file"):
        save_knowledge_base(tmp_path / "nowhere" / "saved.owl", knowledge_base)


@pytest.mark.parametrize("limit", [-2.0, 1.5])
def test_limit_out_of_its_range_is_refused(make, knowledge_base, limit):
    core = make()
    knowledge_base.qualities["safety"] = replace(knowledge_base.qualities["safety"], low=0.0, high=1.0)
    with pytest.raises(MapeError, match=f"limit of safety is {limit:g}, not within its range, 0 to 1: left as it is"):
        core.operator.set_nfr("o_move", "safety", limit)
