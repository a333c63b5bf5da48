"""Which nodes a change stops, keeps and starts, and what follows when a node ends."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.launching.managed_nodes import ManagedNodes, Verdict, standby_changes
from rosgraph_manipulator.launching.report import CHANGING, FAILED, RECOVERING, STABLE
from rosgraph_manipulator.launching.restarts import RestartPolicy

POLICY = RestartPolicy(intensity=2, period=30.0, first_delay=0.5)


def system(*names, **options):
    return SystemDescription({name: NodeDescription(name, "/", "p", "x", **options) for name in names})


def change(nodes, configuration, wanted, start, now=0.0):
    """Carry out a change in which every start succeeds; return the nodes that had to end."""
    leaving = nodes.begin_change(wanted, start)
    for name in leaving:
        nodes.stopped(name)
    nodes.adopt(configuration, wanted, start)
    for name in start:
        nodes.started(name, now)
    nodes.end_change(now)
    return leaving


@pytest.fixture
def nodes():
    managed = ManagedNodes(POLICY)
    change(managed, "first", system("/a", "/b"), ["/a", "/b"])
    for name in ("/a", "/b"):
        managed.inspected(name, {f"{name}/topic"})
    return managed


def test_change_ends_what_the_configuration_lacks_and_what_is_started_anew(nodes):
    assert change(nodes, "second", system("/b", "/c"), ["/c"]) == ["/a"]
    assert nodes.report().nodes == ("/b", "/c")
    assert change(nodes, "third", system("/b", "/c"), ["/c"]) == ["/c"]


def test_node_that_is_kept_runs_on_under_its_new_description(nodes):
    change(nodes, "second", system("/a", respawn=True), [])
    assert nodes.report().dead == ()
    assert nodes.description("/a").respawn


def test_node_that_neither_ran_nor_is_started_does_not_belong_to_the_configuration(nodes):
    change(nodes, "second", system("/a", "/b", "/c"), [])
    assert nodes.report().nodes == ("/a", "/b")


def test_change_that_starts_unknown_nodes_or_relies_on_nodes_that_do_not_run_is_refused(nodes):
    assert nodes.refusal(system("/a", "/c"), ["/c"]) == ""
    assert nodes.refusal(system("/a"), ["/c"]) == "starts no node /c"
    assert nodes.refusal(system("/a", "/c"), []) == "needs /c, which does not run: start it, too"


def test_change_is_told_while_it_is_under_way(nodes):
    nodes.begin_change(system("/c"), ["/c"])
    assert (nodes.report().configuration, nodes.report().state) == ("first", CHANGING)
    nodes.adopt("second", system("/c"), ["/c"])
    assert (nodes.report().configuration, nodes.report().state) == ("second", CHANGING)


def test_nodes_that_a_failed_change_should_have_started_are_forgotten(nodes):
    nodes.begin_change(system("/a", "/c"), ["/c"])
    nodes.adopt("second", system("/a", "/c"), ["/c"])
    nodes.end_change(0.0, failed_to_start=["/c"])
    assert (nodes.report().nodes, nodes.report().state) == (("/a",), STABLE)


def test_node_that_dies_is_started_again_after_the_delay(nodes):
    ending = nodes.ended("/a", 3, 10.0)
    assert ending.verdict is Verdict.RESTART
    assert ending.text == "node /a ended with status 3, 10.0 s after its start: starting it again in 0.5 s"
    assert (nodes.report().state, nodes.report().dead) == (RECOVERING, ("/a",))
    assert nodes.next_restart() == 10.5
    assert nodes.to_restart(10.4) == []
    assert nodes.to_restart(10.5) == ["/a"]
    assert not nodes.recovered()
    nodes.started("/a", 10.5)
    assert nodes.recovered()
    assert (nodes.report().state, nodes.report().dead, nodes.next_restart()) == (STABLE, (), None)


def test_signal_that_ended_a_node_is_named(nodes):
    assert "ended by signal 9," in nodes.ended("/a", -9, 1.0).text


def test_configuration_whose_nodes_die_too_often_is_given_up(nodes):
    for now in (1.0, 2.0):
        assert nodes.ended("/a", 1, now).verdict is Verdict.RESTART
        nodes.started("/a", now)
    ending = nodes.ended("/a", 1, 3.0)
    assert ending.verdict is Verdict.GIVE_UP
    assert ending.text.endswith("3 deaths in 30 s are too many: first is stopped")
    nodes.stopped("/b")
    nodes.given_up()
    assert (nodes.report().state, nodes.report().dead, nodes.next_restart()) == (FAILED, ("/a", "/b"), None)


def test_deaths_of_one_configuration_do_not_count_for_another(nodes):
    for now in (1.0, 2.0):
        nodes.ended("/a", 1, now)
        nodes.started("/a", now)
    change(nodes, "second", system("/a", "/b"), [])
    assert nodes.ended("/a", 1, 3.0).verdict is Verdict.RESTART


def test_deaths_count_on_where_the_same_configuration_is_deployed_again(nodes):
    for now in (1.0, 2.0):
        nodes.ended("/a", 1, now)
        nodes.started("/a", now)
    change(nodes, "first", system("/a", "/b"), ["/a"])
    assert nodes.ended("/a", 1, 3.0).verdict is Verdict.GIVE_UP


def test_restart_that_is_impossible_counts_as_a_death(nodes):
    nodes.ended("/a", 1, 1.0)
    assert nodes.failed_to_restart("/a", "no such file", 1.5).verdict is Verdict.RESTART
    assert nodes.failed_to_restart("/a", "no such file", 2.5).verdict is Verdict.GIVE_UP
    assert "can't be started again: no such file" in nodes.report().message


@pytest.mark.parametrize(
    ("advertised", "respawn", "verdict"),
    [
        ((), False, Verdict.FINISHED),
        (("/rosout", "/a/get_loggers", "/a/set_logger_level"), False, Verdict.FINISHED),  # every rospy node has them
        (("/scan",), False, Verdict.RESTART),
        ((), True, Verdict.RESTART),
    ],
)
def test_only_a_node_without_topics_and_services_may_end_with_status_0(advertised, respawn, verdict):
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", system("/a", respawn=respawn), ["/a"])
    nodes.inspected("/a", advertised)
    assert nodes.ended("/a", 0, 2.0).verdict is verdict
    assert nodes.report().nodes == (() if verdict is Verdict.FINISHED else ("/a",))


def test_node_is_inspected_once_when_it_has_had_time_to_advertise(nodes):
    nodes.started("/a", 5.0)
    assert nodes.to_inspect(5.5) == []
    assert nodes.to_inspect(6.5) == ["/a"]
    nodes.inspected("/a", ())
    assert nodes.to_inspect(9.0) == []


def test_stop_leaves_nothing(nodes):
    nodes.begin_stop()
    nodes.end_stop(1.0)
    report = nodes.report()
    assert (report.configuration, report.state, report.nodes) == ("", STABLE, ())


def test_warm_processes_wait_until_the_new_nodes_have_had_time_for_their_imports(nodes):
    assert not nodes.may_stand_by(0.4)
    assert nodes.may_stand_by(0.6)
    nodes.begin_change(system("/a"), [])
    assert not nodes.may_stand_by(9.0)


def test_warm_process_that_ended_is_replaced():
    assert standby_changes({"a"}, {"a": False}) == (["a"], ["a"])


@given(st.sets(st.sampled_from("abcd")), st.dictionaries(st.sampled_from("abcd"), st.booleans()))
def test_one_warm_process_of_each_wanted_kind_remains(wanted, warm):
    closed, started = standby_changes(wanted, warm)
    left = [kind for kind in warm if kind not in closed] + started
    assert sorted(left) == sorted(wanted)
    assert all(warm[kind] for kind in set(warm) - set(closed))


@given(st.lists(st.sets(st.sampled_from(["/a", "/b", "/c"])), max_size=5), st.data())
def test_after_any_changes_exactly_the_nodes_kept_and_started_run(configurations, data):
    nodes, running = ManagedNodes(POLICY), set()
    for number, wanted in enumerate(configurations):
        start = data.draw(st.sets(st.sampled_from(sorted(wanted)))) if wanted else set()
        leaving = change(nodes, str(number), system(*sorted(wanted)), sorted(start))
        assert set(leaving) == {name for name in running if name in start or name not in wanted}
        running = (running & wanted) | start
        assert set(nodes.report().nodes) == running
        assert nodes.report().dead == ()
