"""ROS shell of the observers: subscriptions, a thread at a fixed rate of ROS time for each, services."""

from __future__ import annotations

import threading
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import rospy
from metacontrol_msgs.srv import (
    ListObservers,
    ListObserversResponse,
    LoadObserver,
    LoadObserverResponse,
    UnloadObserver,
    UnloadObserverResponse,
)
from node_kit.io.background import in_background

from rosgraph_monitor.observer import ServiceObserver
from rosgraph_monitor.observers import plugins
from rosgraph_monitor.ros.topics import unpacked

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from diagnostic_msgs.msg import DiagnosticStatus
    from ros_model.language.metamodel import RosSystem

    from rosgraph_monitor.observer import Observer
    from rosgraph_monitor.ros.diagnostics import DiagnosticsTopic

_LARGEST_MESSAGE = 1 << 24
_WARNING_PERIOD = 10.0
_INBOX = 100
"""Messages of one topic that wait for an observer's next evaluation; of more, the oldest are dropped."""
_FIRST_AGAIN, _LONGEST_AGAIN = 2.0, 64.0
"""Wall s until an observer that can't start is tried again: at first, and at most. Each wait is twice the last one."""
_PATIENCE = 5.0
_PATIENCE_PERIODS = 5.0
"""Wall s, and periods, that an evaluation may take before the observer counts as hung."""
_BASE = "Observer"


class ObserverHost:
    """Loads, runs and unloads observers, and offers the four services. A failing observer never stops another.

    A plug-in may never return: no code of one runs while `_lock` is held, for which the monitor's main loop waits.
    """

    def __init__(self, diagnostics: DiagnosticsTopic) -> None:
        """Publish statuses on this topic."""
        self._diagnostics = diagnostics
        self._runners: dict[str, _Runner] = {}
        self._system: RosSystem | None = None
        self._lock = threading.Lock()
        self._loading: set[str] = set()
        self._turn = threading.Lock()
        self._waits: dict[str, tuple[float, float]] = {}  # of what is to be started again: when, and after how long
        self._services = (
            rospy.Service("load_observer", LoadObserver, lambda r: LoadObserverResponse(self.load(r.name))),
            rospy.Service("unload_observer", UnloadObserver, lambda r: UnloadObserverResponse(self.unload(r.name))),
            rospy.Service("active_observers", ListObservers, lambda _: self._active()),
            rospy.Service("list_observers", ListObservers, lambda _: self._available()),
        )

    def begin(self, names: Iterable[str]) -> None:
        """Start observers. `supervise` tries those again that can't start, more and more rarely; not unknown ones."""
        for name in names:
            self._waits[name] = 0.0, _FIRST_AGAIN
            self.load(name)

    def load(self, name: str) -> bool:
        """Start an observer. Return False, with a line that says why, if that fails or the observer runs already."""
        with self._lock:
            if name in self._runners or name in self._loading:
                rospy.logwarn("observer %s %s already", name, "runs" if name in self._runners else "is being loaded")
                return False
            self._loading.add(name)
        try:
            observer = self._start(name)
        except plugins.PluginError as error:
            rospy.logerr("%s", error)
            self._waits.pop(name, None)
            return False
        except (Exception, SystemExit) as error:  # a plug-in is somebody else's code
            rospy.logerr("observer %s can't start: %s: %s", name, type(error).__name__, error)
            _, wait = self._waits.get(name, (0.0, 0.0))
            if wait:
                self._waits[name] = time.monotonic() + wait, min(2.0 * wait, _LONGEST_AGAIN)
            return False
        finally:
            with self._lock:
                self._loading.discard(name)
        self._waits.pop(name, None)
        rospy.loginfo("observer %s at %g Hz", name, observer.rate_hz)
        return True

    def unload(self, name: str) -> bool:
        """Stop an observer; False if there is none of that name."""
        self._waits.pop(name, None)
        with self._lock:
            runner = self._runners.pop(name, None)
        if runner is None:
            rospy.logwarn("observer %s does not run", name)
            return False
        runner.stop()
        rospy.loginfo("observer %s unloaded", name)
        return True

    def follow(self, system: RosSystem | None) -> None:
        """Tell all observers which system is active."""
        with self._lock:
            self._system = system
            runners = tuple(self._runners.values())
        for runner in runners:
            runner.follow(system)

    def supervise(self) -> int:
        """Report observers that hang as stale, and return how many observers run. Call it regularly."""
        with self._lock:
            runners = tuple(self._runners.values())
            due = [n for n, (at, _) in self._waits.copy().items() if time.monotonic() >= at and n not in self._loading]
        for name in due:
            in_background(partial(self.load, name), f"load {name}")
        for runner in runners:
            lasted = runner.hangs_for()
            if lasted:
                runner.say_stale(f"observer hangs: its evaluation has been going on for {lasted:.0f} s")
        return len(runners)

    def _start(self, name: str) -> Observer:
        """Make, configure and run the observer whose name is reserved.

        Raises:
            PluginError: there is none, it can't be made, or another one is being made for long.
            Exception: as its code does.
        """
        if not self._turn.acquire(timeout=_PATIENCE):  # importing one gives it modules that another must not see
            raise plugins.PluginError(f"observer {name} is not loaded: another observer is still being loaded")
        try:
            observer = plugins.make(name)
        finally:
            self._turn.release()
        observer.configure(rospy.get_param(f"~{observer.name}", {}))
        system = self._system
        observer.follow(system)
        runner = _Runner(observer, self._diagnostics)
        with self._lock:
            self._runners[name] = runner
            if self._system is not system:
                runner.follow(self._system)
        return observer

    def _active(self) -> ListObserversResponse:
        with self._lock:
            running = {name: type(runner.observer).__mro__[1].__name__ for name, runner in self._runners.items()}
        return ListObserversResponse(types=list(running), base_classes=list(running.values()))

    def _available(self) -> ListObserversResponse:
        found = plugins.available()
        return ListObserversResponse(types=list(found), base_classes=[_BASE] * len(found))


