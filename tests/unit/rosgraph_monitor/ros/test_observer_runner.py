"""One observer as the monitor runs it, without a master."""

import io
import threading

import genpy
import pytest
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from helpers.waiting import wait_for
from rosgraph_monitor.observer import Observer
from rosgraph_monitor.observers.safety import SafetyQualityObserver
from rosgraph_monitor.ros.observers import _Runner
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage


class End:
    """A subscriber or publisher that does nothing."""

    def __init__(self, *_, **__):
        pass

    def unregister(self):
        pass


class Clock:
    """Stands for rospy.Rate: a pass of an observer begins when the test says so."""

    def __init__(self):
        self.passes = threading.Semaphore(0)
        self.jumps_back = False

    def sleep(self):
        self.passes.acquire()
        if self.jumps_back:
            self.jumps_back = False
            raise rospy.exceptions.ROSTimeMovedBackwardsException(1.0)


class Topic:
    """/diagnostics: what is published has to be a message."""

    def __init__(self):
        self.told = []

    def publish(self, statuses, _stamp):
        try:
            DiagnosticArray(status=list(statuses)).serialize(io.BytesIO())
        except genpy.SerializationError as error:
            raise rospy.exceptions.ROSSerializationException(str(error)) from error
        self.told += statuses


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    for name in ("Subscriber", "Publisher"):
        monkeypatch.setattr(rospy, name, End)
    monkeypatch.setattr(rospy, "Rate", lambda *_, **__: made)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy, "get_time", lambda: 1.0)
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(1))
    made.lines = []
    monkeypatch.setattr(rospy, "logwarn", lambda text, *values: made.lines.append(text % values))
    return made


@pytest.fixture
def run(clock):
    runners = []

    def begin(observer):
        topic = Topic()
        runners.append(_Runner(observer, topic))
        return runners[-1], topic

    yield begin
    for runner in runners:
        runner.stop()
        clock.passes.release()


class UnprintableError(Exception):
    def __str__(self):
        raise ValueError("no text either")


class OddObserver(Observer):
    """Returns what can't be published, or fails, as long as it is odd."""

    odd, qa_name = None, ""

    def generate_diagnostics(self, now):
        if isinstance(self.odd, Exception):
            raise self.odd
        if self.odd is not None:
            return [DiagnosticStatus(message="QA status", values=[self.odd])]
        return [DiagnosticStatus(message="QA status", values=[KeyValue("comfort", "0.5")])]


@pytest.mark.parametrize(
    "odd",
    [
        KeyValue(1, "0.5"),
        KeyValue(b"comfort", "0.5"),
        KeyValue("comfort", 0.5),
        ValueError("\udcff"),
        UnprintableError(),
    ],
)
def test_observer_that_returns_nonsense_is_evaluated_again_and_the_monitor_goes_on(clock, run, odd):
    observer = OddObserver("OddObserver", 20.0)
    observer.odd = odd
    runner, topic = run(observer)
    clock.passes.release()
    wait_for(lambda: clock.lines, "the error is logged")
    runner.say_stale("observer hangs: \udcff")  # as the main loop does
    observer.odd = None
    clock.passes.release()
    wait_for(lambda: topic.told and topic.told[-1].message == "QA status", lambda: f"it is well again: {topic.told}")
    wait_for(lambda: not runner.hangs_for() and runner._busy_since is None, "it is not busy")


def test_observer_whose_stale_status_is_nonsense_does_not_end_the_main_loop(clock, run):
    observer = OddObserver("OddObserver", 20.0)
    observer.stale = lambda reason: DiagnosticStatus(values=[KeyValue(1, reason)])
    runner, topic = run(observer)
    runner.say_stale("observer hangs")
    assert not topic.told and clock.lines


class Recorder(Observer):
    """Takes note of what it gets."""

    topics = [("odom", Float32), ("/tf_static", TFMessage)]

    def __init__(self, name):
        super().__init__(name)
        self.got, self.evaluated = [], threading.Event()

    def receive(self, topic, msg, now):
        self.got.append((topic, getattr(msg, "data", None)))

    def reset(self):
        self.got.append(("reset", None))

    def generate_diagnostics(self, now):
        self.evaluated.set()
        return []


def test_what_comes_often_does_not_push_out_what_comes_once(clock, run):
    observer = Recorder("Recorder")
    runner, _ = run(observer)
    runner._receive(TFMessage(), ("/tf_static", TFMessage))
    for number in range(150):
        runner._receive(Float32(number), ("odom", Float32))
    clock.passes.release()
    assert observer.evaluated.wait(150.0)
    assert observer.got == [("/tf_static", None), *(("odom", number) for number in range(50, 150))]


def test_messages_of_all_topics_come_in_their_order(clock, run):
    observer = Recorder("Recorder")
    runner, _ = run(observer)
    for number in range(3):
        runner._receive(Float32(number), ("odom", Float32))
        runner._receive(TFMessage(), ("/tf_static", TFMessage))
    clock.passes.release()
    assert observer.evaluated.wait(150.0)
    assert [topic for topic, _ in observer.got] == ["odom", "/tf_static"] * 3


def test_fixed_frames_that_came_before_time_jumped_back_are_known(clock, run):
    mount = TransformStamped()
    mount.header.frame_id, mount.child_frame_id, mount.transform.rotation.w = "base_link", "laser", 1.0
    observer = SafetyQualityObserver()
    runner, topic = run(observer)
    runner._receive(TFMessage([mount]), ("/tf_static", TFMessage))
    clock.jumps_back = True
    clock.passes.release()
    clock.passes.release()
    wait_for(lambda: topic.told, "it is evaluated")
    assert observer._frames.transform("laser", "base_link") is not None
