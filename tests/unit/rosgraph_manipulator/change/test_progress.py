"""What a change waits for, when it has failed, and what is known to run."""

import pytest
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.change.progress import Awaited, ChangeProgress
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.configuration.difference import compare

NEW = Configuration("new", "f", "new.launch", topics=("plan",))


def report(state=STABLE, configuration="old", change=1, nodes=("/a", "/b"), dead=(), message="", function="f"):
    return LauncherReport(function, configuration, change, state, nodes, dead, message)


def reports(*arguments, **options):
    """What the launcher tells of function f, beside another function that shares /b."""
    return [LauncherReport("g", "other", 1, STABLE, ("/b", "/c")), report(*arguments, **options)]


def system(**nodes):
    return SystemDescription(
        {f"/{name}": NodeDescription(f"/{name}", "/", "p", "x", parameters=values) for name, values in nodes.items()},
        {"/shared": 1},
    )


@pytest.fixture
def progress():
    found = ChangeProgress()
    found.take(reports())
    found.begin("f", NEW, 10.0)
    return found


def test_robot_is_stopped_once_when_its_last_driver_has_ended(progress):
    progress.leave({"/a"}, drivers={"/a"}, servers=None)
    assert not progress.take(reports(CHANGING))  # nodes may still run
    assert progress.take(reports(CHANGING, "new"))
    assert not progress.take(reports(CHANGING, "new"))


@pytest.mark.parametrize("drivers", [set(), {"/a", "/b"}, {"/a", "/joystick"}])
def test_robot_is_not_stopped_while_somebody_may_still_drive_it(progress, drivers):
    progress.leave({"/a"}, drivers, servers=None)
    assert not progress.take(reports(CHANGING, "new"))


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
    progress.take(reports(CHANGING, "new", change=2))
    assert not progress.is_reported(2)
    progress.take(reports(STABLE, "new", change=2))
    assert progress.is_reported(2)
    assert not progress.is_reported(3)


@pytest.mark.parametrize("state", [RECOVERING, FAILED])
def test_death_after_the_change_fails_it(progress, state):
    progress.answered(2)
    assert progress.failure() is None
    progress.take(reports(state, "new", change=2, message="/a died"))
    assert progress.failure() == "/a died"


def test_death_that_comes_before_the_answer_fails_the_change_too(progress):
    progress.take(reports(RECOVERING, "new", change=2, message="/a died"))
    progress.answered(2)
    assert progress.failure() == "/a died"


def test_death_of_an_earlier_change_does_not_count(progress):
    progress.take(reports(RECOVERING, "old", change=1, message="/a died"))
    progress.answered(2)
    assert progress.failure() is None
    progress.begin("f", NEW, 0.0)
    progress.answered(1)  # of a new launcher, which counts anew
    assert progress.failure() is None


def test_node_that_has_done_its_work_needs_not_answer(progress):
    progress.take(reports(nodes=("/b",)))
    assert progress.has_finished("/a")
    assert not progress.has_finished("/b")


def test_recovery_waits_for_the_nodes_and_for_a_server_that_died(progress):
    progress.take(reports(RECOVERING, change=4, dead=("/a",), message="/a died"))
    progress.take(reports(STABLE, change=4))
    progress.recover("f", NEW, 20.0, new_server=True)
    assert progress.awaited(False) == Awaited(("/a", "/b"), frozenset({"plan"}), server=True)
    assert progress.failure() is None
    progress.take(reports(RECOVERING, change=4, dead=("/b",), message="/b died"))
    assert progress.failure() == "/b died"


def test_deaths_that_are_over_by_now_are_told_once(progress):
    progress.take(reports(RECOVERING, change=4, dead=("/a",), message="/a died"))
    progress.take(reports(RECOVERING, change=4, dead=("/b",), message="/b died"))
    progress.take(reports(STABLE, change=4))
    assert progress.take_deaths("f") == report(RECOVERING, change=4, dead=("/a", "/b"), message="/b died")
    assert progress.take_deaths("f") is None
    assert progress.take_deaths("g") is None


def test_death_that_is_over_while_another_node_is_dead_is_told(progress):
    progress.take(reports(RECOVERING, dead=("/a", "/b")))
    progress.take(reports(RECOVERING, dead=("/b",)))
    assert progress.take_deaths("f") == report(RECOVERING, dead=("/a", "/b"))


