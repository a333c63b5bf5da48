"""Functions that many designs require are looked at once, and nothing else is decided by that."""

import pytest
from hierarchy_helpers import model
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop import deliberation, fulfilment
from mros1_reasoner.loop.deliberation import Deliberation
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.state import State

LEVELS = 10


def levels(count):
    """Return two functions at each level, each with two designs that require both functions of the next one."""
    below = {level: (f"f{level + 1}a", f"f{level + 1}b") if level < count - 1 else () for level in range(count)}
    return {
        f"d{level}{side}{k}": (f"f{level}{side}", 1.0 - k * 0.1, below[level])
        for level in range(count)
        for side in "ab"
        for k in range(2)
    }


def loop(knowledge_base, root):
    engine = RuleEngine()
    engine.load(knowledge_base.ontology)
    settings = Settings(start_grace=0.0, backoff=0.1, restart_grace=0.0, violation_window=0.0, history=1)
    return Mape(knowledge_base, engine, [Objective("o_root", root, {"error": 0.5})], settings, name="d")


def counted(monkeypatch, place, name):
    """Return a list that grows with each call of a function."""
    calls, function = [], getattr(place, name)
    monkeypatch.setattr(place, name, lambda *words, **options: calls.append(1) or function(*words, **options))
    return calls


def deployed(load, count=LEVELS):
    """Return a loop of that many levels in which everything runs."""
    designs = levels(count)
    core = loop(load(model(designs, {"c": (f"d{count - 1}a0",)})), "f0a")
    for name, (function, _, _) in designs.items():
        if name.endswith("0"):
            core.observe_active(1.0, function, name, "STABLE")
    core.step(2.0)
    return core


def test_each_function_is_planned_once_for_what_is_missing(load, monkeypatch):
    plans = counted(monkeypatch, deliberation, "plan")
    (decision,) = loop(load(model(levels(LEVELS), {})), "f0a").step(1.0)
    assert (decision.state, decision.objective) == (DECIDED, f"o_f{LEVELS - 1}a")
    assert len(plans) <= 2 * 2 * LEVELS


def test_fulfilment_looks_at_each_objective_a_few_times(load, monkeypatch):
    core = deployed(load)
    looks = counted(monkeypatch, fulfilment, "errors")
    assert core.fulfilment("o_root", 2.1).is_fulfilled
    assert len(looks) <= 2 * LEVELS


def test_objective_is_fulfilled_only_while_all_below_it_is(load):
    core = deployed(load)
    assert core.fulfilment("o_root", 2.1).is_fulfilled
    core.observe_component(3.0, "c", "FALSE")
    core.step(3.0)
    assert not core.fulfilment("o_root", 3.1).is_fulfilled
    assert core.fulfilment(f"o_f{LEVELS - 1}b", 3.1).is_fulfilled


def test_design_that_may_be_tried_again_is_looked_for_in_every_function_once(load, monkeypatch):
    core = deployed(load)
    provided = counted(monkeypatch, State, "provider")
    assert core._state._improved_by("d0b1", "o_nothing") == []
    assert len(provided) <= 2 * LEVELS * 2 * 4 * LEVELS


def test_functions_over_too_many_levels_are_refused(load):
    def chain(count):
        return model({f"d{i}": (f"f{i:04}", 1.0, (f"f{i + 1:04}",) if i < count - 1 else ()) for i in range(count)}, {})

    (decision,) = loop(load(chain(100)), "f0000").step(1.0)
    assert decision.to_configuration == "d99"
    for count in (101, 1200):
        with pytest.raises(KnowledgeBaseError, match=r"over more than 100 levels \(f0\d* -> .*\.\.\.\): have designs"):
            load(chain(count))


def test_levels_count_over_functions_that_were_looked_at_before(load):
    shared = {f"d{i}": (f"f1{i:03}", 1.0, (f"f1{i + 1:03}",) if i < 59 else ()) for i in range(60)}
    above = {f"e{i}": (f"f2{i:03}", 1.0, (f"f2{i + 1:03}" if i < 59 else "f1000",)) for i in range(60)}
    with pytest.raises(KnowledgeBaseError, match="over more than 100 levels"):
        load(model({**shared, **above}, {}))


# The plain way


