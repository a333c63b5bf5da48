"""The launcher's own work in a change, with real processes and a master that is played."""

import signal
from dataclasses import replace

import pytest
from helpers.waiting import wait_for
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io import launcher as module
from rosgraph_launcher.io import node_processes
from rosgraph_launcher.io.launcher import Launcher
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.supervision import LauncherError

PREFIX = "/bin/sh -c 'exec sleep 1000'"


@pytest.fixture
def master(monkeypatch):
    monkeypatch.setattr(module, "advertised", lambda _names: set())
    monkeypatch.setattr(node_processes, "forget_node", lambda _name: None)
    monkeypatch.setattr(node_processes.NodeApi, "answer", lambda _name: None)  # so SIGINT is sent


@pytest.fixture
def reports():
    return []


@pytest.fixture
def launcher(tmp_path, master, reports, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    owner = Launcher(LauncherOptions(mark=f"test {tmp_path}"), reports.append, lambda line: None)
    yield owner
    owner.close()


def nodes(*names):
    description = {"package": "rosgraph_launcher", "executable": "rosgraph_launcher", "launch_prefix": PREFIX}
    return {name: NodeDescription(name, "/", **description) for name in names}


def running(launcher):
    return {name: descriptor for descriptor, name in launcher.pidfds().items()}


def last(reports, function):
    return next(report for report in reports[-1] if report.function == function)


def test_change_starts_keeps_and_ends_processes(launcher, reports):
    launcher.change("f", "first", nodes("/a", "/b"), [], ["/a", "/b"])
    before = running(launcher)
    phases = launcher.change("f", "second", nodes("/b", "/c"), ["/a"], ["/c"])
    after = running(launcher)
    assert set(after) == {"/b", "/c"}
    assert after["/b"] == before["/b"]
    assert list(phases) == ["prepare", "stop", "start"]
    report = last(reports, "f")
    assert (report.configuration, report.state, report.change) == ("second", "STABLE", 2)


def test_functions_run_side_by_side_and_share_nodes(launcher, reports):
    launcher.change("f", "first", nodes("/a", "/shared"), [], ["/a", "/shared"])
    before = running(launcher)
    launcher.change("g", "other", nodes("/shared", "/b"), [], ["/b"])
    launcher.change("f", "second", nodes("/c"), ["/a", "/shared"], ["/c"])
    assert set(running(launcher)) == {"/shared", "/b", "/c"}
    assert running(launcher)["/shared"] == before["/shared"]
    assert last(reports, "g").nodes == ("/shared", "/b")
    assert last(reports, "f").nodes == ("/c",)


def test_release_ends_what_only_the_function_needs(launcher, reports):
    launcher.change("f", "first", nodes("/a", "/shared"), [], ["/a", "/shared"])
    launcher.change("g", "other", nodes("/shared"), [], [])
    launcher.change("f", "", {}, [], [])
    assert set(running(launcher)) == {"/shared"}
    assert (last(reports, "f").configuration, last(reports, "f").nodes) == ("", ())
    launcher.change("g", "", {}, [], [])
    assert running(launcher) == {}


def test_step_may_start_nodes_before_another_one_stops_the_old_ones(launcher):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    launcher.change("f", "second", nodes("/b"), [], ["/b"])
    assert set(running(launcher)) == {"/a", "/b"}
    launcher.change("f", "second", nodes("/b"), ["/a"], [])
    assert set(running(launcher)) == {"/b"}


def test_request_that_cannot_be_carried_out_leaves_the_running_nodes_alone(launcher):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    before = launcher.pidfds()
    with pytest.raises(LauncherError, match="starts no node /z"):
        launcher.change("f", "second", nodes("/b"), ["/a"], ["/z"])
    assert launcher.pidfds() == before


def test_executable_that_is_missing_leaves_the_running_nodes_alone(launcher):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    missing = {"/b": NodeDescription("/b", "/", "rosgraph_launcher", "no_such_executable")}
    with pytest.raises(LauncherError, match="no_such_executable"):
        launcher.change("f", "second", missing, ["/a"], ["/b"])
    assert set(running(launcher)) == {"/a"}


def test_change_that_was_planned_for_a_launcher_with_more_nodes_is_refused(launcher):
    with pytest.raises(LauncherError, match="needs /a, which does not run"):
        launcher.change("f", "second", nodes("/a", "/b"), [], ["/b"])
    assert launcher.pidfds() == {}


def test_change_and_release_go_on_in_a_moment_without_threads(launcher, reports, no_thread):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    left = no_thread()
    launcher.change("f", "second", nodes("/b"), ["/a"], ["/b"])
    assert not left
    assert set(running(launcher)) == {"/b"}
    left = no_thread()
    launcher.change("f", "", {}, [], [])
    assert not left
    assert running(launcher) == {}
    assert last(reports, "f").state == "STABLE"


def test_configuration_is_given_up_in_a_moment_without_threads(launcher, reports, no_thread):
    required = {"/a": replace(nodes("/a")["/a"], required=True), **nodes("/b")}
    launcher.change("f", "first", required, [], ["/a", "/b"])
    left = no_thread()
    launcher._real._running["/a"].signal(signal.SIGKILL)
    wait_for(lambda: launcher.look_after() or not running(launcher), "it is given up")
    assert not left
    assert last(reports, "f").state == "FAILED"


@pytest.mark.parametrize("step", ["ask_to_end", "prepare", "begin", "end"])
@pytest.mark.parametrize("error", [RuntimeError("no thread"), ValueError("no value")])
def test_change_that_fails_for_any_reason_is_over(launcher, reports, failing, step, error):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    failing(launcher._real, step, error, times=1)
    with pytest.raises(LauncherError, match=f"^{type(error).__name__}: {error}$"):
        launcher.change("f", "second", nodes("/b"), ["/a"], ["/b"])
    assert last(reports, "f").state == "STABLE"
    assert "/b" not in running(launcher)


def test_release_that_fails_is_over(launcher, reports, failing):
    launcher.change("f", "first", nodes("/a"), [], ["/a"])
    failing(launcher._real, "ask_to_end", RuntimeError("no thread"), times=1)
    with pytest.raises(LauncherError, match="RuntimeError: no thread"):
        launcher.change("f", "", {}, [], [])
    assert (last(reports, "f").state, last(reports, "f").nodes) == ("STABLE", ())