@pytest.mark.parametrize("later", [report(RECOVERING, dead=("/a",)), report(STABLE, change=2), report(FAILED)])
def test_deaths_that_the_last_report_tells_or_an_earlier_change_had_are_not_told(progress, later):
    progress.take(reports(RECOVERING, dead=("/a",)))
    progress.take([later])
    assert progress.take_deaths("f") is None
    progress.take(reports(STABLE))
    assert progress.take_deaths("f") is None


def test_dead_nodes_do_not_run(progress):
    progress.take(reports(RECOVERING, dead=("/a",)))
    assert list(progress.running_system("f", system(a={}, b={})).nodes) == ["/b"]


def test_failed_configuration_does_not_run(progress):
    assert progress.running("f") == "old"
    progress.take(reports(FAILED))
    assert progress.running("f") == ""


def test_node_whose_parameters_are_uncertain_differs_until_the_launcher_has_set_all(progress):
    described = system(a={"speed": 1}, b={"speed": 1})
    progress.parameters_change("/a/costmap")
    difference = compare(progress.running_system("f", described), described)
    assert difference.parameters == {"/a": {"speed": 1}}
    progress.answered(2)
    assert not compare(progress.running_system("f", described), described).touches_nodes


def test_parameters_of_a_node_inside_the_namespace_of_another_are_uncertain_alone(progress):
    progress.take(reports(nodes=("/a", "/a/inner")))
    described = system(**{"a": {"speed": 1}, "a/inner": {"speed": 1}})
    progress.parameters_change("/a/inner/costmap")
    assert list(compare(progress.running_system("f", described), described).parameters) == ["/a/inner"]


def test_of_a_configuration_without_description_only_the_names_are_known(progress):
    difference = compare(progress.running_system("f", None), system(b={}))
    assert (difference.stops, difference.replaced) == (("/a",), ("/b",))


def test_of_several_functions_each_has_a_report_of_its_own(progress):
    assert progress.functions == ("g", "f")
    assert progress.launched == ("/b", "/c", "/a")
    assert progress.launched_for("f") == ("/a", "/b")
    assert progress.running("g") == "other"
    assert progress.report("h").configuration == ""
    assert ChangeProgress().report("h") is None


def test_nodes_that_run_for_other_functions_are_shared(progress):
    assert progress.shared("f") == {"/b", "/c"}
    assert progress.shared("g") == {"/a", "/b"}
    assert progress.shared("f", yielding=["g"]) == frozenset()
    progress.take([report(FAILED, function="g"), report()])
    assert progress.shared("f") == frozenset()


def test_death_in_another_function_does_not_fail_the_change(progress):
    progress.answered(2)
    progress.take([report(RECOVERING, "other", change=2, message="/c died", function="g"), report(change=2)])
    assert progress.failure() is None


def test_value_that_was_set_since_is_what_runs(progress):
    described = system(a={"speed": 1}, b={"speed": 1})
    running = progress.running_system("f", described, {"/a/speed": 3})
    assert compare(running, described).parameters == {"/a": {"speed": 1}}


def test_node_that_a_plan_has_not_stopped_yet_runs(progress):
    progress.take([report(nodes=("/a", "/left"))])
    assert list(progress.running_system("f", system(a={})).nodes) == ["/a", "/left"]


def test_server_that_an_earlier_step_replaced_is_waited_for(progress):
    progress.leave({"/a"}, set(), servers={"/a"})
    progress.start(("/new",))
    progress.leave({"/old"}, set(), servers={"/new"})
    assert progress.awaited(False).server


def test_function_gives_up_shared_and_dead_nodes_that_it_has_no_more():
    progress = ChangeProgress()
    spray = LauncherReport("spray", "by_leaf", nodes=("/mast", "/sprayer"))
    follow = LauncherReport("follow", "by_rows", nodes=("/mast", "/finder", "/lost", "/steering"), dead=("/lost",))
    progress.take([spray, follow])
    assert progress.given_up("follow", ["/steering"]) == ("/mast", "/lost")
    assert progress.given_up("follow", ["/steering", "/mast", "/lost"]) == ()
    assert progress.given_up("unheard", []) == ()
