"""The processes of a run."""

import signal
import subprocess
import sys

import psutil
import pytest
from helpers.waiting import DEADLINE_S
from metacontrol_experiments.io.processes import ProcessTree, wait_until


def test_processes_end_even_when_orphaned_and_stubborn(tmp_path):
    stubborn = (
        "import signal,time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('up', flush=True); time.sleep(1000)"
    )
    parent = (
        "import subprocess, sys; "
        f"subprocess.Popen([sys.executable, '-c', {stubborn!r}], start_new_session=True); print('left', flush=True)"
    )
    tree = ProcessTree({})
    log = tmp_path / "log"
    process = tree.start([sys.executable, "-c", parent], log)
    assert wait_until(lambda: {"up", "left"} <= set(log.read_text().split()), DEADLINE_S)
    process.wait(DEADLINE_S)
    (orphan,) = tree.alive()
    assert tree.owns(orphan.pid)
    tree.close(grace_s=0.5)
    assert tree.alive() == []
    assert not orphan.is_running() or orphan.status() == psutil.STATUS_ZOMBIE


def test_process_of_somebody_else_is_not_owned():
    assert not ProcessTree({}).owns(1)


@pytest.mark.parametrize("ours", [signal.default_int_handler, signal.SIG_IGN], ids=["terminal", "background job"])
def test_stop_interrupts_and_waits(tmp_path, ours):
    former = signal.signal(signal.SIGINT, ours)
    try:
        _stop_interrupts_and_waits(tmp_path)
    finally:
        signal.signal(signal.SIGINT, former)


def _stop_interrupts_and_waits(tmp_path):
    tree = ProcessTree({})
    code = "import time\ntry:\n print('up', flush=True); time.sleep(1000)\nexcept KeyboardInterrupt:\n print('bye')"
    process = tree.start([sys.executable, "-c", code], tmp_path / "log")
    assert wait_until(lambda: "up" in (tmp_path / "log").read_text(), DEADLINE_S)
    assert tree.stop(process, DEADLINE_S)
    assert "bye" in (tmp_path / "log").read_text()


def test_processes_end_in_order_when_the_run_is_killed(tmp_path):
    log = tmp_path / "log"
    code = "import time\ntry:\n print('up', flush=True); time.sleep(1000)\nexcept KeyboardInterrupt:\n print('bye')"
    run = (
        "import pathlib, sys, time; from metacontrol_experiments.io.processes import ProcessTree; "
        f"ProcessTree({{}}).start([sys.executable, '-c', {code!r}], pathlib.Path({str(log)!r})); time.sleep(1000)"
    )
    with subprocess.Popen([sys.executable, "-c", run]) as process:
        assert wait_until(lambda: log.exists() and "up" in log.read_text(), DEADLINE_S)
        process.kill()
    assert wait_until(lambda: "bye" in log.read_text(), DEADLINE_S)
