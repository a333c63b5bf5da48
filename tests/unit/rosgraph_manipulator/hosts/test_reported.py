"""What one launcher tells, by its reports and its answers."""

import pytest
from rosgraph_launcher.launching.report import CHANGING, FAILED, STABLE, LauncherReport
from rosgraph_manipulator.hosts.reported import Reported

FIRST, SECOND = object(), object()  # connections


def report(change, state=STABLE, configuration="c"):
    return LauncherReport("f", configuration, change, state, ("/a",))


@pytest.fixture
def told():
    reported = Reported()
    reported.take({"f": report(4)}, FIRST)
    return reported


def test_nothing_is_told_before_the_first_report():
    assert Reported().report("f") is None
    assert not Reported().functions
    assert Reported().connection is None


@pytest.mark.parametrize("late", [report(4, FAILED), report(4), report(3, CHANGING, "b")])
def test_function_changes_until_what_was_answered_is_reported(told, late):
    told.answer("f", 5, FIRST)
    assert told.report("f").state == CHANGING
    told.take({"f": late}, FIRST)
    assert told.report("f").state == CHANGING
    told.take({"f": report(5)}, FIRST)
    assert told.report("f") == report(5)
    told.take({"f": report(5, FAILED)}, FIRST)
    assert told.report("f").state == FAILED


def test_first_change_of_a_function_counts_before_it_is_reported(told):
    told.answer("g", 5, FIRST)
    assert told.functions == {"f", "g"}
    assert told.report("g") == LauncherReport("g", state=CHANGING)
    assert told.report("f") == report(4)


def test_process_that_begins_anew_tells_what_is_now(told):
    told.answer("f", 5, FIRST)
    assert told.take({"f": report(1)}, SECOND)
    assert told.report("f") == report(1)
    assert not told.take({}, SECOND)
    assert told.report("f") is None


@pytest.mark.parametrize("connection", [None, SECOND])
def test_answer_of_another_process_says_nothing_of_this_one(told, connection):
    told.answer("f", 5, connection)
    assert told.report("f") == report(4)


def test_answer_of_a_new_process_that_has_not_reported_takes_the_place_of_the_old_ones(told):
    told.answer("f", 5, FIRST)
    told.answer("f", 1, FIRST)  # the process behind the service is another one already
    assert told.report("f") == report(4)


def test_all_is_forgotten_of_a_process_that_is_gone(told):
    told.answer("f", 5, FIRST)
    told.forget()
    assert told.report("f") is None
