"""What several launchers tell of one function, as the report of one."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.hosts.merging import merged, stale

HERE = LauncherReport("f", "c", 5, STABLE, ("/a", "/shared"))
FAR = LauncherReport("f", "c", 3, STABLE, ("/b",))
BOTH = {"/far", "/here"}


def far(**changes):
    return LauncherReport(**{**FAR.__dict__, **changes})


@given(st.integers(0, 9), st.sampled_from([STABLE, CHANGING, RECOVERING, FAILED]), st.sampled_from(["", "died"]))
def test_one_launcher_is_told_of_as_it_is(change, state, message):
    one = LauncherReport("f", "c", change, state, ("/a", "/b"), ("/b",), message)
    assert merged("f", {"/here": one}) == one
    assert merged("f", {"/here": one}, ["/here"]) == one


def test_nodes_are_united_and_changes_added_up():
    found = merged("f", {"/here": HERE, "/far": FAR}, BOTH)
    assert (found.configuration, found.change, found.state) == ("c", 8, STABLE)
    assert set(found.nodes) == {"/a", "/shared", "/b"}


@pytest.mark.parametrize("state", [CHANGING, RECOVERING, FAILED])
def test_worst_state_counts_with_its_message_and_its_dead(state):
    found = merged("f", {"/here": HERE, "/far": far(state=state, dead=("/b",), message="node /b ended")}, BOTH)
    assert (found.state, found.dead, found.message) == (state, ("/b",), "node /b ended")


def test_launcher_that_lacks_its_part_makes_the_configuration_incomplete():
    assert merged("f", {"/here": HERE, "/far": LauncherReport("f")}, BOTH).configuration == ""
    assert merged("f", {"/here": HERE}, BOTH).configuration == ""
    assert merged("f", {"/here": HERE, "/far": far(configuration="old")}, BOTH).configuration == ""


def test_nodes_of_a_launcher_without_a_part_are_left_out():
    found = merged("f", {"/here": HERE, "/far": far(configuration="old", state=FAILED)}, ["/here"])
    assert (found.configuration, found.state, found.nodes) == ("c", STABLE, HERE.nodes)


def test_lost_host_is_a_failure_with_the_death_of_its_nodes():
    found = merged("f", {"/here": HERE, "/far": FAR}, BOTH, {"/far": "host arm is lost"})
    assert (found.state, found.dead, found.message) == (FAILED, ("/b",), "host arm is lost")
    assert found.configuration == "c"


def test_lost_host_without_a_part_does_not_matter():
    assert merged("f", {"/here": HERE, "/far": FAR}, ["/here"], {"/far": "host arm is lost"}).state == STABLE


def test_function_that_nobody_runs_is_told_of_without_configuration():
    assert merged("f", {"/here": LauncherReport("f", change=2)}) == LauncherReport("f", change=2)
    assert merged("f", {}) == LauncherReport("f")


def test_launcher_that_runs_what_it_should_not_is_stale():
    reports = {"/here": HERE, "/far": FAR, "/idle": LauncherReport("f"), "/busy": far(state=CHANGING)}
    assert stale(reports, ["/here"]) == ["/far"]
    assert stale(reports, BOTH) == []
