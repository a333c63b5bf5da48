"""Entries of the journal: their text, what the loop takes in by them, and what stays of a long one."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_bags.decision import DECIDED, EXECUTED
from mros1_reasoner.loop.entries import (
    ActiveFact,
    AddObjective,
    Approve,
    BindingFact,
    ComponentFact,
    Content,
    Decided,
    DriftFact,
    Entry,
    FailedFact,
    LeftFact,
    LevelFact,
    Lock,
    Pause,
    Pursue,
    Reject,
    Released,
    RemoveObjective,
    Result,
    Resume,
    SetNfr,
    StaleFact,
    Step,
    TaskFact,
    Unlock,
    UnneededFact,
)
from mros1_reasoner.loop.entry_text import kind_of, read_entry, values_of
from mros1_reasoner.loop.journal import Journal, apply, brought
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import OBJECTIVE

WRITTEN = [  # as bags have them
    ("level", ("safety", "0.2", "fg", "1.0"), LevelFact("safety", 0.2, "fg", 1.0)),
    ("stale", ("safety",), StaleFact("safety")),
    ("component", ("laser", "FALSE", "0.9"), ComponentFact("laser", "FALSE", 0.9)),
    ("component", ("laser", "FALSE", "0.9", "hung"), ComponentFact("laser", "FALSE", 0.9, "hung")),
    ("drift", ("arm/nav", "rate,speed", "scan_slow", "0.5"), DriftFact("arm/nav", "rate,speed", "scan_slow", 0.5)),
    ("binding", ("fg_o_move_scan_slow", "1"), BindingFact("fg_o_move_scan_slow", True)),
    ("task", ("o_move", "1", "0.0", "goal aborted"), TaskFact("o_move", True, 0.0, "goal aborted")),
    ("task", ("/some_observer", "0", "0.0", ""), TaskFact("/some_observer", False)),
    ("active", ("f_move", "scan_slow", "STABLE"), ActiveFact("f_move", "scan_slow", "STABLE")),
    (
        "left",
        ("o_move", "scan_slow", "safety", "1.5", "0.0", "scan", "1"),
        LeftFact("o_move", "scan_slow", "safety", 1.5, 0.0, "scan", True),
    ),
    ("failed", ("laser",), FailedFact("laser")),
    ("unneeded", ("f_grip",), UnneededFact("f_grip")),
    ("step", ("0",), Step(heartbeat=False)),
    ("result", ("x-1", "0", "gone", "1"), Result("x-1", False, "gone", True)),
    ("pause", (), Pause()),
    ("resume", (), Resume()),
    ("lock", (), Lock()),
    ("lock", ("o_move",), Lock("o_move")),
    ("unlock", ("o_move",), Unlock("o_move")),
    ("approve", ("x-1",), Approve("x-1")),
    ("reject", ("x-1",), Reject("x-1")),
    (
        "add_objective",
        ("o_other", "f_move", "safety", "0.5", "energy", "0.4"),
        AddObjective("o_other", "f_move", {"safety": 0.5, "energy": 0.4}),
    ),
    ("pursue", ("o_move", "f_move", "", "safety", "0.5"), Pursue("o_move", "f_move", {"safety": 0.5})),
    ("pursue", ("o_new", "f_move", "0"), Pursue("o_new", "f_move", {}, False)),
    ("remove_objective", ("o_move",), RemoveObjective("o_move")),
    ("set_nfr", ("o_move", "safety", "0.5"), SetNfr("o_move", "safety", 0.5)),
    ("set_nfr", ("", "safety", "0.5"), SetNfr("", "safety", 0.5)),
    ("active", ("f_move", "", ""), ActiveFact("f_move", "", "")),
    ("released", ("f_grip",), Released("f_grip")),
    ("decided", ("x-1", "o_move", "camera_slow"), Decided("x-1", "o_move", "camera_slow")),
]
BRING_NOTHING = [content for kind, _, content in WRITTEN if kind not in ("step", "result", "approve", "reject")]


@pytest.fixture
def core(knowledge_base, reasoner):
    core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings())
    apply(core, Entry(0.0, ActiveFact("f_move", "scan_slow", "STABLE")))
    return core


@pytest.mark.parametrize(("kind", "values", "content"), WRITTEN)
def test_text_of_each_kind(kind, values, content):
    assert (kind_of(content), values_of(content)) == (kind, values)
    assert read_entry(1.0, kind, values) == Entry(1.0, content)


def test_every_kind_of_content_has_its_text():
    assert {type(content) for _, _, content in WRITTEN} == set(Content.__args__)


@given(st.builds(LevelFact, st.text(), st.floats(allow_nan=False), st.text(), st.floats(allow_nan=False)))
def test_numbers_read_back_exactly(fact):
    assert read_entry(0.0, "level", values_of(fact)).content == fact


@pytest.mark.parametrize(
    ("kind", "values", "said"),
    [
        ("dance", (), "unknown kind 'dance'"),
        ("pursue", ("o_move", "f_move"), "'pursue' of the journal has 2 values"),
        ("pursue", ("o_move", "f_move", "1", "safety"), "'pursue' of the journal has 4 values"),
        ("level", ("safety", "much", "", "1.0"), "float"),
        ("level", ("safety",), "'level' of the journal has 1 values"),
        ("pause", ("now",), "'pause' of the journal has 1 values"),
        ("lock", ("a", "b"), "'lock' of the journal has 2 values"),
        ("add_objective", ("o", "f", "safety"), "'add_objective' of the journal has 3 values"),
    ],
)
def test_text_that_is_no_entry_is_refused(kind, values, said):
    with pytest.raises(ValueError, match=said):
        read_entry(1.0, kind, values)


def test_entries_make_a_decision_and_carry_it_out(core):
    apply(core, Entry(1.0, ComponentFact("laser", "FALSE", 0.9)))
    (decision,) = apply(core, Entry(1.0, Step(heartbeat=False)))
    assert (decision.state, decision.stamp_monitored) == (DECIDED, 0.9)
    assert brought(1.0, [decision]) == [Entry(1.0, Decided(decision.id, "o_move", "camera_slow"))]
    (done,) = apply(core, Entry(2.0, Result(decision.id, ok=True)))
    assert done.state == EXECUTED


@pytest.mark.parametrize("content", BRING_NOTHING, ids=kind_of)
def test_facts_and_commands_bring_nothing_before_a_step(core, content):
    assert apply(core, Entry(1.0, content)) == []


def test_what_an_operator_sets_holds(core):
    apply(core, Entry(1.0, AddObjective("o_other", "f_move", {"safety": 0.5})))
    apply(core, Entry(1.0, SetNfr("", "energy", 0.3)))
    assert core.objectives["o_other"].limits == {"safety": 0.5, "energy": 0.3}
    assert core.objectives["o_move"].limits["energy"] == 0.3


def test_what_does_not_fit_is_refused(core):
    with pytest.raises(MapeError):
        apply(core, Entry(1.0, Approve("x-1")))


def test_long_journal_keeps_the_last_and_what_lasts():
    journal = Journal(limit=100)
    journal.append(Entry(0.0, ActiveFact("f_move", "scan_slow", "STABLE")))
    journal.append(Entry(0.0, ComponentFact("laser", "FALSE")))
    journal.append(Entry(0.5, ComponentFact("laser", "TRUE", 0.5)))
    journal.append(Entry(0.6, Lock()))
    for i in range(1000):
        number = journal.append(Entry(1.0 + i, Step(heartbeat=False)))
    first, entries = journal.snapshot()
    assert number == 1003
    assert first + len(entries) == 1004
    assert len(entries) <= 110
    lasting = [ActiveFact("f_move", "scan_slow", "STABLE"), ComponentFact("laser", "TRUE", 0.5), Lock()]
    assert [entry.content for entry in entries[:3]] == lasting
    assert [entry.now for entry in entries[3:]] == [1.0 + i for i in range(1000)][-len(entries) + 3 :]
