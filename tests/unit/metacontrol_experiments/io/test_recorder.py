"""The recorder of a mission: that it ends too early is told, and its bag is not taken for whole."""

import signal
import sys

import pytest
from helpers.waiting import DEADLINE_S
from metacontrol_experiments.io.processes import ProcessTree, RunError, wait_until
from metacontrol_experiments.io.recorder import Recorder

FULL = "\x1b[31m[ERROR] [17957.14]: Less than 64M of space free on disk with x.bag.active. Disabling recording.\x1b[0m"
RECORDS = "open(bag + '.active', 'w').close(); print('up', flush=True); "
WAITS = """
try:
    time.sleep(1000)
except KeyboardInterrupt:
    pass
"""
CLOSES = "import os; os.rename(bag + '.active', bag); "
FAILS = f"print({FULL!r}); {CLOSES} sys.exit(1)"


class Run:
    """A recorder that does what a test says, and what was said of it."""

    def __init__(self, folder):
        self.bag, self.log, self.said = folder / "mission.bag", folder / "recorder.log", []
        self.active = folder / "mission.bag.active"
        self.tree = ProcessTree({})
        self.recorder = Recorder(self.tree, self.bag, self.log, self.said.append)

    def start(self, code):
        self.recorder.start([sys.executable, "-c", f"import sys, time; bag = {str(self.bag)!r}; {code}"])
        assert wait_until(lambda: "up" in self.log.read_text(), DEADLINE_S)

    def wait_ended(self):
        assert wait_until(lambda: bool(self.recorder.ended), DEADLINE_S)


@pytest.fixture
def run(tmp_path):
    made = Run(tmp_path)
    yield made
    made.tree.close()


def test_recorder_that_works_is_stopped_without_a_word(run):
    assert run.recorder.ended == ""
    run.start(RECORDS + WAITS + CLOSES)
    run.recorder.watch()
    run.recorder.stop()
    assert run.bag.exists() and run.said == []


def test_full_disk_is_said_once_and_its_bag_is_refused(run):
    run.start(RECORDS + FAILS)
    assert wait_until(lambda: run.recorder.watch() or run.said, DEADLINE_S)
    run.recorder.watch()
    why = "Less than 64M of space free on disk with x.bag.active. Disabling recording."
    assert run.said == [
        f"the recorder has ended: {why}; the mission goes on, but its bag will not be whole",
    ]
    with pytest.raises(RunError) as error:
        run.recorder.stop()
    assert why in str(error.value) and f"{run.bag} lacks a part of the mission" in str(error.value)


def test_killed_recorder_leaves_what_can_be_indexed_again(run):
    run.start(RECORDS + WAITS)
    (process,) = run.tree.alive()
    process.send_signal(signal.SIGKILL)
    run.wait_ended()
    with pytest.raises(RunError, match=rf"\(signal SIGKILL\): .*`rosbag reindex {run.active}`"):
        run.recorder.stop()


def test_recorder_that_fails_to_close_the_bag_is_told(run):
    run.start(RECORDS + WAITS + FAILS)
    with pytest.raises(RunError, match=r"did not end well \(Less than 64M of space free"):
        run.recorder.stop()


def test_end_without_a_word_is_told_by_its_status_and_log(run):
    run.start("print('up', flush=True)")
    run.wait_ended()
    with pytest.raises(RunError, match=rf"exit status 0, see {run.log}\): there is no {run.bag}"):
        run.recorder.stop()


def test_bag_that_an_earlier_recorder_did_not_close_goes_with_a_word(run):
    run.active.write_text("an hour's work")
    run.start("print('up', flush=True)" + WAITS)
    assert not run.active.exists()
    assert run.said == [f"{run.active}, which the recorder of an earlier run did not close, is deleted"]
