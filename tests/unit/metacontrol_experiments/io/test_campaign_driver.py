"""Runs that crash or hang: recorded with what they said, tried once more, and no harm to the next one."""

import os

import pytest
from metacontrol_experiments.campaign.matrix import Run
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.io.campaign_driver import drive
from metacontrol_experiments.mission.settings import LOG_NAME

MANIFEST = """<package format="2"><name>odd_managers</name><version>0.1.0</version><description>Odd.</description>
<maintainer email="a@example.com">A</maintainer><license>Apache-2.0</license><export>
<metacontrol_experiments manager="aborting" function="odd_managers:aborting"/>
<metacontrol_experiments manager="raising" function="odd_managers:raising"/>
<metacontrol_experiments manager="stumbling" function="odd_managers:stumbling"/>
<metacontrol_experiments manager="hanging" function="odd_managers:hanging"/>
</export></package>"""
MODULE = """
import os, pathlib, time
from metacontrol_experiments.managers.manager import Manager

def aborting(situation):
    os.abort()

def raising(situation):
    raise ValueError("no idea")

def stumbling(situation):
    mark = pathlib.Path(__file__).with_name("stumbled")
    if not mark.exists():
        mark.touch()
        os._exit(7)
    return Manager()

def hanging(situation):
    while True:
        time.sleep(1.0)
"""


@pytest.fixture(autouse=True)
def odd_managers(tmp_path, monkeypatch):
    (tmp_path / "package.xml").write_text(MANIFEST)
    (tmp_path / "odd_managers.py").write_text(MODULE)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}:{os.environ['ROS_PACKAGE_PATH']}")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ['PYTHONPATH']}")
    from metacontrol_experiments.io import campaign_driver

    yield
    campaign_driver._own.child.close()
    campaign_driver._own.child = None


def asked(manager):
    return Run("p", "r1", "f2_v2_r2", 0, 1.0, "none", (), manager, 1, seed=1, timeout=1.0)


def test_process_that_dies_is_tried_once_more_and_the_next_run_is_well():
    result, _ = drive(asked("aborting"), 100.0, keep_log=False)
    assert [attempt.status for attempt in result.attempts] == [Status.CRASHED, Status.CRASHED]
    assert result.attempts[0].problem == "its process ended with status -6" and result.summary is None
    assert "in aborting" in result.attempts[1].log
    result, files = drive(asked("none"), 100.0, keep_log=True)
    assert (result.status, result.summary["outcome"], len(result.attempts)) == (Status.DONE, "timeout", 1)
    assert files[LOG_NAME].startswith(b"3.00 MISSION_START") and result.provenance["versions"].startswith("python 3")


def test_error_is_told_with_its_traceback():
    result, _ = drive(asked("raising"), 100.0, keep_log=False)
    assert result.status is Status.CRASHED and "ValueError: no idea" in result.attempts[-1].problem
    assert "Traceback" in result.attempts[-1].log


def test_run_that_crashed_once_is_done_the_second_time():
    result, _ = drive(asked("stumbling"), 100.0, keep_log=False)
    assert [attempt.status for attempt in result.attempts] == [Status.CRASHED, Status.DONE]
    assert result.summary["outcome"] == "timeout"


def test_run_that_hangs_is_ended_and_tells_where_it_hung():
    result, _ = drive(asked("hanging"), 8.0, keep_log=False)
    assert [attempt.status for attempt in result.attempts] == [Status.HUNG, Status.HUNG]
    assert result.attempts[-1].problem == "no end within 8 s of wall time"
    assert "Fatal Python error: Aborted" in result.attempts[-1].log
