"""Entries of the journal: what the loop takes in by them, and what stays of a long one."""

import pytest
from metacontrol_bags.decision import DECIDED, EXECUTED
from mros1_reasoner.loop.journal import Entry, Journal, apply, decided, entry
from mros1_reasoner.loop.mape import Mape, MapeError
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import OBJECTIVE


@pytest.fixture
def core(knowledge_base, reasoner):
    core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings())
    apply(core, entry(0.0, "active", "f_move", "scan_slow", "STABLE"))
    return core


def test_entries_make_a_decision_and_carry_it_out(core):
    apply(core, entry(1.0, "component", "laser", "FALSE", 0.9))
    (decision,) = apply(core, entry(1.0, "step", False))
    assert (decision.state, decision.stamp_monitored) == (DECIDED, 0.9)
    assert decided(1.0, [decision]) == [Entry(1.0, "decided", (decision.id, "o_move", "camera_slow"))]
    (done,) = apply(core, entry(2.0, "result", decision.id, True, "", True))
    assert done.state == EXECUTED


def test_numbers_read_back_exactly(core):
    level = 0.1 + 0.2
    apply(core, entry(1.0, "level", "safety", level, "", 1 / 3))
    apply(core, entry(1.0, "step", True))
    assert core.facts.levels["o_move", "safety"] == level


@pytest.mark.parametrize(
    "item",
    [
        entry(1.0, "level", "safety", 0.2, "fg", 1.0),
        entry(1.0, "stale", "safety"),
        entry(1.0, "binding", "fg_o_move_scan_slow", True),
        entry(1.0, "task", "o_move", True, 0.0, "goal aborted"),
        entry(1.0, "task", "/some_observer", False, 0.0, ""),
        entry(1.0, "pause"),
        entry(1.0, "resume"),
        entry(1.0, "lock"),
        entry(1.0, "unlock", "o_move"),
        entry(1.0, "add_objective", "o_other", "f_move", "safety", 0.5, "energy", 0.4),
        entry(1.0, "remove_objective", "o_move"),
        entry(1.0, "set_nfr", "o_move", "safety", 0.5),
        entry(1.0, "set_nfr", "", "safety", 0.5),
        entry(1.0, "decided", "x-1", "o_move", "camera_slow"),
    ],
    ids=lambda item: item.kind,
)
def test_every_kind_is_taken_in(core, item):
    assert apply(core, item) == []


def test_what_an_operator_sets_holds(core):
    apply(core, entry(1.0, "add_objective", "o_other", "f_move", "safety", 0.5))
    apply(core, entry(1.0, "set_nfr", "", "energy", 0.3))
    assert core.objectives["o_other"].limits == {"safety": 0.5, "energy": 0.3}
    assert core.objectives["o_move"].limits["energy"] == 0.3


def test_what_does_not_fit_is_refused(core):
    with pytest.raises(MapeError):
        apply(core, entry(1.0, "approve", "x-1"))
    with pytest.raises(ValueError, match="unknown kind 'dance'"):
        apply(core, entry(1.0, "dance"))
    with pytest.raises(ValueError, match="float"):
        apply(core, Entry(1.0, "level", ("safety", "much", "", "1.0")))


def test_long_journal_keeps_the_last_and_what_lasts():
    journal = Journal(limit=100)
    journal.append(entry(0.0, "active", "f_move", "scan_slow", "STABLE"))
    journal.append(entry(0.0, "component", "laser", "FALSE", 0.0))
    journal.append(entry(0.5, "component", "laser", "TRUE", 0.5))
    journal.append(entry(0.6, "lock"))
    for i in range(1000):
        number = journal.append(entry(1.0 + i, "step", False))
    first, entries = journal.snapshot()
    assert number == 1003
    assert first + len(entries) == 1004
    assert len(entries) <= 110
    assert [item.kind for item in entries[:3]] == ["active", "component", "lock"]
    assert entries[1].values[1] == "TRUE"
    assert [item.now for item in entries[3:]] == [1.0 + i for i in range(1000)][-len(entries) + 3 :]
