"""The ROS shell of a mission: it waits for the system, sends the goal, injects contingencies, and publishes events.

Callbacks only queue what they get; one thread, the caller's, feeds the state machine.
"""

from __future__ import annotations

import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import rospy
from actionlib_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped
from metacontrol_bags import messages
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.record import CostReport, Event, QualityReport
from metacontrol_bags.timeline import Timeline
from metacontrol_msgs.msg import ActiveConfiguration, Decision, MissionEvent
from move_base_msgs.msg import MoveBaseActionResult
from node_kit.io.inbox import Inbox
from robot_formulas.geometry import Pose

from metacontrol_experiments.contingency.contingency import InjectionError
from metacontrol_experiments.io.processes import wait_until
from metacontrol_experiments.mission import mission
from metacontrol_experiments.mission.mission import Action, Inject
from metacontrol_experiments.mission.readiness import Readiness
from metacontrol_experiments.ros.fault_injection import FaultInjector, Injected, serve
from metacontrol_experiments.ros.goal import MissionGoal
from metacontrol_experiments.ros.startup import DECISION_TOPIC, StartError, Startup

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_bags.timeline import Report

    from metacontrol_experiments.contingency.contingency import Contingency
    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.io.processes import ProcessTree
    from metacontrol_experiments.mission.mission import State
    from metacontrol_experiments.mission.settings import Settings

STANDSTILL_S = 20.0
"""A clock that does not move for so many wall seconds means that the simulator is gone."""

TAIL_S = 0.5
"""Simulated seconds that are still recorded after the mission's end."""

_REQUEST_S = 30.0
"""Wall seconds that a call of `contingency/strike` waits for the mission's thread."""