class PlainDeliberation(Deliberation):
    """A deliberation that plans each function anew wherever it is required."""

    def _plan(self, name, now, function="", only=(), known=None):
        return self._plan_anew(name, now, function, only, {})

    def _missing(self, name, outcome, now):
        steps = []
        for function in self._state.kb.designs[outcome.choice or ""].requires:
            provider = self._state.provider(function)
            if self._state.is_fine(provider):
                fine = deliberation.Plan(self._state.running[provider].design, False, (), "")
                found = self._missing(provider, fine, now)[:-1]
            else:
                plan = self._plan(provider, now, function)
                found = self._missing(provider, plan, now) if plan.choice else []
            steps += [step for step in found if step[0] not in {name for name, _ in steps}]
        return [*steps, (name, outcome)]


class PlainState(State):
    """A state that looks at each design wherever it is required."""

    def _builds_on(self, design, name):
        return any(
            self.provider(function) == name or any(self._builds_on(other, name) for other in self.kb.solving(function))
            for function in design.requires
        )


def plainly_fulfilled(view, name, now):
    stands = fulfilment.fulfilment(view, name, now)
    running = view.running[name]
    itself = bool(running.design) and not (stands.stage or stands.violated or fulfilment.errors(view, name, now))
    below = view.required(running.design)
    is_below = all(o in view.running and plainly_fulfilled(view, o, now) for o in below)
    return itself and fulfilment._is_whole(view, name) and is_below


def plainly_counts(view, name, now):
    running = view.running.get(name)
    if running is None:
        return False
    is_own = any(objective == name for objective, _ in view.violations(now)) or view.rule_counts(name, now)
    required = view.required(running.design)
    return is_own or running.task_failure is not None or any(plainly_counts(view, o, now) for o in required)


@st.composite
def hierarchies(draw):
    """Return designs of functions that require functions with greater numbers, and which component each one needs."""
    count = draw(st.integers(2, 6))
    designs, components = {}, {f"c{i}": [] for i in range(3)}
    for i in range(count):
        for k in range(draw(st.integers(1, 3))):
            below = draw(st.sets(st.integers(i + 1, count - 1), max_size=3)) if i < count - 1 else ()
            performance = draw(st.sampled_from([0.2, 0.5, 0.9]))
            designs[f"d{i}_{k}"] = (f"f{i}", performance, tuple(f"f{j}" for j in sorted(below)))
            components[f"c{draw(st.integers(0, 2))}"].append(f"d{i}_{k}")
    return designs, {name: tuple(needing) for name, needing in components.items() if needing}


EVENTS = st.one_of(
    st.tuples(st.just("component"), st.integers(0, 2), st.sampled_from(["TRUE", "FALSE"])),
    st.tuples(st.just("level"), st.integers(0, 5), st.sampled_from([0.1, 0.9])),
    st.tuples(st.just("task"), st.integers(0, 5), st.booleans()),
    st.tuples(st.just("outcome"), st.integers(0, 5), st.booleans()),
)


def told(core, event, now):
    kind, number, what = event
    if kind == "component" and f"c{number}" in core.view.kb.components:
        core.observe_component(now, f"c{number}", what)
    elif kind == "level":
        names = list(core.view.running)
        name = names[number % len(names)]
        design = core.view.running[name].design
        core.observe_level(now, "error", what, core.view.kb.grounding(name, design) if design else "nothing")
    elif kind == "task":
        running = [name for name, r in core.view.running.items() if r.design]
        if running:
            core.observe_task(now, running[number % len(running)], what)


@settings(max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(hierarchy=hierarchies(), events=st.lists(EVENTS, max_size=25))
def test_decisions_and_fulfilment_are_those_of_the_plain_way(load, hierarchy, events):
    knowledge_base = load(model(*hierarchy))
    core, plain = loop(knowledge_base, "f0"), loop(knowledge_base, "f0")
    plain._deliberation.__class__, plain._state.__class__ = PlainDeliberation, PlainState
    for i, event in enumerate([("none", 0, True)] * 3 + events):
        now, found = 1.0 + 2.0 * i, []
        for one in (core, plain):
            told(one, event, now)
            decisions = one.step(now, heartbeat=True)
            for _ in range(8):
                if not one.pending:
                    break
                ok = event[0] != "outcome" or event[2]
                decisions.append(one.report(now + 0.1, one.pending.id, ok))
                decisions += one.step(now + 0.2)
            found.append([(d.objective, d.state, d.to_configuration, d.explanation, d.candidates) for d in decisions])
        assert found[0] == found[1]
        view = core.view
        for name in view.running:
            assert core.fulfilment(name, now + 1.0).is_fulfilled == plainly_fulfilled(view, name, now + 1.0)
            assert fulfilment._counts(view, name, now + 1.0) == plainly_counts(view, name, now + 1.0)
