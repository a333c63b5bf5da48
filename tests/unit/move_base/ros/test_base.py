"""The base's commands: none stays in force while nobody checks it."""

import contextlib
import threading
from types import SimpleNamespace

import pytest
import rospy
from helpers.waiting import wait_for
from move_base.ros.base import LONGEST_UNCHECKED, Base
from move_base.ros.messages import twist_of
from robot_formulas.geometry import STOP, Velocity

AHEAD = Velocity(0.5, 0.0, 0.1)


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(rospy, "get_time", lambda: clock.now)
    return clock


@pytest.fixture
def sent(monkeypatch):
    sent = []
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: SimpleNamespace(publish=sent.append))
    return sent


@pytest.fixture
def base(clock, sent):
    return Base(20.0)


@pytest.mark.parametrize(("age", "stops"), [(0.5 * LONGEST_UNCHECKED, False), (1.1 * LONGEST_UNCHECKED, True)])
def test_command_that_is_not_checked_any_more_is_followed_by_a_stop(base, clock, sent, age, stops):
    base.send(AHEAD)
    clock.now += age
    assert base.stop_unchecked() is stops
    assert sent == [twist_of(AHEAD), twist_of(STOP)][: 1 + stops]


def test_stop_is_sent_once(base, clock, sent):
    base.send(AHEAD)
    clock.now += 1.0
    assert base.stop_unchecked()
    clock.now += 1.0
    assert not base.stop_unchecked()
    base.send(STOP)
    clock.now += 1.0
    assert not base.stop_unchecked()


def test_command_from_before_the_clock_was_set_back_is_not_in_force_any_more(base, clock, sent):
    base.send(AHEAD)
    clock.now -= 50.0
    assert base.stop_unchecked()
    assert sent[-1] == twist_of(STOP)


def test_command_that_comes_while_the_watch_waits_stays_in_force(base, clock, sent):
    base.send(AHEAD)

    class Waited(contextlib.AbstractContextManager):
        def __enter__(self):
            clock.now += 0.05
            base._moving_since = clock.now

        def __exit__(self, *_):
            pass

    base._lock = Waited()
    assert not base.stop_unchecked()


def test_watch_stops_the_base_while_the_control_loop_is_at_a_long_step(base, clock, sent, monkeypatch):
    shut_down, seen, warnings = threading.Event(), [], []
    monkeypatch.setattr(rospy, "is_shutdown", lambda: shut_down.is_set() and not seen.append(True))
    monkeypatch.setattr(rospy, "logwarn_throttle", lambda _period, text: warnings.append(text))
    base.send(AHEAD)
    clock.now += 1.0
    base.start_watch()
    wait_for(lambda: warnings, "the base is stopped")
    shut_down.set()
    wait_for(lambda: seen, "the watch ends")
    assert sent == [twist_of(AHEAD), twist_of(STOP)]


def test_slow_controller_keeps_its_commands_for_two_periods(base, clock):
    base.reconfigure(1.0)
    base.send(AHEAD)
    clock.now += 1.9
    assert not base.stop_unchecked()
    clock.now += 0.2
    assert base.stop_unchecked()


def test_last_command_of_a_node_that_ends_is_a_stop(base, sent):
    base.send(AHEAD)
    base.close()
    base.send(AHEAD)
    assert sent == [twist_of(AHEAD), twist_of(STOP)]