class MissionNode:
    """The node /mission: one mission, from a system that is starting to the event MISSION_END."""

    def __init__(self, settings: Settings, tree: ProcessTree, display: Display, check: Callable[[], None]) -> None:
        """Join the graph.

        Args:
            settings: the mission.
            tree: the processes of this run; only these may be signalled.
            display: where the timeline is shown.
            check: raises an error when the launched system has ended.

        Raises:
            StartError: the master did not come up in time, or does not run on simulated time.
        """
        self._settings = settings
        self._display = display
        self._check = check
        self._plan = settings.plan
        self._state: State | None = None
        self._timeline = Timeline(settings.thresholds)
        self._inbox = Inbox()
        self._readiness = Readiness()
        self._position: tuple[float, float] | None = None
        self._began_wall = time.monotonic()
        self._startup = Startup(self._attend)
        self._startup.wait_for_master()
        rospy.init_node("mission", disable_signals=True)
        self._injector = FaultInjector(settings.components, tree.owns)
        self._service = serve(self._on_request, settings.seed)
        self._events = rospy.Publisher("mission/event", MissionEvent, queue_size=10)
        self._goal = MissionGoal()
        self._subscribe("amcl_pose", PoseWithCovarianceStamped, self._on_pose)
        self._subscribe("rosgraph_manipulator/active_configuration", ActiveConfiguration, self._on_configuration)
        self._subscribe("move_base/status", GoalStatusArray, self._on_status)
        self._subscribe("move_base/result", MoveBaseActionResult, self._on_result)
        self._subscribe(DECISION_TOPIC, Decision, self._on_decision)
        self._subscribe("/diagnostics", DiagnosticArray, self._on_diagnostics)

    def wait_ready(self) -> None:
        """Wait until the whole system is up.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """
        self._startup.wait(lambda: rospy.get_time() > 0, "/clock, from the simulator")
        for condition, what in self._readiness.conditions(self._settings.thresholds):
            self._startup.wait(condition, what)
        self._startup.wait(lambda: self._goal.is_heard, "the action server of move_base")
        if self._settings.decider:
            self._startup.wait_for_decider(self._settings.decider)

    def wait_recorded(self, recorder: str) -> None:
        """Wait until the node `recorder` has subscribed to everything that is to be recorded.

        Raises:
            StartError: it has not, in time.
        """
        self._startup.wait_for_recorder(recorder, self._events, self._goal.publisher)

    def drive(self) -> State:
        """Send the goal, follow the mission to its end, and return its last state.

        Raises:
            mission.MissionError: the goal is no goal from here.
            KeyboardInterrupt: after the end of the mission was published.
        """
        self._begin()
        try:
            self._loop()
        except KeyboardInterrupt:
            self._state = mission.interrupt(self._mission, rospy.get_time(), "interrupted")
            self._goal.cancel()
            self._end()
            raise
        self._end()
        return self._mission

    def close(self) -> None:
        """Leave the graph."""
        rospy.signal_shutdown("the mission is over")

    @property
    def _mission(self) -> State:
        if self._state is None:
            raise RuntimeError("the mission has not started")
        return self._state

    def _attend(self) -> None:
        """Do what is due while the system starts.

        Raises:
            StartError: it will not come up.
        """
        self._check()
        self._inbox.drain()
        if self._readiness.failed:
            raise StartError(self._readiness.failed)

    # The mission

    def _begin(self) -> None:
        if self._position is None:
            raise RuntimeError("the robot's pose is not known yet")
        now = rospy.Time.now()  # before what happens at the start: the system may adapt to it at once
        injected = self._inject_at_start()
        self._state = mission.start(self._plan, now.to_sec(), *self._position)
        self._goal.make(self._settings.route.goal, now)
        self._began_wall = time.monotonic()
        self._display.start(now.to_sec())
        values = self._settings.describe() | {"goal_id": self._goal.id}
        values["controller_hz"] = str(rospy.get_param("move_base/controller_frequency", 0.0))
        self._publish_event(now, MissionEvent.MISSION_START, self._settings.route.name, values)
        for contingency, told in injected:
            self._publish_perturbation(contingency, told, 0.0)
        self._goal.send()

    def _loop(self) -> None:
        clock, moved = rospy.get_time(), time.monotonic()
        while not self._mission.over:
            self._inbox.drain(0.05)
            now = rospy.get_time()
            if now != clock:
                clock, moved = now, time.monotonic()
            elif time.monotonic() - moved > STANDSTILL_S:
                self._state = mission.abort(self._mission, now, "the simulated clock stands still")
            self._take(mission.on_time(self._plan, self._mission, now))
            try:
                self._check()
            except StartError as error:
                self._state = mission.abort(self._mission, now, str(error))

    def _end(self) -> None:
        state = self._mission
        stamp = rospy.Time.from_sec(state.ended_s if state.ended_s is not None else rospy.get_time())
        values = {
            "outcome": state.outcome.value if state.outcome else "unknown",
            "reason": state.reason,
            "share": f"{state.share:.4f}",
            "distance_m": f"{state.distance_m:.3f}",
            "wall_duration_s": f"{time.monotonic() - self._began_wall:.3f}",
        }
        self._publish_event(stamp, MissionEvent.MISSION_END, self._settings.route.name, values)
        wait_until(lambda: rospy.get_time() > stamp.to_sec() + TAIL_S, 2.0)

    def _take(self, step: mission.Step) -> None:
        self._state, actions = step
        for action in actions:
            if isinstance(action, Inject):
                self._inject(action.index)
            elif action is Action.RESEND_GOAL:
                self._goal.send()
            elif action is Action.CANCEL_GOAL:
                self._goal.cancel()

    def _inject(self, index: int) -> None:
        """Inject a contingency of the plan; where that fails, the mission is not the one asked for, and ends."""
        try:
            self._inject_now(self._plan.contingencies[index])
        except InjectionError as error:
            self._state = mission.abort(self._mission, rospy.get_time(), f"a contingency could not strike: {error}")

    def _inject_now(self, contingency: Contingency) -> None:
        injected = self._injector.inject(contingency, self._way())
        self._publish_perturbation(contingency, injected, self._mission.share)

    def _way(self) -> tuple[Pose, Pose]:
        """Return the ends of the route; where the robot is now differs a little from run to run."""
        return self._settings.route.start, self._settings.route.goal

    def _inject_at_start(self) -> list[tuple[Contingency, Injected]]:
        """Inject the contingencies of the start, and return them with what their events tell.

        Raises:
            StartError: something could not happen.
        """
        due = [entry for entry in self._plan.contingencies if entry.when.at_start]
        try:
            return [(entry, self._injector.inject(entry, self._way())) for entry in due]
        except InjectionError as error:
            raise StartError(f"a contingency could not strike: {error}") from error

    def _publish_perturbation(self, contingency: Contingency, injected: Injected, share: float) -> None:
        """Publish that a contingency happened, at a share of the way."""
        values = {"share": f"{share:.4f}"} | injected.values
        self._publish_event(injected.stamp, MissionEvent.PERTURBATION, contingency.event, values)

    def _publish_event(self, stamp: rospy.Time, kind: str, name: str, values: dict[str, str]) -> None:
        message = MissionEvent(kind=kind, name=name, values=[KeyValue(key, value) for key, value in values.items()])
        message.header.stamp = stamp
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

    def _on_request(self, contingency: Contingency) -> None:
        """Answer a call of the service.

        Raises:
            InjectionError: it could not happen.
        """
        try:
            self._inbox.call(partial(self._inject_now, contingency), _REQUEST_S)
        except TimeoutError as error:
            raise InjectionError(f"the mission did not answer within {_REQUEST_S:g} s") from error

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        position = message.pose.pose.position
        if not (math.isfinite(position.x) and math.isfinite(position.y)):
            rospy.logwarn_throttle(5.0, "mission: a pose on amcl_pose is not finite; left out")
            return
        self._position = (position.x, position.y)
        self._readiness.located = True
        if self._state is not None:
            self._take(mission.on_pose(self._plan, self._mission, rospy.get_time(), *self._position))
            if not self._mission.over:
                self._display.progress(self._mission.share, rospy.get_time(), self._mission.distance_m)

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        reports = messages.configurations(message, rospy.get_time())
        self._readiness.take_configurations(reports)
        if self._state is not None:
            self._take(mission.on_configuration(self._mission, rospy.get_time(), self._readiness.stable))
        for report in reports:
            self._tell(report)

    def _on_status(self, message: GoalStatusArray) -> None:
        self._readiness.has_server = True
        if self._state is not None:
            self._take(mission.on_goal_status(self._mission, rospy.get_time(), self._goal.status_in(message)))

    def _on_result(self, message: MoveBaseActionResult) -> None:
        report = messages.result(message, rospy.get_time())
        if self._state is not None and report.id == self._goal.id:
            status = GoalStatus.of(message.status.status)
            self._take(mission.on_goal_result(self._mission, report.stamp, status, report.text))

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
