"""How a manipulator begins, by what the one before it has left."""

import pytest
from rosgraph_manipulator.change import journal as module
from rosgraph_manipulator.change.journal import MAX_ATTEMPTS, Journal, Resumption, begin_journal, parse_journal

NOW = 1000.0
GOOD = {"f_pick": "good"}
KNOWN = {**dict.fromkeys(("first", "good", "better"), "f_pick"), "near": "f_look", "far": "f_look"}
STEADY = Journal(GOOD, "", alive=NOW - 1.0)
CHANGING = Journal(GOOD, "better", alive=NOW - 1.0, attempts=1)
BROKEN = CHANGING.broken("NameError: name 'x' is not defined", NOW - 1.0)


def resume(journal, launched, failed, initial, now, function="f_pick", supervisor=""):
    return module.resume(journal, KNOWN, function, launched, failed, initial, now, supervisor)


def test_what_runs_is_taken_over_with_its_goal():
    assert resume(STEADY, "good", False, "first", NOW) == Resumption(running="good", keep_goal=True)


def test_change_that_was_under_way_is_finished():
    assert resume(CHANGING, "better", False, "first", NOW) == Resumption(
        deploy="better", last_good="good", keep_goal=True, attempts=1
    )


def test_killed_pair_brings_the_mission_back():
    assert resume(STEADY, "", False, "first", NOW) == Resumption(deploy="good", last_good="good", keep_goal=True)
    assert resume(CHANGING, "", False, "first", NOW) == Resumption(
        "better", last_good="good", keep_goal=True, attempts=1
    )


def test_manipulator_that_dies_while_it_brings_back_one_function_forgets_no_other():
    journal = Journal({**GOOD, "f_look": "near"}, "", alive=NOW - 1.0)
    for _ in range(MAX_ATTEMPTS):
        begun = {name: resume(journal, "", False, "", NOW, name) for name in ("f_pick", "f_look")}
        assert begun["f_look"] == Resumption(deploy="near", last_good="near", keep_goal=True)
        assert begun["f_pick"].deploy == "good"
        last_good = {name: resumption.last_good for name, resumption in begun.items()}
        journal = begin_journal(begun.values(), "").noted(last_good, NOW, wanted="good")


def die(journal, deploys):
    """Return the journal of a manipulator that begins as `journal` says, and dies before or while it deploys."""
    begun = resume(journal, "good", False, "first", NOW)
    told = begin_journal([Resumption(running="far"), begun], "").noted({"f_pick": begun.last_good}, NOW)
    return told.noted({"f_pick": begun.last_good}, NOW, wanted=begun.deploy) if deploys else told


@pytest.mark.parametrize("launched", ["good", ""])
def test_change_that_ended_the_manipulator_by_an_error_is_not_begun_again(launched):
    resumption = resume(BROKEN, launched, False, "first", NOW)
    assert resumption.refused == "better"
    assert "NameError: name 'x' is not defined" in resumption.reason
    assert (resumption.running or resumption.deploy) == "good"
    assert resumption.keep_goal


@pytest.mark.parametrize("deploys", [True, False])
def test_change_during_which_manipulators_die_without_an_error_is_begun_a_few_times_only(deploys):
    journal = Journal().noted(GOOD, NOW, wanted="better")
    for _ in range(MAX_ATTEMPTS - 1):
        assert resume(journal, "good", False, "first", NOW).deploy == "better"
        journal = die(journal, deploys)
    resumption = resume(journal, "good", False, "first", NOW)
    assert (resumption.running, resumption.refused) == ("good", "better")
    assert f"{MAX_ATTEMPTS} times" in resumption.reason


def test_refused_change_that_the_launcher_has_made_is_taken_back():
    resumption = resume(BROKEN, "better", False, "first", NOW)
    assert (resumption.running, resumption.deploy) == ("", "good")


def test_refused_change_without_an_earlier_configuration_leaves_what_runs():
    journal = Journal({}, "better", alive=NOW, error="x")
    assert resume(journal, "better", False, "first", NOW).running == "better"


@pytest.mark.parametrize(("initial", "deployed"), [("first", "first"), ("better", ""), ("", "")])
def test_refused_change_is_not_begun_again_as_the_initial_configuration(initial, deployed):
    journal = Journal({}, "better", alive=NOW, error="x")
    resumption = resume(journal, "", False, initial, NOW)
    assert (resumption.running, resumption.deploy, resumption.refused) == ("", deployed, "better")


def test_refused_restoration_is_not_begun_again():
    journal = Journal(GOOD, "good", alive=NOW, error="x")
    assert resume(journal, "", False, "", NOW).deploy == ""


def test_refused_change_that_the_launcher_gave_up_is_not_taken_over():
    assert resume(BROKEN, "better", True, "first", NOW).deploy == "good"


def test_refusal_of_another_time_is_not_believed():
    resumption = resume(BROKEN, "good", False, "first", NOW + 3600.0)
    assert resumption == Resumption(running="good")


