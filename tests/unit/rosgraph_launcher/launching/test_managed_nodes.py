"""Which nodes a change stops, keeps and starts, and what follows when a node ends."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.contested import ANSWER_TIMEOUT, HOLD
from rosgraph_launcher.launching.managed_nodes import ManagedNodes
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE
from rosgraph_launcher.launching.restarts import RestartPolicy, Verdict

POLICY = RestartPolicy(intensity=2, period=30.0, first_delay=0.5)


def described(*names, **options):
    return {name: NodeDescription(name, "/", "p", "x", **options) for name in names}


def change(nodes, configuration, wanted, start, now=0.0, function="f"):
    """Carry out a change in which every start succeeds; return the nodes that had to end."""
    stop = () if function not in {r.function for r in nodes.reports()} else nodes.report(function).nodes
    stop = [name for name in stop if name not in wanted]
    nodes.ask_for_change(function)
    leaving = nodes.begin_change(function, stop, start)
    for name in leaving:
        nodes.stopped(name)
    nodes.adopt(function, configuration, wanted, stop, start)
    for name in start:
        nodes.started(name, now)
    nodes.end_change(function, now)
    return leaving


@pytest.fixture
def nodes():
    managed = ManagedNodes(POLICY)
    change(managed, "first", described("/a", "/b"), ["/a", "/b"])
    for name in ("/a", "/b"):
        managed.inspected(name, {f"{name}/topic"}, 1.0)
    return managed


def test_change_ends_what_the_configuration_lacks_and_what_is_started_anew(nodes):
    assert change(nodes, "second", described("/b", "/c"), ["/c"]) == ["/a"]
    assert nodes.report("f").nodes == ("/b", "/c")
    assert change(nodes, "third", described("/b", "/c"), ["/c"]) == ["/c"]


def test_node_that_is_kept_runs_on_under_its_new_description(nodes):
    change(nodes, "second", described("/a", respawn=True), [])
    assert nodes.report("f").dead == ()
    assert nodes.description("/a").respawn


def test_node_that_neither_ran_nor_is_started_does_not_belong_to_the_configuration(nodes):
    change(nodes, "second", described("/a", "/b", "/c"), [])
    assert nodes.report("f").nodes == ("/a", "/b")


def test_node_that_has_done_its_work_is_forgotten_with_its_configuration():
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", described("/a", "/b"), ["/a", "/b"])
    nodes.ended("/b", 0, 5.0)
    assert (nodes.names, nodes.needed) == (("/a", "/b"), ("/a",))
    change(nodes, "second", described("/a"), [])  # nobody asks to stop what has ended
    assert nodes.names == ("/a",)


def test_change_that_starts_unknown_nodes_or_relies_on_nodes_that_do_not_run_is_refused(nodes):
    assert nodes.refusal(described("/a", "/c"), ["/c"]) == ""
    assert nodes.refusal(described("/a"), ["/c"]) == "starts no node /c"
    assert nodes.refusal(described("/a", "/c"), []) == "needs /c, which does not run: start it, too"


def test_change_is_told_while_it_is_under_way(nodes):
    nodes.begin_change("f", ["/a", "/b"], ["/c"])
    assert (nodes.report("f").configuration, nodes.report("f").state) == ("first", CHANGING)
    nodes.adopt("f", "second", described("/c"), ["/a", "/b"], ["/c"])
    assert (nodes.report("f").configuration, nodes.report("f").state) == ("second", CHANGING)


def test_nodes_that_a_failed_change_should_have_started_are_forgotten(nodes):
    nodes.begin_change("f", ["/b"], ["/c"])
    nodes.adopt("f", "second", described("/a", "/c"), ["/b"], ["/c"])
    nodes.end_change("f", 0.0, failed_to_start=["/c"])
    assert (nodes.report("f").nodes, nodes.report("f").state) == (("/a",), STABLE)


def test_node_that_dies_is_started_again_after_the_delay(nodes):
    ending = nodes.ended("/a", 3, 10.0)
    assert ending.verdict is Verdict.RESTART
    assert ending.text == "node /a ended with status 3, 10.0 s after its start: starting it again in 0.5 s"
    assert (nodes.report("f").state, nodes.report("f").dead) == (RECOVERING, ("/a",))
    assert nodes.next_restart() == 10.5
    assert nodes.to_restart(10.4) == []
    assert nodes.to_restart(10.5) == ["/a"]
    assert not nodes.recovered()
    nodes.started("/a", 10.5)
    assert nodes.recovered()
    assert (nodes.report("f").state, nodes.report("f").dead, nodes.next_restart()) == (STABLE, (), None)


def test_signal_that_ended_a_node_is_named(nodes):
    assert "ended by signal 9," in nodes.ended("/a", -9, 1.0).text


def test_configuration_whose_nodes_die_too_often_is_given_up(nodes):
    for now in (1.0, 2.0):
        assert nodes.ended("/a", 1, now).verdict is Verdict.RESTART
        nodes.started("/a", now)
    ending = nodes.ended("/a", 1, 3.0)
    assert ending.verdict is Verdict.GIVE_UP
    assert ending.text.endswith("3 deaths in 30 s are too many: first is stopped")
    assert ending.stopped == ("/a", "/b")
    for name in ending.stopped:
        nodes.stopped(name)
    assert (nodes.report("f").state, nodes.report("f").dead, nodes.next_restart()) == (FAILED, ("/a", "/b"), None)
    assert nodes.needed == ()


def test_deaths_of_one_configuration_do_not_count_for_another(nodes):
    for now in (1.0, 2.0):
        nodes.ended("/a", 1, now)
        nodes.started("/a", now)
    change(nodes, "second", described("/a", "/b"), [])
    assert nodes.ended("/a", 1, 3.0).verdict is Verdict.RESTART


def test_deaths_count_on_where_the_same_configuration_is_deployed_again(nodes):
    for now in (1.0, 2.0):
        nodes.ended("/a", 1, now)
        nodes.started("/a", now)
    change(nodes, "first", described("/a", "/b"), ["/a"])
    assert nodes.ended("/a", 1, 3.0).verdict is Verdict.GIVE_UP


def test_restart_that_is_impossible_counts_as_a_death(nodes):
    nodes.ended("/a", 1, 1.0)
    assert nodes.failed_to_restart("/a", "no such file", 1.5).verdict is Verdict.RESTART
    assert nodes.failed_to_restart("/a", "no such file", 2.5).verdict is Verdict.GIVE_UP
    assert "can't be started again: no such file" in nodes.report("f").message


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
    change(nodes, "first", described("/a", respawn=respawn), ["/a"])
    nodes.inspected("/a", advertised, 1.0)
    assert nodes.ended("/a", 0, 2.0).verdict is verdict
    assert nodes.report("f").nodes == (() if verdict is Verdict.FINISHED else ("/a",))


def test_node_whose_name_was_taken_has_not_done_its_work():
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", described("/a"), ["/a"])
    ending = nodes.ended("/a", 0, 0.5, conflict="its name is taken by process 7 (x): end that process")
    assert ending.verdict is Verdict.RESTART
    assert nodes.report("f").state == RECOVERING
    assert nodes.report("f").message == (
        "node /a ended with status 0, 0.5 s after its start: its name is taken by process 7 (x): end that process"
    )


def test_node_that_has_served_before_has_not_done_its_work_when_it_ends_at_once(nodes):
    nodes.ended("/a", 1, 5.0)
    nodes.started("/a", 5.5)
    assert nodes.ended("/a", 0, 5.9).verdict is Verdict.RESTART  # too early for anybody to have looked at it
    change(nodes, "second", described("/a"), ["/a"], now=10.0)
    assert nodes.ended("/a", 0, 10.4).verdict is Verdict.RESTART


def test_function_recovers_only_when_its_node_has_held_its_name_for_a_while(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    nodes.started("/a", 5.5)
    assert nodes.report("f").dead == ()
    assert not nodes.recovered()
    assert nodes.contested == {"/a": "its name is taken by process 7 (x): end that process"}
    nodes.seen("/a", False, 5.6)  # the other one is still there
    nodes.seen("/a", True, 6.0)
    nodes.seen("/a", True, 6.0 + HOLD - 0.1)
    assert not nodes.recovered()
    assert "process 7" in nodes.report("f").message
    nodes.seen("/a", True, 6.0 + HOLD)
    assert nodes.recovered()
    assert (nodes.report("f").state, nodes.contested) == (STABLE, {})


def test_name_that_is_taken_again_after_it_was_held_must_be_held_for_longer(nodes):
    for now, hold in ((10.0, HOLD), (20.0, 2 * HOLD), (120.0, HOLD)):
        nodes.ended("/a", 0, now, conflict="its name is taken by process 7 (x): end that process")
        nodes.started("/a", now + 0.5)
        nodes.seen("/a", True, now + 1.0)
        nodes.seen("/a", True, now + 1.0 + hold - 0.1)
        assert not nodes.recovered()
        nodes.seen("/a", True, now + 1.0 + hold)
        assert nodes.recovered()


def test_node_whose_name_is_taken_again_and_again_is_given_up_with_the_name_of_who_does(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    nodes.started("/a", 5.5)
    nodes.seen("/a", True, 6.0)
    nodes.ended("/a", 0, 6.5)  # nobody could be asked who it was
    nodes.started("/a", 7.0)
    nodes.seen("/a", True, 7.5)
    assert not nodes.recovered(), "it has to hold the name anew"
    nodes.seen("/a", True, 6.0 + HOLD + 0.1)
    assert not nodes.recovered()
    ending = nodes.ended("/a", 0, 9.5)
    assert ending.verdict is Verdict.GIVE_UP
    assert "its name is taken by process 7" in nodes.report("f").message
    assert nodes.contested == {}


def test_change_that_starts_a_contested_node_begins_anew(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    change(nodes, "second", described("/a"), ["/a"], now=6.0)
    assert nodes.contested == {}
    nodes.ended("/a", -9, 8.0)
    nodes.started("/a", 8.5)
    assert nodes.recovered()


def test_node_that_ends_at_once_has_not_done_its_work_where_somebody_else_had_its_name(nodes):
    taken = {"/c": "its name is taken by process 7 (x): end that process", "/b": ""}
    nodes.ask_for_change("f")
    nodes.begin_change("f", ["/a"], ["/c"])
    nodes.stopped("/a")
    nodes.adopt("f", "second", described("/b", "/c"), ["/a"], ["/c"], 10.0, taken)
    nodes.started("/c", 10.0)
    nodes.end_change("f", 10.0)
    assert nodes.report("f").state == STABLE  # the manipulator waits
    assert nodes.ended("/c", 0, 10.4).verdict is Verdict.RESTART  # both have ended, so nobody answers
    assert "process 7" in nodes.report("f").message


def test_respawned_node_may_end_with_status_0_as_often_as_it_likes():
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", described("/a", respawn=True, respawn_delay=2.0), ["/a"])
    for now in range(0, 100, 4):
        assert nodes.ended("/a", 0, now).verdict is Verdict.RESTART
        assert nodes.report("f").state == STABLE
        assert nodes.to_restart(now + 1.9) == []
        assert nodes.to_restart(now + 2.0) == ["/a"]
        nodes.started("/a", now + 2.0)


def test_respawn_delay_is_the_least_delay_after_a_death():
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", described("/a", respawn=True, respawn_delay=2.0), ["/a"])
    assert nodes.ended("/a", 1, 10.0).verdict is Verdict.RESTART
    assert nodes.next_restart() == 12.0


@pytest.mark.parametrize("status", [0, 1, -9])
def test_end_of_a_required_node_fails_its_configuration_at_once(status):
    nodes = ManagedNodes(POLICY)
    change(nodes, "first", described("/a", required=True), ["/a"])
    ending = nodes.ended("/a", status, 3.0)
    assert ending.verdict is Verdict.GIVE_UP
    assert ending.text.endswith("; it is required: first is stopped")


@pytest.fixture
def young():
    """A node that starts at 5 s."""
    managed = ManagedNodes(POLICY)
    change(managed, "first", described("/a"), ["/a"], now=5.0)
    return managed


def test_node_is_inspected_when_it_has_had_time_to_advertise_and_no_more_once_it_has(young):
    assert young.to_inspect(5.5) == []
    assert young.to_inspect(6.5) == ["/a"]
    young.inspected("/a", {"/scan"}, 6.5)
    assert young.to_inspect(1000.0) == []


def test_node_that_advertises_nothing_is_inspected_again_in_growing_gaps(young):
    looks = []
    for now in range(5, 205):
        if young.to_inspect(float(now)):
            looks.append(now - 5)
            young.inspected("/a", (), float(now))
    assert looks == [1, 2, 4, 8, 16, 32, 62, 92, 122, 152, 182]


def test_node_that_advertises_late_has_not_done_its_work_when_it_ends(young):
    young.inspected("/a", (), 6.0)
    young.inspected("/a", {"/detections"}, 7.0)
    young.inspected("/a", (), 99.9)  # it unregisters while it ends
    assert young.ended("/a", 0, 100.0).verdict is Verdict.RESTART


def test_release_leaves_nothing(nodes):
    assert nodes.begin_release("f") == ["/a", "/b"]
    nodes.end_release("f", 1.0)
    assert nodes.names == ()
    report = nodes.report("f")
    assert (report.configuration, report.state, report.nodes) == ("", STABLE, ())


def test_warm_processes_wait_until_the_new_nodes_have_had_time_for_their_imports(nodes):
    assert not nodes.may_stand_by(0.4)
    assert nodes.may_stand_by(0.6)
    nodes.begin_change("f", ["/b"], [])
    assert not nodes.may_stand_by(9.0)


@pytest.fixture
def shared(nodes):
    """Function f with /a and /b, and function g with /b and /c."""
    change(nodes, "other", described("/b", "/c"), ["/c"], function="g")
    nodes.inspected("/c", {"/c/topic"}, 1.0)
    return nodes


def test_shared_node_that_dies_concerns_both_functions(shared):
    shared.ended("/b", 1, 1.0)
    assert [shared.report(name).state for name in "fg"] == [RECOVERING, RECOVERING]
    shared.started("/b", 1.5)
    assert shared.recovered()
    assert [shared.report(name).state for name in "fg"] == [STABLE, STABLE]


def test_node_of_one_function_that_dies_does_not_concern_the_other(shared):
    shared.ended("/a", 1, 1.0)
    assert [shared.report(name).state for name in "fg"] == [RECOVERING, STABLE]


def test_function_that_is_given_up_leaves_the_other_its_nodes(shared):
    for now in (1.0, 2.0):
        shared.ended("/a", 1, now)
        shared.started("/a", now)
    ending = shared.ended("/a", 1, 3.0)
    assert (ending.verdict, ending.stopped) == (Verdict.GIVE_UP, ("/a",))
    shared.stopped("/a")
    assert (shared.report("f").state, shared.report("f").dead) == (FAILED, ("/a",))
    assert (shared.report("g").state, shared.report("g").nodes) == (STABLE, ("/b", "/c"))


def test_shared_node_goes_on_for_the_function_that_has_had_fewer_deaths(shared):
    for now in (1.0, 2.0):
        shared.ended("/a", 1, now)
        shared.started("/a", now)
    ending = shared.ended("/b", 1, 3.0)
    assert (ending.verdict, ending.stopped) == (Verdict.GIVE_UP, ("/a",))
    assert [shared.report(name).state for name in "fg"] == [FAILED, RECOVERING]
    assert shared.to_restart(9.0) == ["/b"]
    shared.stopped("/a")
    shared.started("/b", 9.0)
    shared.ended("/b", 1, 50.0)
    assert shared.report("f").state == FAILED  # what was given up stays so


def test_restart_of_a_shared_node_that_fails_is_tried_again_for_the_other_function(shared):
    for name in shared.begin_change("f", [], ["/b"]):
        shared.stopped(name)
    shared.adopt("f", "first", described("/a", "/b"), [], ["/b"])
    shared.end_change("f", 5.0, failed_to_start=["/b"])
    assert (shared.report("f").nodes, shared.report("g").nodes) == (("/a",), ("/b", "/c"))
    assert shared.report("g").state == RECOVERING
    assert shared.to_restart(5.0) == ["/b"]


def test_change_cannot_rely_on_a_node_that_another_function_has_given_up(shared):
    for now in (1.0, 2.0, 3.0):
        shared.ended("/c", 1, now)
        shared.started("/c", now)
    shared.stopped("/c")
    assert shared.refusal(described("/a", "/c"), []) == "needs /c, which does not run: start it, too"


NODES = ("/a", "/b", "/c")


@given(st.lists(st.tuples(st.sampled_from("fg"), st.sets(st.sampled_from(NODES))), max_size=8), st.data())
def test_after_any_changes_exactly_the_nodes_kept_and_started_run(configurations, data):
    nodes, running, owned = ManagedNodes(POLICY), set(), {"f": set(), "g": set()}
    for number, (function, wanted) in enumerate(configurations):
        others = owned["g" if function == "f" else "f"]
        start = data.draw(st.sets(st.sampled_from(sorted(wanted)))) if wanted else set()
        leaving = change(nodes, str(number), described(*sorted(wanted)), sorted(start), function=function)
        lacking = owned[function] - wanted - others
        assert set(leaving) == (running & start) | lacking
        running = (running - lacking) | start
        owned[function] = wanted & running
        running = owned["f"] | owned["g"]
        assert set(nodes.names) == running
        assert {name for report in nodes.reports() for name in report.nodes} == running
        assert not any(report.dead for report in nodes.reports())


def nodelet(name, args, **options):
    return {name: NodeDescription(name, "/", "nodelet", "nodelet", args, **options)}


@pytest.fixture
def camera():
    managed = ManagedNodes(POLICY)
    wanted = {**nodelet("/m", "manager"), **nodelet("/l1", "load a/B m"), **nodelet("/l2", "load a/C /m")}
    change(managed, "camera", {**wanted, **described("/other")}, [*wanted, "/other"])
    return managed


def test_nodelets_are_loaded_again_with_their_manager_and_that_is_one_death(camera):
    ending = camera.ended("/m", -9, 10.0)
    assert (ending.verdict, ending.stopped) == (Verdict.RESTART, ("/l1", "/l2"))
    assert "starting it again with /l1, /l2 in 0.5 s" in ending.text
    for name in ending.stopped:
        camera.stopped(name)
    assert camera.report("f").dead == ("/m", "/l1", "/l2")
    assert camera.to_restart(10.5) == ["/m", "/l1", "/l2"]
    for name in ("/m", "/l1", "/l2"):
        camera.started(name, 10.5)
    assert camera.ended("/m", -9, 11.0).verdict is Verdict.RESTART  # the policy allows two deaths


def test_only_the_loader_that_died_leaves_a_nodelet_behind(camera):
    camera.ended("/l1", -9, 10.0)
    camera.stopped("/l2")
    assert camera.has_died("/l1")
    assert not camera.has_died("/l2")
    camera.started("/l1", 10.5)
    assert not camera.has_died("/l1")


def test_required_manager_fails_its_configuration(camera):
    wanted = {**nodelet("/m", "manager", required=True), **nodelet("/l1", "load a/B m")}
    change(camera, "other", wanted, list(wanted))
    assert camera.ended("/m", -9, 10.0).verdict is Verdict.GIVE_UP


def test_node_that_does_not_answer_under_its_contested_name_hangs(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    nodes.started("/a", 5.5)
    nodes.seen("/a", False, 6.0)
    assert nodes.hanging(5.5 + ANSWER_TIMEOUT) == []
    assert nodes.hanging(5.6 + ANSWER_TIMEOUT) == ["/a"]
    nodes.seen("/a", True, 36.0)
    assert nodes.hanging(100.0) == []


def test_node_whose_name_nobody_has_taken_does_not_hang(nodes):
    assert nodes.hanging(1000.0) == []


def hang(nodes, after):
    """Let /a be started again after it was ended, and hang; return what follows, and when."""
    nodes.started("/a", after)
    nodes.seen("/a", False, after + 1.0)
    now = after + ANSWER_TIMEOUT + 0.1
    assert nodes.hanging(now) == ["/a"]
    nodes.stopped("/a")
    return nodes.hung("/a", now).verdict, now


def test_node_that_hangs_under_its_contested_name_again_and_again_is_given_up(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    verdicts, now = [], 5.0
    for _ in range(POLICY.intensity + 1):
        verdict, now = hang(nodes, now + 0.5)
        verdicts.append(verdict)
    assert verdicts == [Verdict.RESTART] * POLICY.intensity + [Verdict.GIVE_UP]
    assert nodes.report("f").state == FAILED
    assert "3 times in a row are too many" in nodes.report("f").message


def test_node_that_has_answered_since_begins_to_hang_anew(nodes):
    nodes.ended("/a", 0, 5.0, conflict="its name is taken by process 7 (x): end that process")
    now = 5.0
    for _ in range(2 * POLICY.intensity):
        verdict, now = hang(nodes, now + 0.5)
        assert verdict is Verdict.RESTART
        nodes.started("/a", now)
        nodes.seen("/a", True, now + 1.0)
        nodes.ended("/a", 0, now + 31.0, conflict="its name is taken by process 8 (x): end that process")
        now += 62.0
