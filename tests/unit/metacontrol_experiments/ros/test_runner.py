"""What becomes of a run whose recorder ends."""

import sys
from types import SimpleNamespace
from unittest import mock

import pytest
from helpers.waiting import DEADLINE_S
from metacontrol_experiments.io.processes import ProcessTree, RunError, wait_until
from metacontrol_experiments.ros import runner

FAILS = "print('[ERROR] [1.0]: disk full')"
WORKS = """
import pathlib, sys, time
try:
    print("up", flush=True)
    time.sleep(1000)
except KeyboardInterrupt:
    pathlib.Path(sys.argv[1]).touch()
"""


class Node:
    """A mission: it waits until its recorder works, or has ended."""

    def __init__(self, check, said, log, waits_for):
        self.check, self.said, self.log, self.waits_for = check, said, log, waits_for
        self.drove = self.closed = self.is_recorded = False

    def start_up(self):
        pass

    def wait_recorded(self, _recorder, _topics):
        self.is_recorded = True
        if self.waits_for == "recorder":
            assert wait_until(lambda: bool(self.check()) or "up" in self.log.read_text(), DEADLINE_S)

    def drive(self):
        assert self.is_recorded, "a mission begins once its recorder receives"
        if self.waits_for == "its end":
            assert wait_until(lambda: bool(self.check()) or len(self.said) > 1, DEADLINE_S)
        self.check()
        self.drove = True

    def close(self):
        self.closed = True


@pytest.fixture
def drive(tmp_path, monkeypatch):
    """Drive a mission with a recorder of this code; return its node, what was said, and the error."""

    def drive(recorder, waits_for="recorder"):
        monkeypatch.setattr(runner, "_record_command", lambda bag, _: [sys.executable, "-c", recorder, str(bag)])
        system = [sys.executable, "-c", WORKS, str(tmp_path / "system")]
        settings = SimpleNamespace(output=tmp_path, topics=("/odom",), launch_command=lambda _: system)
        (tmp_path / "log").mkdir()
        said, nodes, tree = [], [], ProcessTree({})

        def make(_tree, _display, check):
            nodes.append(Node(check, said, tmp_path / "log" / "recorder.log", waits_for))
            return nodes[0]

        error = ""
        try:
            runner._run(settings, mock.Mock(say=said.append), make, tree, 4000, tmp_path / "mission.bag")
        except RunError as caught:
            error = str(caught)
        finally:
            tree.close()
        return nodes[0], said, error

    return drive


def test_mission_with_a_working_recorder_is_driven_without_a_word_of_it(drive):
    node, said, error = drive(WORKS)
    assert node.drove and node.closed and error == ""
    assert [line.split()[0] for line in said] == ["starting", "mission"]


def test_mission_goes_on_when_its_recorder_ends_and_its_bag_is_refused(drive, tmp_path):
    node, said, error = drive(FAILS, waits_for="its end")
    assert node.drove and node.closed
    assert said[1] == "the recorder has ended: disk full; the mission goes on, but its bag will not be whole"
    assert f"the recorder ended before the mission did (disk full): there is no {tmp_path / 'mission.bag'}" in error


def test_recorder_that_does_not_start_ends_the_run_at_once(drive):
    node, _, error = drive(FAILS)
    assert not node.drove and node.closed
    assert error.startswith("the recorder has ended: disk full; see ")