def test_manipulator_with_nothing_to_deploy_begins_without_a_change():
    assert begin_journal([Resumption(running="good")], "") == Journal()


def test_error_is_kept_when_the_manipulator_ends_of_it():
    assert BROKEN.noted(GOOD, NOW, ended=True) == BROKEN


def test_change_that_has_ended_leaves_no_attempts():
    ended = Journal().noted(GOOD, NOW, wanted="better").noted({"f_pick": "better"}, NOW, wanted="")
    assert (ended.attempts, ended.refusal) == (0, "")
    again = ended.noted({"f_pick": "better"}, NOW, wanted="better")
    assert (again.attempts, again.refusal) == (1, "")


def test_configuration_that_the_launcher_gave_up_is_not_taken_over():
    assert resume(Journal(), "good", True, "first", NOW) == Resumption(deploy="first")


@pytest.mark.parametrize("journal", [Journal(GOOD, "", alive=NOW - 3600.0), Journal(GOOD, "", NOW + 60.0)])
def test_journal_of_another_time_is_not_believed(journal):
    assert resume(journal, "", False, "first", NOW) == Resumption(deploy="first")
    assert resume(journal, "good", False, "first", NOW) == Resumption(running="good")


def test_manipulator_that_was_told_to_end_but_is_started_again_by_its_supervisor_goes_on():
    begun = begin_journal([Resumption(running="good")], "roslaunch 7")
    ended = parse_journal(begun.noted(GOOD, NOW - 1.0, ended=True).as_parameter())
    again = resume(ended, "", False, "first", NOW, supervisor="roslaunch 7")
    assert again == Resumption(deploy="good", last_good="good", keep_goal=True)
    for other in ("roslaunch 8", ""):
        assert resume(ended, "", False, "first", NOW, supervisor=other) == Resumption(deploy="first")


def test_system_that_was_ended_starts_anew():
    ended = Journal(GOOD, "", alive=NOW - 1.0, ended=True)
    assert resume(ended, "", False, "first", NOW) == Resumption(deploy="first")
    assert resume(ended, "good", False, "first", NOW) == Resumption(running="good", keep_goal=True)


@pytest.mark.parametrize(("now", "is_due"), [(NOW - 1.0, False), (NOW + 5.0, True), (NOW - 3600.0, True)])
def test_heartbeat_is_due_after_a_while_and_when_the_clock_was_set_back(now, is_due):
    assert STEADY.needs_heartbeat(now) is is_due


def test_journal_survives_the_parameter_server():
    assert parse_journal(BROKEN.as_parameter()) == BROKEN
    failed = STEADY.noted({}, NOW, failures={"f_pick": "it died"})
    assert parse_journal(failed.as_parameter()).failures == {"f_pick": "it died"}


def test_why_a_function_failed_is_known_to_the_next_manipulator_for_a_while():
    journal = Journal().noted({}, NOW, failures={"f_pick": "it died", "f_look": "it fell"})
    assert resume(journal, "", False, "", NOW) == Resumption(failure="it died")
    assert resume(journal, "good", True, "", NOW) == Resumption(failure="it died")
    assert resume(journal, "good", False, "", NOW).failure == ""
    assert resume(journal, "", False, "first", NOW) == Resumption(deploy="first")
    assert resume(journal, "", False, "", NOW + 100.0) == Resumption()
    assert resume(journal.noted({}, NOW, ended=True, failures=journal.failures), "", False, "", NOW) == Resumption()


@pytest.mark.parametrize(
    "value",
    [
        None,
        3,
        {},
        {**STEADY.as_parameter(), "alive": "yes"},
        {**STEADY.as_parameter(), "attempts": True},
        {"configuration": "x"},
        {**STEADY.as_parameter(), "configurations": {"f_pick": 3}},
        {**STEADY.as_parameter(), "failures": {"f_pick": 3}},
    ],
)
def test_parameter_of_another_form_is_no_journal(value):
    assert parse_journal(value) == Journal()


def test_change_of_one_function_leaves_the_others_as_they_are():
    journal = Journal({**GOOD, "f_look": "near"}, "better", alive=NOW - 1.0, attempts=1)
    assert resume(journal, "far", False, "", NOW, "f_look") == Resumption(running="far", keep_goal=True)
    near = Resumption(deploy="near", last_good="near", keep_goal=True)
    assert resume(journal, "", False, "", NOW, "f_look") == near
    assert resume(journal, "good", False, "", NOW, "f_pick").deploy == "better"


def test_refused_change_of_one_function_refuses_nothing_of_another():
    journal = Journal({"f_look": "near"}, "better", alive=NOW, error="x")
    assert resume(journal, "near", False, "", NOW, "f_look") == Resumption(running="near", keep_goal=True)


def test_configuration_that_is_known_no_longer_is_not_deployed():
    assert resume(Journal({"f_look": "gone"}, "", alive=NOW), "", False, "far", NOW, "f_look").deploy == "far"
