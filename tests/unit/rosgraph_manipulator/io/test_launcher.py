"""The launcher's own work in a change, with real processes and a master that is played."""

import xml.parsers.expat

import pytest
from rosgraph_manipulator.io import launcher as module
from rosgraph_manipulator.io import node_processes
from rosgraph_manipulator.io.launcher import Launcher, LauncherError
from rosgraph_manipulator.launching.options import LauncherOptions

SLEEPER = "launch-prefix=\"/bin/sh -c 'exec sleep 1000'\" pkg='rosgraph_manipulator' type='rosgraph_launcher'"


class Parses:
    """Counts the parsers that are made, of whatever module."""

    def __init__(self, monkeypatch):
        self.count = 0
        make = xml.parsers.expat.ParserCreate

        def counting(*arguments, **options):
            self.count += 1
            return make(*arguments, **options)

        monkeypatch.setattr(xml.parsers.expat, "ParserCreate", counting)


@pytest.fixture
def server(monkeypatch):
    parameters = {}

    def set_parameters(values, delete=()):
        for name in delete:
            parameters.pop(name, None)
        parameters.update(values)

    monkeypatch.setattr(module, "get_parameters", lambda names: {n: parameters[n] for n in names if n in parameters})
    monkeypatch.setattr(module, "set_parameters", set_parameters)
    monkeypatch.setattr(module, "advertised", lambda _names: set())
    monkeypatch.setattr(node_processes, "forget_node", lambda _name: None)
    monkeypatch.setattr(node_processes.NodeApi, "request_shutdown", lambda _name, _reason: False)  # so SIGINT is sent
    return parameters


@pytest.fixture
def reports():
    return []


@pytest.fixture
def launcher(tmp_path, server, reports, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    owner = Launcher(LauncherOptions(mark=f"test {tmp_path}"), reports.append, lambda line: None)
    yield owner
    owner.close()


def launch_file(folder, *names):
    path = folder / f"{'_'.join(names)}.launch"
    nodes = [f"<node name='{name}' {SLEEPER}><param name='x' value='1'/></node>" for name in names]
    path.write_text(f"<launch>{''.join(nodes)}</launch>")
    return str(path)


def test_change_parses_its_launch_file_once(launcher, tmp_path, monkeypatch):
    first, second = launch_file(tmp_path, "a"), launch_file(tmp_path, "a", "b")
    launcher.change("first", first, [], ["/a"])
    parses = Parses(monkeypatch)
    launcher.change("second", second, [], ["/b"])
    assert parses.count == 1


def test_change_starts_keeps_and_ends_processes(launcher, tmp_path, server, reports):
    launcher.change("first", launch_file(tmp_path, "a", "b"), [], ["/a", "/b"])
    before = {name: descriptor for descriptor, name in launcher.pidfds().items()}
    phases = launcher.change("second", launch_file(tmp_path, "b", "c"), [], ["/c"])
    after = {name: descriptor for descriptor, name in launcher.pidfds().items()}
    assert set(after) == {"/b", "/c"}
    assert after["/b"] == before["/b"]
    assert list(phases) == ["prepare", "stop", "start"]
    assert server == {"/b/x": 1, "/c/x": 1}
    assert (reports[-1].configuration, reports[-1].state, reports[-1].change) == ("second", "STABLE", 2)


def test_file_that_cannot_be_used_leaves_the_running_nodes_alone(launcher, tmp_path):
    launcher.change("first", launch_file(tmp_path, "a"), [], ["/a"])
    before = launcher.pidfds()
    with pytest.raises(LauncherError, match="starts no node /z"):
        launcher.change("second", launch_file(tmp_path, "b"), [], ["/z"])
    assert launcher.pidfds() == before


def test_change_that_was_planned_for_a_launcher_with_more_nodes_is_refused(launcher, tmp_path):
    with pytest.raises(LauncherError, match="needs /a, which does not run"):
        launcher.change("second", launch_file(tmp_path, "a", "b"), [], ["/b"])
    assert launcher.pidfds() == {}


def test_stop_ends_every_process(launcher, tmp_path, reports):
    launcher.change("first", launch_file(tmp_path, "a"), [], ["/a"])
    launcher.change("", "", [], [])
    assert launcher.pidfds() == {}
    assert reports[-1].nodes == ()
