"""The node /mission: what the missions of all demonstrators have in common.

Callbacks only queue what they get; one thread, the caller's, feeds the state machine.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import rospy
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from metacontrol_bags import messages
from metacontrol_bags.record import CostReport, Event, QualityReport
from metacontrol_bags.timeline import Timeline
from metacontrol_msgs.msg import ActiveConfiguration, Decision, MissionEvent
from node_kit.io.forgiving_logs import forgive
from node_kit.io.inbox import Inbox
from node_kit.ros.connections import connect_to_all
from node_kit.ros.handshakes import greet_apart
from node_kit.ros.rosout_parameter import read_rosout_parameter

from metacontrol_experiments.io.processes import wait_until
from metacontrol_experiments.mission.clock import SteadyClock
from metacontrol_experiments.mission.readiness import Readiness
from metacontrol_experiments.ros.startup import DECISION_TOPIC, StartError, Startup

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from metacontrol_bags.timeline import Report

    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.ros.goal import MissionGoal

STANDSTILL_S = 20.0
"""A clock that does not move for so many wall seconds means that the simulator is gone."""

TAIL_S = 0.5
"""Simulated seconds that are still recorded after the mission's end."""


State = TypeVar("State")


class MissionNode(ABC, Generic[State]):
    """One mission, from a system that is starting to the event MISSION_END; its state machine has a State."""

    def __init__(self, display: Display, check: Callable[[], None], thresholds: dict[str, float], decider: str) -> None:
        """Join the graph.

        Args:
            display: where the timeline is shown.
            check: raises an error when the launched system ends.
            thresholds: QA name -> level that must not be exceeded.
            decider: name of the node that decides; empty for the baseline.

        Raises:
            StartError: the master did not come up in time, or does not run on simulated time.
        """
        self._state: State | None = None  # None before the mission has begun
        self._display = display
        self._check = check
        self._decider = decider
        self._timeline = Timeline(thresholds)
        self._inbox = Inbox()
        self._readiness = Readiness()
        self._clock = SteadyClock()
        self._began_wall = time.monotonic()
        self._startup = Startup(self._attend)
        self._startup.wait_for_master()
        connect_to_all()
        rospy.init_node("mission", disable_signals=True)
        read_rosout_parameter()
        forgive()
        greet_apart()
        self._events = rospy.Publisher("mission/event", MissionEvent, queue_size=10)
        self._goal = self._make_goal()
        self._subscribe("rosgraph_manipulator/active_configuration", ActiveConfiguration, self._on_configuration)
        self._subscribe(DECISION_TOPIC, Decision, self._on_decision)
        self._subscribe("/diagnostics", DiagnosticArray, self._on_diagnostics)

    # What a mission of one kind adds

    @abstractmethod
    def start_up(self) -> None:
        """Wait until the whole system is up.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """

    @property
    def state(self) -> State:
        """The mission's; only once it has begun."""
        if self._state is None:
            raise RuntimeError("the mission has not started")
        return self._state

    @property
    @abstractmethod
    def is_over(self) -> bool:
        """Whether the mission is over."""

    @abstractmethod
    def _make_goal(self) -> MissionGoal:
        """Return the goal, not yet sent."""

    @abstractmethod
    def _begin(self) -> None:
        """Publish MISSION_START and send the goal."""

    @abstractmethod
    def _advance(self, now: float) -> None:
        """Take in the time."""

    def _follow_jump(self, now: float, by: float) -> None:
        """Take in that the time has jumped, by so many s, to `now`; a mission that waits for nothing need not."""

    @abstractmethod
    def _give_up(self, now: float, reason: str, *, interrupted: bool) -> None:
        """End the mission for a reason from outside."""

    @abstractmethod
    def _ending(self) -> tuple[float | None, str, dict[str, str]]:
        """Return when the mission was over, its name, and what MISSION_END tells."""

    # The mission

    def wait_ready(self, thresholds: Collection[str], server: str) -> None:
        """Wait until the whole system is up.

        Args:
            thresholds: qualities of which a level has to come in.
            server: the action's server, in words.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """
        self._startup.wait(lambda: rospy.get_time() > 0, "/clock, from the simulator")
        for condition, what in self._readiness.conditions(thresholds, server):
            self._startup.wait(condition, what)
        self._startup.wait(lambda: self._goal.is_heard, server)
        if self._decider:
            self._startup.wait_for_decider(self._decider)

    def wait_recorded(self, recorder: str, topics: Collection[str]) -> None:
        """Wait until the node `recorder` receives all that comes on these topics.

        Raises:
            StartError: it has not, in time.
        """
        self._startup.wait_for_recorder(recorder, topics, self._events, self._goal.publisher)

    def drive(self) -> None:
        """Send the goal and follow the mission to its end.

        Raises:
            MissionError: the goal is no goal from here.
            KeyboardInterrupt: after the end of the mission was published; so any other error on the way.
        """
        self._begin()
        try:
            self._loop()
        except BaseException as error:  # the robot is not to drive on, whatever it is
            interrupted = isinstance(error, KeyboardInterrupt)
            reason = "interrupted" if interrupted else " ".join(f"{type(error).__name__}: {error}".split())
            self._give_up(self._now(), reason, interrupted=interrupted)
            with _unless_shut_down():
                self._goal.cancel()
            self._end()
            raise
        self._end()

    def close(self) -> None:
        """Leave the graph."""
        rospy.signal_shutdown("the mission is over")

    def _attend(self) -> None:
        """Do what is due while the system starts.

        Raises:
            StartError: it will not come up.
        """
        self._check()
        self._inbox.drain()
        if self._readiness.failed:
            raise StartError(self._readiness.failed)

    def _loop(self) -> None:
        clock, moved = rospy.get_time(), time.monotonic()
        while not self.is_over:
            self._inbox.drain(0.05)
            if rospy.is_shutdown():
                self._give_up(self._now(), "another node has taken the mission's name", interrupted=False)
            now = rospy.get_time()
            if now != clock:
                clock, moved = now, time.monotonic()
            elif time.monotonic() - moved > STANDSTILL_S:
                self._give_up(self._now(), "the simulated clock stands still", interrupted=False)
            moment = self._now()
            if by := self._clock.take_jump():
                self._follow_jump(moment, by)
            self._advance(moment)
            try:
                self._check()
            except StartError as error:
                self._give_up(self._now(), str(error), interrupted=False)

    def _now(self) -> float:
        """Return the ROS time, s, but for a jump that does not last."""
        return self._clock.believe(rospy.get_time(), time.monotonic())

    def _end(self) -> None:
        ended, name, values = self._ending()
        stamp = rospy.Time.from_sec(ended if ended is not None else self._now())
        values |= {"wall_duration_s": f"{time.monotonic() - self._began_wall:.3f}"}
        self._publish_event(stamp, MissionEvent.MISSION_END, name, values)
        wait_until(lambda: rospy.get_time() > stamp.to_sec() + TAIL_S, 2.0)

    def _publish_event(self, stamp: rospy.Time, kind: str, name: str, values: dict[str, str]) -> None:
        message = MissionEvent(kind=kind, name=name, values=[KeyValue(key, value) for key, value in values.items()])
        message.header.stamp = stamp
        with _unless_shut_down():
            self._events.publish(message)
        self._tell(Event(stamp.to_sec(), kind, name, values))

    def _tell(self, report: Report) -> None:
        """Show what is new in a report; before the mission runs, only take note of it."""
        entries = self._timeline.tell(report)
        if self._state is not None:
            for entry in entries:
                self._display.entry(entry)

    # Callbacks: the inbox brings them to the mission's thread

    def _subscribe(self, topic: str, kind: type, handler: Callable[[Any], None]) -> None:
        rospy.Subscriber(topic, kind, lambda message: self._inbox.put(partial(handler, message)))

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        reports = messages.configurations(message, rospy.get_time())
        self._readiness.take_configurations(reports)
        for report in reports:
            self._tell(report)

    def _on_decision(self, message: Decision) -> None:
        self._tell(messages.decision(message, rospy.get_time()))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        publisher = message._connection_header.get("callerid", "")
        for report in messages.diagnostics(message, rospy.get_time(), rospy.get_namespace(), publisher):
            if isinstance(report, QualityReport) and report.level is not None:
                self._readiness.observed.add(report.name)
            self._readiness.has_graph |= not isinstance(report, QualityReport)
            if not isinstance(report, CostReport):
                self._tell(report)


@contextmanager
def _unless_shut_down() -> Iterator[None]:
    """Leave out what can't be published because the node was shut down: another one may have taken its name."""
    try:
        yield
    except rospy.ROSException:
        if not rospy.is_shutdown():
            raise
