"""A shadow follows a reasoner by its journal, and tells what that one would do."""

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.loop import journal
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, Entry, LevelFact, Pause, Result, Resume, Step
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.replay.shadow import Shadow, without_heartbeats
from reasoner_helpers import OBJECTIVE


@pytest.fixture
def make(load):
    """Return a function that makes a loop with a reasoner of its own."""
    kb = load()

    def loop(name, **settings):
        engine = RuleEngine()
        engine.load(kb.ontology)
        return Mape(kb, engine, [OBJECTIVE], Settings(**settings), name=name), kb, engine

    return loop


@pytest.fixture
def life(make):
    """Return a followed loop, the function that has it take in an entry, and its journal."""
    core, _, _ = make("first")
    taken = []

    def take(now, content):
        entry = Entry(now, content)
        decisions = journal.apply(core, entry)
        taken.extend([entry, *journal.brought(now, decisions)])
        return decisions

    take(0.0, ActiveFact("f_move", "scan_slow", "STABLE"))
    take(0.1, Step(heartbeat=True))
    return core, take, taken


def shadow_of(make, taken, name="second", **settings):
    shadow = Shadow(*make(name, **settings))
    shadow.follow(taken)
    return shadow


def test_shadow_knows_what_the_followed_loop_knows(make, life):
    core, take, taken = life
    [decision] = take(1.0, ComponentFact("laser", "FALSE", 1.0)) or take(1.1, Step(heartbeat=False))
    take(2.0, Result(decision.id, ok=True))
    take(2.1, Step(heartbeat=True))
    shadow = shadow_of(make, taken)  # its own ids differ
    assert shadow.remarks == []
    assert shadow.view.running["o_move"].design == core.view.running["o_move"].design == decision.to_configuration


def test_it_tells_what_a_failure_would_lead_to_and_stays_as_it_is(make, life):
    _, _, taken = life
    shadow = shadow_of(make, taken)
    supposed = shadow.suppose(5.0, failed=["laser"])
    assert [(d.from_configuration, d.to_configuration) for d in supposed.decisions] == [("scan_slow", "camera_slow")]
    assert shadow.view.components.get("laser") is None
    assert shadow.view.running["o_move"].design == "scan_slow"
    assert shadow.suppose(5.0).decisions == ()


def test_limit_that_the_present_level_violates_leads_to_a_change_after_a_while(make, life):
    _, take, taken = life
    for n in range(20):
        take(1.0 + n / 4, LevelFact("safety", 0.28, "", 1.0 + n / 4))
        take(1.0 + n / 4, Step(heartbeat=True))
    supposed = shadow_of(make, taken).suppose(6.0, limits={"safety": 0.25})
    assert [d.to_configuration for d in supposed.decisions] == ["scan_slower"]


def test_limits_of_a_band_are_supposed_in_any_order(make, life):
    _, _, taken = life
    for order in (1, -1):
        limits = dict([("safety_min", 0.7), ("safety", 0.9)][::order])
        assert shadow_of(make, taken).suppose(6.0, limits=limits)


def test_paused_reasoner_would_decide_nothing_and_says_so(make, life):
    _, take, taken = life
    take(1.0, Pause())
    supposed = shadow_of(make, taken).suppose(2.0, failed=["laser"])
    assert (supposed.decisions, "paused" in supposed.note) == ((), True)
    take(3.0, Resume())
    assert shadow_of(make, taken).suppose(4.0, failed=["laser"]).decisions


def test_unknown_component_is_refused(make, life):
    with pytest.raises(MapeError, match="rudder is not in the model"):
        shadow_of(make, life[2]).suppose(1.0, failed=["rudder"])


def test_entry_that_does_not_fit_is_remarked(make, life):
    shadow = shadow_of(make, [*life[2], Entry(9.0, Result("nobody's", ok=True))])
    assert len(shadow.remarks) == 1


def test_shadow_that_begins_late_comes_to_the_same_without_heartbeats(make, life):
    _, take, taken = life
    take(1.0, ComponentFact("laser", "FALSE", 1.0))
    take(1.1, Step(heartbeat=True))
    assert shadow_of(make, without_heartbeats(taken)).view.pending is not None
