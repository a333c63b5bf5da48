"""The fewest faults by which a history still fails."""

from simulated.faults import Fault, Kind
from simulated.history import History
from simulated.shrinking import as_test, shrink

FAULTS = tuple(Fault(float(number), Kind.KILL_NODE, f"/n{number}") for number in range(9))


def test_faults_that_do_not_matter_are_left_out():
    needed = {FAULTS[2], FAULTS[7]}
    shrunk = shrink(History(4, "station", FAULTS), lambda told: needed <= set(told.faults))
    assert shrunk.faults == (FAULTS[2], FAULTS[7])


def test_history_without_faults_may_fail():
    assert shrink(History(4, "station", FAULTS), lambda told: True).faults == ()


def test_test_of_a_history_can_be_compiled_and_names_what_is_broken():
    text = as_test(History(4, "station", FAULTS[:2]), "node /n runs twice\nmore")
    compile(text, "test", "exec")
    assert "# node /n runs twice\n" in text and 'Fault(1.0, Kind.KILL_NODE, "/n1")' in text
