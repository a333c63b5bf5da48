"""Which configuration is restored, and what follows from a report of the launcher."""

import pytest
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.change.deployment import Outcome, Result
from rosgraph_manipulator.change.reactions import LAUNCHER_GRACE, DeployedConfigurations, Reaction
from rosgraph_manipulator.configuration.configurations import Configuration

A, B = Configuration("a", "f", "a.launch"), Configuration("b", "f", "b.launch")
PROBATION = 5.0


def deployed(*configurations, now=0.0):
    deployments = DeployedConfigurations(PROBATION)
    for configuration in configurations:
        deployments.finished(configuration, Outcome(Result.OK, configuration, ""), now)
    return deployments


def report(configuration, state, *dead):
    return LauncherReport("f", configuration.name if configuration else "", state=state, dead=dead)


def test_configuration_that_ran_is_restored_when_the_next_one_does_not_come_up():
    assert deployed(A).fallback(B) == A
    assert DeployedConfigurations(PROBATION).fallback(A) is None


def test_restored_configuration_is_the_last_good_one_and_has_replaced_none():
    deployments = deployed(A)
    deployments.finished(B, Outcome(Result.FAILED, A, "b died"), 1.0)
    assert (deployments.running, deployments.last_good, deployments.previous) == (A, A, None)


def test_superseded_request_leaves_the_last_good_one_to_restore():
    deployments = deployed(A)
    deployments.finished(B, Outcome(Result.FAILED, None, "given up", cancelled=True), 1.0)
    assert deployments.running is None
    assert deployments.fallback(B) == A


def test_request_that_fails_early_leaves_what_runs():
    outcome = deployed(A).refused(B, "no such file")
    assert (outcome.result, outcome.running, outcome.message) == (Result.FAILED, A, "b: no such file; a runs on")
    assert DeployedConfigurations(PROBATION).refused(B, "no such file").result is Result.GENERAL_ERROR


def test_what_an_earlier_manipulator_left_goes_on():
    deployments = DeployedConfigurations(PROBATION)
    deployments.resume(A, None)
    assert (deployments.running, deployments.last_good) == (A, A)
    deployments = DeployedConfigurations(PROBATION)
    deployments.resume(None, A)
    assert deployments.fallback(B) == A


@pytest.mark.parametrize(
    ("reported", "reaction"),
    [
        (None, Reaction.NONE),
        (report(A, STABLE), Reaction.NONE),
        (report(B, CHANGING), Reaction.NONE),
        (report(B, STABLE), Reaction.DEPLOY_AGAIN),
        (report(None, STABLE), Reaction.DEPLOY_AGAIN),
        (report(A, RECOVERING), Reaction.BEGIN_RECOVERY),
        (report(A, FAILED), Reaction.GIVE_UP),
    ],
)
def test_report_tells_what_to_do(reported, reaction):
    assert deployed(A).react(reported, 1.0) is reaction


@pytest.mark.parametrize("state", [STABLE, RECOVERING, FAILED])
def test_where_nothing_is_to_run_nothing_follows_from_a_report(state):
    assert DeployedConfigurations(PROBATION).react(report(A, state), 1.0) is Reaction.NONE


@pytest.mark.parametrize(("now", "reaction"), [(4.9, Reaction.GO_BACK), (5.1, Reaction.BEGIN_RECOVERY)])
def test_death_during_the_probation_takes_the_change_back(now, reaction):
    assert deployed(A, B).react(report(B, RECOVERING), now) is reaction


def test_request_that_touches_nothing_leaves_the_probation_and_the_wait_for_the_launcher():
    deployments = deployed(A, B)
    deployments.lacks_launcher(True, 0.0)
    deployments.finished(A, deployments.refused(A, "no such file"), LATE)
    assert deployments.previous == A
    assert deployments.lacks_launcher(True, LATE)


def test_first_configuration_has_no_probation():
    assert deployed(A).react(report(A, RECOVERING), 0.1) is Reaction.BEGIN_RECOVERY


def test_configuration_that_is_deployed_again_keeps_none_to_go_back_to():
    assert deployed(A, B, B).react(report(B, RECOVERING), 0.1) is Reaction.BEGIN_RECOVERY


def test_recovery_ends_once_all_nodes_run_again():
    deployments = deployed(A)
    deployments.begin_recovery()
    assert deployments.react(report(A, RECOVERING), 1.0) is Reaction.NONE
    assert deployments.react(report(A, STABLE), 1.0) is Reaction.END_RECOVERY
    deployments.end_recovery()
    assert deployments.react(report(A, STABLE), 1.0) is Reaction.NONE


