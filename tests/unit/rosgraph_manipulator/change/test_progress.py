"""What a change waits for, when it has failed, and what is known to run."""

import pytest
from rosgraph_manipulator.change.progress import Awaited, ChangeProgress
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.configuration.difference import compare
from rosgraph_manipulator.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport

NEW = Configuration("new", "f", "new.launch", topics=("plan",))


def report(state=STABLE, configuration="old", change=1, nodes=("/a", "/b"), dead=(), message=""):
    return LauncherReport(configuration, change, state, nodes, dead, message)


def system(**nodes):
    return SystemDescription(
        {f"/{name}": NodeDescription(f"/{name}", "/", "p", "x", parameters=values) for name, values in nodes.items()},
        {"/shared": 1},
    )


@pytest.fixture
def progress():
    found = ChangeProgress()
    found.take(report())
    found.begin(NEW, 10.0)
    return found


def test_robot_is_stopped_once_when_its_last_driver_has_ended(progress):
    progress.leave({"/a"}, drivers={"/a"}, servers=None)
    assert not progress.take(report(CHANGING))  # nodes may still run
    assert progress.take(report(CHANGING, "new"))
    assert not progress.take(report(CHANGING, "new"))


@pytest.mark.parametrize("drivers", [set(), {"/a", "/b"}, {"/a", "/joystick"}])
def test_robot_is_not_stopped_while_somebody_may_still_drive_it(progress, drivers):
    progress.leave({"/a"}, drivers, servers=None)
    assert not progress.take(report(CHANGING, "new"))


@pytest.mark.parametrize(("servers", "replaced"), [({"/a"}, True), (set(), True), ({"/a", "/b"}, False), (None, False)])
def test_kept_action_gets_a_new_server_where_none_stays(progress, servers, replaced):
    assert progress.leave({"/a"}, set(), servers) is replaced
    progress.start(("/a",))
    assert progress.awaited(False).server is replaced


def test_started_nodes_and_topics_are_waited_for(progress):
    progress.start(("/a",))
    assert progress.awaited(False) == Awaited(("/a",), frozenset({"plan"}))
    assert progress.deadline(15.0) == 25.0


def test_time_to_be_ready_begins_anew_when_the_launcher_is_asked(progress):
    progress.restart_deadline(20.0)
    assert progress.deadline(15.0) == 35.0


def test_nothing_is_waited_for_where_no_node_starts(progress):
    assert progress.awaited(False) == Awaited()


def test_server_that_an_earlier_manipulator_stopped_is_waited_for(progress):
    assert progress.awaited(True) == Awaited((), frozenset({"plan"}), server=True)


def test_launcher_has_reported_a_change_when_it_is_over(progress):
    progress.take(report(CHANGING, "new", change=2))
    assert not progress.is_reported(2)
    progress.take(report(STABLE, "new", change=2))
    assert progress.is_reported(2)
    assert not progress.is_reported(3)


@pytest.mark.parametrize("state", [RECOVERING, FAILED])
def test_death_after_the_change_fails_it(progress, state):
    progress.answered(2)
    assert progress.failure() is None
    progress.take(report(state, "new", change=2, message="/a died"))
    assert progress.failure() == "/a died"


def test_death_that_comes_before_the_answer_fails_the_change_too(progress):
    progress.take(report(RECOVERING, "new", change=2, message="/a died"))
    progress.answered(2)
    assert progress.failure() == "/a died"


def test_death_of_an_earlier_change_does_not_count(progress):
    progress.take(report(RECOVERING, "old", change=1, message="/a died"))
    progress.answered(2)
    assert progress.failure() is None
    progress.begin(NEW, 0.0)
    progress.answered(1)  # of a new launcher, which counts anew
    assert progress.failure() is None


def test_node_that_has_done_its_work_needs_not_answer(progress):
    progress.take(report(nodes=("/b",)))
    assert progress.has_finished("/a")
    assert not progress.has_finished("/b")


def test_recovery_waits_for_the_nodes_and_for_a_server_that_died(progress):
    progress.take(report(RECOVERING, change=4, dead=("/a",), message="/a died"))
    assert progress.server_died({"/a"})
    progress.take(report(STABLE, change=4))
    progress.recover(NEW, 20.0)
    assert progress.awaited(False) == Awaited(("/a", "/b"), frozenset({"plan"}), server=True)
    assert progress.failure() is None
    progress.take(report(RECOVERING, change=4, dead=("/b",), message="/b died"))
    assert progress.failure() == "/b died"


def test_server_that_lives_need_not_be_waited_for(progress):
    progress.take(report(RECOVERING, dead=("/a",)))
    assert not progress.server_died({"/b"})


def test_dead_nodes_do_not_run(progress):
    progress.take(report(RECOVERING, dead=("/a",)))
    assert list(progress.running_system(system(a={}, b={})).nodes) == ["/b"]


def test_failed_configuration_does_not_run(progress):
    assert progress.running == "old"
    progress.take(report(FAILED))
    assert progress.running == ""


def test_node_whose_parameters_are_uncertain_differs_until_the_launcher_has_set_all(progress):
    described = system(a={"speed": 1}, b={"speed": 1})
    progress.parameters_change("/a/costmap")
    difference = compare(progress.running_system(described), described)
    assert difference.parameters == {"/a": {"speed": 1}}
    progress.answered(2)
    assert not compare(progress.running_system(described), described).touches_nodes


def test_of_a_configuration_without_description_only_the_names_are_known(progress):
    difference = compare(progress.running_system(None), system(b={}))
    assert (difference.stops, difference.replaced) == (("/a",), ("/b",))