class _Waiting(NamedTuple):
    """A message that waits, with the monotonic s and the ROS time in s at which it came."""

    came: float
    topic: str
    message_class: type
    msg: Any
    received: float


class _Runner:
    """Runs one observer until it is stopped.

    Only its own thread touches the observer. Callbacks of topics and other threads only leave data for it, so they
    never wait for the observer.
    """

    def __init__(self, observer: Observer, diagnostics: DiagnosticsTopic) -> None:
        self.observer = observer
        self._diagnostics = diagnostics
        self._subscribers: dict[tuple[str, type], rospy.Subscriber] = {}
        self._publishers = {
            topic: rospy.Publisher(topic, message_class, queue_size=1) for topic, message_class in observer.outputs
        }
        # One for each topic: what comes often must not push out what comes once, such as /tf_static.
        self._inboxes: dict[tuple[str, type], deque[_Waiting]] = {}
        self._news: deque[RosSystem | None] = deque(maxlen=1)
        self._busy_since: float | None = None
        self._warned = "", 0.0
        self._stopped = threading.Event()
        if isinstance(observer, ServiceObserver):
            observer.client = rospy.ServiceProxy(*observer.service)
        self._subscribe()
        try:
            threading.Thread(target=self._run, name=f"observer {observer.name}", daemon=True).start()
        except RuntimeError:
            self.stop()
            raise

    def stop(self) -> None:
        """End the thread soon, and the subscriptions now."""
        self._stopped.set()
        for end in (*self._subscribers.copy().values(), *self._publishers.values()):
            end.unregister()

    def follow(self, system: RosSystem | None) -> None:
        """Tell the observer which system is active."""
        self._news.append(system)

    def hangs_for(self) -> float:
        """Return the wall s of the present evaluation if it is overdue, else 0."""
        since = self._busy_since
        lasted = 0.0 if since is None else time.monotonic() - since
        return lasted if lasted > max(_PATIENCE, _PATIENCE_PERIODS / self.observer.rate_hz) else 0.0

    def say_stale(self, reason: str) -> None:
        """Publish that the quality attribute is not known now."""
        self._guarded(lambda: self._publish([self.observer.stale(reason)], [], rospy.Time.now()))

    def _run(self) -> None:
        rate = rospy.Rate(self.observer.rate_hz, reset=True)
        while not self._stopped.is_set() and not rospy.is_shutdown():
            try:
                rate.sleep()
            except rospy.exceptions.ROSTimeMovedBackwardsException:
                self._take_waiting()  # what is latched, such as /tf_static, does not come again
                self._guarded(self.observer.reset)
                rate = rospy.Rate(self.observer.rate_hz, reset=True)
                continue
            except rospy.ROSInterruptException:
                return
            if self._stopped.is_set():
                return
            self._busy_since = time.monotonic()
            self._guarded(self._evaluate, rospy.Time.now())
            self._busy_since = None

    def _evaluate(self, now: rospy.Time) -> None:
        while self._news:
            self._guarded(self.observer.follow, self._news.popleft())
        self._take_waiting()
        try:
            self._subscribe()
            statuses = self.observer.evaluate(now.to_sec())
            outputs = self.observer.take_outputs()
            if not self._stopped.is_set():
                self._publish(statuses, outputs, now)
        except (Exception, SystemExit) as error:  # a plug-in is somebody else's code: it must not end the monitor
            if rospy.is_shutdown() or self._stopped.is_set():
                return
            self._warn(error)
            self.say_stale(f"observer fails: {type(error).__name__}: {error}")

    def _guarded(self, call: Callable[..., Any], *arguments: Any) -> None:
        try:
            call(*arguments)
        except (Exception, SystemExit) as error:  # a plug-in is somebody else's code
            self._warn(error)

    def _publish(self, statuses: list[DiagnosticStatus], outputs: list[tuple[str, Any]], now: rospy.Time) -> None:
        try:
            for topic, msg in outputs:
                self._publishers[topic].publish(msg)
            if statuses:
                self._diagnostics.publish(statuses, now)
        except rospy.ROSException:
            if not (rospy.is_shutdown() or self._stopped.is_set()):
                raise

    def _subscribe(self) -> None:
        """Listen to the topics that the observer wants now, and to no others."""
        wanted = list(self.observer.topics)
        for gone in self._subscribers.keys() - set(wanted):
            self._subscribers.pop(gone).unregister()
        for topic, message_class in wanted:
            if (topic, message_class) not in self._subscribers and not self._stopped.is_set():
                self._subscribers[topic, message_class] = rospy.Subscriber(
                    topic,
                    message_class,
                    self._receive,
                    (topic, message_class),
                    queue_size=1,
                    buff_size=_LARGEST_MESSAGE,
                    tcp_nodelay=True,
                )

    def _receive(self, msg: Any, whence: tuple[str, type]) -> None:
        waiting = _Waiting(time.monotonic(), *whence, msg, rospy.get_time())
        self._inboxes.setdefault(whence, deque(maxlen=_INBOX)).append(waiting)

    def _take_waiting(self) -> None:
        """Give the observer the messages that have come, in their order."""
        waiting = [inbox.popleft() for inbox in tuple(self._inboxes.values()) for _ in range(len(inbox))]
        for _, *message in sorted(waiting, key=lambda one: one.came):
            self._guarded(self._take, *message)

    def _take(self, topic: str, message_class: type, msg: Any, received: float) -> None:
        self.observer.receive(topic, unpacked(msg, message_class), received)

    def _warn(self, error: BaseException) -> None:
        """Log an error; repeat errors of the same kind only rarely.

        rospy's own throttling confuses observers that fail alternately.
        """
        kind, now = type(error).__name__, time.monotonic()
        if kind != self._warned[0] or now - self._warned[1] >= _WARNING_PERIOD:
            self._warned = kind, now
            rospy.logwarn("observer %s fails: %s: %s", self.observer.name, kind, error)
