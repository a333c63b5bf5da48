"""Entries of the journal: their text, what the loop takes in by them, and what stays of a long one."""

from dataclasses import replace

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


def as_it_is(entry):
    return entry


def test_long_journal_keeps_the_last_and_what_lasts():
    journal = Journal(as_it_is, limit=100)
    journal.append(Entry(0.0, ActiveFact("f_move", "scan_slow", "STABLE")))
    journal.append(Entry(0.0, ComponentFact("laser", "FALSE")))
    journal.append(Entry(0.5, ComponentFact("laser", "TRUE", 0.5)))
    journal.append(Entry(0.6, Lock()))
    for i in range(1000):
        number, _ = journal.append(Entry(1.0 + i, Step(heartbeat=False)))
    first, entries = journal.snapshot()
    assert number == 1003
    assert first + len(entries) == 1004
    assert len(entries) <= 110
    lasting = [ActiveFact("f_move", "scan_slow", "STABLE"), ComponentFact("laser", "TRUE", 0.5), Lock()]
    assert [entry.content for entry in entries[:3]] == lasting
    assert [entry.now for entry in entries[3:]] == [1.0 + i for i in range(1000)][-len(entries) + 3 :]


def kept(*entries, objectives=None, at_start=None, limit=4):
    """Return what a journal keeps of entries that are old ones, after a clock reset at each: their time goes back."""
    journal = Journal(as_it_is, limit, at_start)
    for i, content in enumerate(entries):
        journal.append(Entry(100.0 - i, content), objectives)
    for i in range(3 * limit):
        journal.append(Entry(float(i), Step(heartbeat=True)), objectives)
    first, found = journal.snapshot()
    assert first + len(found) == len(entries) + 3 * limit
    return [entry.content for entry in found if not isinstance(entry.content, Step)]


@pytest.mark.parametrize(
    ("given", "holds"),
    [
        ((Pause(), Resume()), []),
        ((Resume(), Pause(), Pause()), [Pause()]),
        ((Lock("o_a"), Lock("o_b"), Unlock("o_a")), [Lock("o_b")]),
        ((Lock("o_a"), Unlock()), []),
        ((Lock(),), [Lock("o_a"), Lock("o_b")]),
        ((Lock(), Unlock("o_a")), [Lock("o_b")]),
        ((SetNfr("o_a", "q", 1.0), SetNfr("o_a", "q", 2.0)), [SetNfr("o_a", "q", 2.0)]),
        ((SetNfr("o_a", "q", 1.0), SetNfr("", "q", 2.0)), [SetNfr("o_a", "q", 2.0), SetNfr("o_b", "q", 2.0)]),
        ((AddObjective("o_c", "f", {}), Lock("o_c"), RemoveObjective("o_c")), []),
        ((Pursue("o_c", "f", {}), SetNfr("o_c", "q", 1.0), RemoveObjective("o_c")), []),
        ((SetNfr("o_c", "q", 1.0), Pursue("o_c", "f", {}), RemoveObjective("o_c")), [SetNfr("o_c", "q", 1.0)]),
        (
            (RemoveObjective("o_a"), AddObjective("o_a", "f", {})),
            [RemoveObjective("o_a"), AddObjective("o_a", "f", {})],
        ),
        ((RemoveObjective("o_a"), AddObjective("o_a", "f", {}), RemoveObjective("o_a")), [RemoveObjective("o_a")]),
        (
            (
                Pursue("o_c", "f", {"q": 1.0}),
                AddObjective("o_d", "f", {}),
                Pursue("o_c", "f", {}),
                Pursue("o_c", "f", {}),
            ),
            [Pursue("o_c", "f", {"q": 1.0}), AddObjective("o_d", "f", {}), Pursue("o_c", "f", {})],
        ),
        ((TaskFact("an observer", True), TaskFact("another", False)), [TaskFact("", False)]),
        ((TaskFact("o_a", True), TaskFact("f", False), TaskFact("", True)), None),
    ],
)
def test_of_old_entries_the_journal_keeps_those_that_hold_in_their_order(given, holds):
    objectives = {name: replace(OBJECTIVE, name=name, function="f") for name in ("o_a", "o_b")}
    assert kept(*given, objectives=objectives, at_start={"o_a", "o_b"}) == (list(given) if holds is None else holds)


def test_task_of_a_removed_objective_is_not_taken_for_that_of_another_one():
    objectives = {name: replace(OBJECTIVE, name=name) for name in ("o_a", "o_c")}
    given = AddObjective("o_c", "f_move", {}), TaskFact("o_c", True), RemoveObjective("o_c")
    assert kept(*given, objectives=objectives, at_start={"o_a"}) == []


def test_long_journal_stays_short_whatever_is_asked_for():
    journal = Journal(as_it_is, limit=100, at_start={"o_a"})
    objectives = {"o_a": replace(OBJECTIVE, name="o_a")}
    for i in range(1000):
        for content in (
            SetNfr("", "q", float(i)),
            Pursue(f"o_{i}", "f", {}),
            Lock(f"o_{i}"),
            RemoveObjective(f"o_{i}"),
            TaskFact(f"observer {i}", False),
        ):
            journal.append(Entry(float(i), content), objectives)
    assert len(journal.snapshot()[1]) <= 110


def test_long_journal_that_keeps_much_does_not_look_at_it_with_each_entry(monkeypatch):
    compacted = []
    monkeypatch.setattr(Journal, "_compact", lambda self, old=Journal._compact: compacted.append(1) or old(self))
    journal = Journal(as_it_is, limit=100)
    for i in range(1000):
        journal.append(Entry(float(i), Lock(f"o_{i}")))
    assert len(compacted) <= 20


@given(st.lists(st.sampled_from([content for _, _, content in WRITTEN]), max_size=30), st.integers(0, 30))
def test_journal_that_is_short_enough_has_every_entry(contents, more):
    journal = Journal(as_it_is, limit=60)
    entries = [Entry(float(i), content) for i, content in enumerate([*contents, *[Step(heartbeat=True)] * more])]
    for entry in entries:
        journal.append(entry, {})
    assert journal.snapshot() == (0, entries)
