"""The start of a rospy node loses no time in rospy's own waits, and leaves everything as it was."""

import os
import time

import pytest
import rospy.impl.init
from node_kit.ros.quick_start import LOG_CONFIGURATION, POLL_PERIOD, quick_start


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A ROS_HOME and a ROS_ETC_DIR without a logging configuration."""
    for name in ("ROS_HOME", "ROS_ETC_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
        (tmp_path / name / "config").mkdir(parents=True)
    monkeypatch.delenv(LOG_CONFIGURATION, raising=False)
    return tmp_path


def test_rospy_asks_often_whether_it_is_registered(monkeypatch):
    slept = []
    monkeypatch.setattr(time, "sleep", slept.append)
    with quick_start():
        rospy.impl.init.time.sleep(0.1)
    assert slept == [POLL_PERIOD]
    assert rospy.impl.init.time is time


def test_logging_configuration_is_the_one_that_rospy_prefers(home):
    with quick_start():
        assert LOG_CONFIGURATION not in os.environ  # rospy takes that of the package rosgraph
    system, own = home / "ROS_ETC_DIR" / "python_logging.conf", home / "ROS_HOME" / "config" / "python_logging.yaml"
    system.touch()
    with quick_start():
        assert os.environ[LOG_CONFIGURATION] == str(system)
    own.touch()
    with quick_start():
        assert os.environ[LOG_CONFIGURATION] == str(own)
    assert LOG_CONFIGURATION not in os.environ


def test_logging_configuration_of_the_user_is_kept(home, monkeypatch):
    (home / "ROS_ETC_DIR" / "python_logging.conf").touch()
    monkeypatch.setenv(LOG_CONFIGURATION, "/mine.conf")
    with quick_start():
        assert os.environ[LOG_CONFIGURATION] == "/mine.conf"
    assert os.environ[LOG_CONFIGURATION] == "/mine.conf"
