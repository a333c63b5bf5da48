"""Whatever happens, in whatever order: the loop decides only what can be done, and comes to rest."""

import contextlib

from hierarchy_helpers import COMPONENTS, D1, model
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.knowledge.model import Objective, Repair
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings

DESIGNS = {**D1, "FD3": ("F3", 0.5, ("F2",)), "FD3.0": ("F3", 0.4, ())}
NODES = {"gripper": ("FD1", "FD2"), "finder": ("FD2.1",)}
NODES_OF_DESIGNS = "".join(
    f'<t:Component rdf:about="#{node}">'
    + "".join(f'<m:deployedBy rdf:resource="#{design}"/>' for design in designs)
    + "</t:Component>"
    for node, designs in NODES.items()
)
REPAIRS = {
    name: Repair(name, duration, success=0.8, attempts=2)
    for name, duration in zip(sorted(COMPONENTS), (0.5, 3.0, 30.0), strict=False)
}
FUNCTIONS = sorted({function for function, _, _ in DESIGNS.values()})
ROOTS = (Objective("o_build", "F0", {"error": 0.5}), Objective("o_look", "F3"))
EVENTS = st.one_of(
    st.tuples(st.just("component"), st.sampled_from(sorted(COMPONENTS | NODES)), st.sampled_from(["TRUE", "FALSE"])),
    st.tuples(st.sampled_from(["active", "release"]), st.sampled_from(FUNCTIONS), st.just("")),
    st.tuples(st.just("task"), st.sampled_from(["o_build", "o_look", "F1", "F2"]), st.booleans()),
    st.tuples(st.just("level"), st.sampled_from([0.1, 0.4, 0.9]), st.just(None)),
    st.tuples(st.just("active"), st.sampled_from(sorted(DESIGNS)), st.sampled_from(["STABLE", "FAILED", "RECOVERING"])),
    st.tuples(st.just("remove"), st.sampled_from(["o_build", "o_look"]), st.just(None)),
    st.tuples(st.just("add"), st.sampled_from(ROOTS), st.just(None)),
    st.tuples(st.just("limit"), st.sampled_from([0.3, 0.6, 1.0]), st.just(None)),
    st.tuples(st.sampled_from(["lock", "unlock", "pause", "resume"]), st.just(None), st.just(None)),
    st.tuples(st.just("wait"), st.sampled_from([0.5, 3.0, 20.0, 100.0]), st.just(None)),
    st.tuples(st.just("report"), st.booleans(), st.booleans()),
)


def apply(core, now, event):
    """Let an event happen; return the present time after it."""
    kind, what, how = event
    match kind:
        case "component":
            core.observe_component(now, what, how)
        case "task":
            core.observe_task(now, what, how)
        case "level":
            core.observe_level(now, "error", what)
        case "active":
            runs = what in DESIGNS
            core.observe_active(now, DESIGNS[what][0] if runs else what, what if runs else "", how)
        case "release":
            core.report_released(what)
        case "remove":
            core.operator.remove_objective(what)
        case "add":
            core.operator.add_objective(what)
        case "limit":
            core.operator.set_nfr("o_build", "error", what)
        case "wait":
            return now + what
        case "report":
            if core.pending:
                core.report(now, core.pending.id, what, "why not", blame=how)
        case _:
            getattr(core.operator, kind)()
    return now


def check(core, decisions):
    """Check what was decided, and what is known."""
    decided = [decision for decision in decisions if decision.state == DECIDED]
    assert len([decision for decision in decided if not decision.repair]) <= 1
    assert core.pending is None or core.pending.objective in core.objectives
    for decision in decided:
        if decision.repair:
            assert decision.to_configuration == decision.from_configuration
            assert core._state.components[decision.repair].status == "FALSE"
            assert core._state.repairs.is_under_way(decision.repair) or core.proposal or core._state.settings.approval
            continue
        design = core._kb.designs[decision.to_configuration]
        assert design.function == core.objectives[decision.objective].function
        assert design.name not in core.analysis.unrealisable
        grounded = {core.objectives[name].function for name, running in core._state.running.items() if running.design}
        assert set(design.requires) <= grounded, "what a design requires is grounded before it"
    needed = {objective.function for objective in core.objectives.values()}
    assert needed.isdisjoint(core.released)
    assert set(core.released) <= set(core.active), "only what runs is released"
    for decision in decisions:
        assert decision.causes
        assert decision.objective
        losers = [candidate for candidate in decision.candidates if not candidate.chosen]
        assert all(candidate.lost_because for candidate in losers), "each candidate that lost has a reason"


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(events=st.lists(EVENTS, max_size=25), approval=st.booleans(), improves=st.booleans())
def test_loop_holds_whatever_happens(load, pellet, events, approval, improves):
    knowledge_base = load(model(DESIGNS, extra=NODES_OF_DESIGNS))
    knowledge_base.repairs = REPAIRS
    pellet.load(knowledge_base.ontology)
    core = Mape(knowledge_base, pellet, ROOTS, Settings(approval=approval, always_improve=improves))
    now = 0.0
    for event in events:
        now += 0.1
        with contextlib.suppress(MapeError):  # what does not fit what is known is refused
            now = apply(core, now, event)
        check(core, core.step(now))
        if core.proposal:
            core.operator.approve(core.proposal.id, now)
    core.operator.resume()
    core.operator.unlock()
    for _ in range(60):
        if core.pending:
            core.report(now, core.pending.id, True)
        decisions = core.step(now)
        check(core, decisions)
        if core.proposal:
            core.operator.approve(core.proposal.id, now)
        due = core.due(now)
        if not decisions and (due is None or due > now + 30.0):
            break
        now = due if not decisions and due else now
    else:
        raise AssertionError(f"it does not come to rest: {core.pending}, {core.facts.groundings}")