def test_node_that_dies_while_another_one_recovers_is_told_once_for_each_death():
    deployments = deployed(A)
    assert deployments.react(report(A, RECOVERING, "/n"), 1.0) is Reaction.BEGIN_RECOVERY
    deployments.begin_recovery()
    dead = [("/n",), ("/n", "/m"), ("/n", "/m"), ("/n",), ("/n", "/m"), ()]
    told = [deployments.react(report(A, RECOVERING, *nodes), 1.0) is Reaction.GO_ON_RECOVERING for nodes in dead]
    assert told == [False, True, False, False, True, False]
    assert deployments.react(report(A, STABLE), 1.0) is Reaction.END_RECOVERY


def test_failed_configuration_is_not_restored_but_a_lost_one_is():
    deployments = deployed(A)
    deployments.lost()
    assert deployments.fallback(B) == A
    deployments.failed("it died")
    assert deployments.fallback(B) is None


def test_what_a_lost_host_has_stopped_is_deployed_again_when_it_is_back():
    deployments = deployed(A)
    assert deployments.react(report(A, FAILED), 1.0) is Reaction.GIVE_UP
    deployments.failed("it died", waits=True)
    assert deployments.react(report(A, FAILED), 2.0) is Reaction.NONE
    for back in (report(None, STABLE), report(A, STABLE)):
        assert deployments.react(back, 3.0) is Reaction.RETURN
    assert deployments.waiting == A


def test_what_is_lost_again_during_its_deployment_waits_once_more():
    deployments = deployed(A)
    deployments.failed("it died", waits=True)
    deployments.finished(B, Outcome(Result.GENERAL_ERROR, None, "host arm is lost"), 2.0)
    assert deployments.react(report(None, STABLE), 3.0) is Reaction.NONE
    deployments.wait_for(A)
    assert deployments.react(report(None, FAILED), 3.0) is Reaction.NONE
    assert deployments.react(report(None, STABLE), 4.0) is Reaction.RETURN


@pytest.mark.parametrize(
    "meanwhile",
    [
        lambda deployments: deployments.finished(B, Outcome(Result.OK, B, ""), 2.0),
        lambda deployments: deployments.released(),
        lambda deployments: deployments.failed("it died"),
    ],
)
def test_what_was_decided_meanwhile_counts_more_than_the_return_of_a_host(meanwhile):
    deployments = deployed(A)
    deployments.failed("it died", waits=True)
    meanwhile(deployments)
    assert deployments.waiting is None
    assert deployments.react(report(B, STABLE), 3.0) is Reaction.NONE


def test_why_nothing_runs_is_known_until_something_does_even_after_a_release():
    deployments = deployed(A)
    deployments.failed("a: it died")
    assert deployments.failure == "a: it died"
    deployments.released()
    assert deployments.failure == "a: it died"
    deployments.finished(B, Outcome(Result.OK, B, "b is deployed"), 1.0)
    assert deployments.failure == ""
    deployments.released()
    assert deployments.failure == ""


def test_change_that_leaves_nothing_says_why():
    deployments = deployed(A)
    deployments.finished(B, Outcome(Result.GENERAL_ERROR, None, "b: no such node"), 1.0)
    assert deployments.failure == "b: no such node"


# -- the launcher has ended

LATE = LAUNCHER_GRACE + 0.1


def test_launcher_that_does_not_come_back_is_told_once():
    deployments = deployed(A)
    ended = [deployments.lacks_launcher(True, now) for now in (10.0, 11.0, 10.0 + LATE, 20.0)]
    assert ended == [False, False, True, False]


def test_launcher_that_is_back_soon_is_not_told():
    deployments = deployed(A)
    ended = [deployments.lacks_launcher(gone, now) for gone, now in ((True, 0.0), (False, 1.0), (True, LATE))]
    assert not any(ended)


def test_function_that_lacks_its_launcher_does_not_recover_by_the_old_report():
    deployments = deployed(A)
    deployments.lacks_launcher(True, 0.0)
    deployments.lacks_launcher(True, LATE)
    assert deployments.react(report(A, STABLE), LATE) is Reaction.NONE
    assert not deployments.lacks_launcher(False, LATE)
    assert deployments.react(report(A, STABLE), LATE) is Reaction.END_RECOVERY  # only the connection was lost
    assert deployments.react(report(None, STABLE), LATE) is Reaction.DEPLOY_AGAIN


def test_function_that_does_not_run_lacks_no_launcher():
    deployments = deployed(A)
    deployments.released()
    assert not any(deployments.lacks_launcher(True, now) for now in (0.0, LATE))


def test_change_begins_a_new_wait_for_the_launcher():
    deployments = deployed(A)
    deployments.lacks_launcher(True, 0.0)
    deployments.finished(A, Outcome(Result.OK, A, ""), LATE)
    assert not deployments.lacks_launcher(True, LATE)
    assert deployments.lacks_launcher(True, LATE + LATE)
