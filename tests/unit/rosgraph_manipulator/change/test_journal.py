"""How a manipulator begins, by what the one before it has left."""

import pytest
from rosgraph_manipulator.change.journal import Journal, Resumption, parse_journal, resume

NOW = 1000.0
STEADY = Journal("good", "", alive=NOW - 1.0)
CHANGING = Journal("good", "better", alive=NOW - 1.0)


def test_what_runs_is_taken_over_with_its_goal():
    assert resume(STEADY, "good", False, "first", NOW) == Resumption(running="good", keep_goal=True)


def test_change_that_was_under_way_is_finished():
    assert resume(CHANGING, "better", False, "first", NOW) == Resumption(
        deploy="better", last_good="good", keep_goal=True
    )


def test_killed_pair_brings_the_mission_back():
    assert resume(STEADY, "", False, "first", NOW) == Resumption(deploy="good", keep_goal=True)
    assert resume(CHANGING, "", False, "first", NOW) == Resumption("better", last_good="good", keep_goal=True)


def test_configuration_that_the_launcher_gave_up_is_not_taken_over():
    assert resume(Journal(), "good", True, "first", NOW) == Resumption(deploy="first")


@pytest.mark.parametrize("journal", [Journal("good", "", alive=NOW - 3600.0), Journal("good", "", NOW + 60.0)])
def test_journal_of_another_time_is_not_believed(journal):
    assert resume(journal, "", False, "first", NOW) == Resumption(deploy="first")
    assert resume(journal, "good", False, "first", NOW) == Resumption(running="good")


def test_system_that_was_ended_starts_anew():
    ended = Journal("good", "", alive=NOW - 1.0, ended=True)
    assert resume(ended, "", False, "first", NOW) == Resumption(deploy="first")
    assert resume(ended, "good", False, "first", NOW) == Resumption(running="good", keep_goal=True)


def test_journal_survives_the_parameter_server():
    assert parse_journal(CHANGING.as_parameter()) == CHANGING


@pytest.mark.parametrize("value", [None, 3, {}, {**STEADY.as_parameter(), "alive": "yes"}, {"configuration": "x"}])
def test_parameter_of_another_form_is_no_journal(value):
    assert parse_journal(value) == Journal()
