"""The ROS shell of a mission: waits for the system, sends the goal, strikes, and says on `mission/event` what it did.

Callbacks only queue what they got; one thread, the caller's, feeds the state machine.
"""

from __future__ import annotations

import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped
from metacontrol_bags import messages
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.record import CostReport, Event, QualityReport
from metacontrol_bags.timeline import Timeline
from metacontrol_msgs.msg import ActiveConfiguration, Decision, FunctionGrounding, MissionEvent
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from node_kit.io.inbox import Inbox
from robot_formulas.geometry import Pose, quaternion_of

from metacontrol_experiments.contingency.contingency import StrikeError
from metacontrol_experiments.io.processes import wait_until
from metacontrol_experiments.mission import mission
from metacontrol_experiments.mission.mission import Action, Strike
from metacontrol_experiments.ros.startup import DECISION_TOPIC, StartError, Startup
from metacontrol_experiments.ros.striker import Striker, serve

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_bags.timeline import Report

    from metacontrol_experiments.cli.display import Display
    from metacontrol_experiments.contingency.contingency import Contingency
    from metacontrol_experiments.io.processes import ProcessTree
    from metacontrol_experiments.mission.mission import State
    from metacontrol_experiments.mission.settings import Settings

MANIPULATOR_TOPIC = "rosgraph_manipulator/active_configuration"

STANDSTILL_S = 20.0
"""A clock that does not move for so many wall seconds means that the simulator is gone."""

TAIL_S = 0.5
"""Simulated seconds that are still recorded after the mission's end."""

_REQUEST_S = 30.0
"""Wall seconds that a call of `contingency/strike` waits for the mission's thread."""


class MissionNode:
    """The node /mission: one mission, from a system that is starting to the event MISSION_END."""

    def __init__(self, settings: Settings, tree: ProcessTree, display: Display, check: Callable[[], None]) -> None:
        """Joins the graph.

        Args:
            settings: the mission.
            tree: the processes of this run; only these may be struck.
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
        self._position: tuple[float, float] | None = None
        self._stable = False
        self._failed: str | None = None
        self._server_seen = False
        self._observed: set[str] = set()  # quality attributes of which a level came in
        self._graph_seen = False  # by the monitor
        self._goal: MoveBaseActionGoal | None = None
        self._began_wall = time.monotonic()
        self._startup = Startup(self._attend)
        self._startup.wait_for_master()
        rospy.init_node("mission", disable_signals=True)
        self._striker = Striker(settings.components, tree.owns)
        self._service = serve(self._on_request, settings.seed)
        self._events = rospy.Publisher("mission/event", MissionEvent, queue_size=10)
        self._goals = rospy.Publisher("move_base/goal", MoveBaseActionGoal, queue_size=5)
        self._cancels = rospy.Publisher("move_base/cancel", GoalID, queue_size=5)
        self._subscribe("amcl_pose", PoseWithCovarianceStamped, self._on_pose)
        self._subscribe(MANIPULATOR_TOPIC, ActiveConfiguration, self._on_configuration)
        self._subscribe("move_base/status", GoalStatusArray, self._on_status)
        self._subscribe("move_base/result", MoveBaseActionResult, self._on_result)
        self._subscribe(DECISION_TOPIC, Decision, self._on_decision)
        self._subscribe("/diagnostics", DiagnosticArray, self._on_diagnostics)

    def wait_ready(self) -> None:
        """Waits until the whole system is up.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """
        wait = self._startup.wait
        wait(lambda: rospy.get_time() > 0, "/clock, from the simulator")
        wait(lambda: self._position is not None, "the robot's pose on amcl_pose")
        wait(lambda: self._stable, f"a STABLE configuration on {MANIPULATOR_TOPIC}")
        wait(lambda: self._server_seen and self._goals.get_num_connections() > 0, "the action server of move_base")
        wait(lambda: self._graph_seen, "the monitor's first look at the graph, on /diagnostics")
        for quality in self._settings.thresholds:
            heard = partial(self._observed.__contains__, quality)
            wait(heard, f"a level of {quality} on /diagnostics, from its observer")
        if self._settings.metacontrol:
            self._startup.wait_for_reasoner()

    def wait_recorded(self, recorder: str) -> None:
        """Waits until the node `recorder` has subscribed to everything that is to be recorded.

        Raises:
            StartError: it has not, in time.
        """
        self._startup.wait_for_recorder(recorder, self._events, self._goals)

    def drive(self) -> State:
        """Sends the goal and sees the mission through; returns its last state.

        Raises:
            mission.MissionError: the goal is no goal from here.
            KeyboardInterrupt: after the mission's end was told.
        """
        self._begin()
        try:
            self._loop()
        except KeyboardInterrupt:
            self._state = mission.interrupt(self._mission, rospy.get_time(), "interrupted")
            self._cancels.publish(self._goal_id)
            self._end()
            raise
        self._end()
        return self._mission

    def close(self) -> None:
        """Leaves the graph."""
        rospy.signal_shutdown("the mission is over")

    @property
    def _mission(self) -> State:
        if self._state is None:
            raise RuntimeError("the mission has not started")
        return self._state

    @property
    def _goal_id(self) -> GoalID:
        if self._goal is None:
            raise RuntimeError("the mission has not started")
        return self._goal.goal_id

    def _attend(self) -> None:
        """Does what is to be done while the system starts.

        Raises:
            StartError: it will not come up.
        """
        self._check()
        self._inbox.drain()
        if self._failed:
            raise StartError(self._failed)

    # The mission

    def _begin(self) -> None:
        if self._position is None:
            raise RuntimeError("the robot's pose is not known yet")
        struck = self._strike_at_start()
        now = rospy.Time.now()
        self._state = mission.start(self._plan, now.to_sec(), *self._position)
        self._goal = self._make_goal(now)
        self._began_wall = time.monotonic()
        self._display.start(now.to_sec())
        values = self._settings.describe() | {"goal_id": self._goal.goal_id.id}
        values["controller_hz"] = str(rospy.get_param("move_base/controller_frequency", 0.0))
        self._publish_event(now, MissionEvent.MISSION_START, self._settings.route.name, values)
        for name, told in struck:
            self._publish_event(now, MissionEvent.PERTURBATION, name, {"share": "0.0000"} | told)
        self._goals.publish(self._goal)

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
            if isinstance(action, Strike):
                self._strike(action.index)
            elif action is Action.RESEND_GOAL:
                self._goals.publish(self._goal)
            elif action is Action.CANCEL_GOAL:
                self._cancels.publish(self._goal_id)

    def _strike(self, index: int) -> None:
        """Lets a contingency of the plan happen; without it the mission is not the one asked for, and ends."""
        try:
            self._strike_now(self._plan.contingencies[index])
        except StrikeError as error:
            self._state = mission.abort(self._mission, rospy.get_time(), f"a contingency could not strike: {error}")

    def _strike_now(self, contingency: Contingency) -> None:
        values = self._striker.strike(contingency, self._way())
        share = {"share": f"{self._state.share if self._state else 0.0:.4f}"}
        self._publish_event(rospy.Time.now(), MissionEvent.PERTURBATION, contingency.event, share | values)

    def _way(self) -> tuple[Pose, Pose]:
        """The route's ends; not where the robot is now, which differs a little from run to run."""
        return self._settings.route.start, self._settings.route.goal

    def _strike_at_start(self) -> list[tuple[str, dict[str, str]]]:
        """Lets happen what is there before the goal is sent; returns the events' names and values.

        Raises:
            StartError: something could not happen.
        """
        due = [entry for entry in self._plan.contingencies if entry.when.at_start]
        try:
            return [(entry.event, self._striker.strike(entry, self._way())) for entry in due]
        except StrikeError as error:
            raise StartError(f"a contingency could not strike: {error}") from error

    def _make_goal(self, now: rospy.Time) -> MoveBaseActionGoal:
        pose = self._settings.route.goal
        goal = MoveBaseActionGoal()
        goal.header.stamp = now
        goal.goal_id = GoalID(stamp=now, id=f"{rospy.get_name()}-1-{now.to_sec():.3f}")
        target = goal.goal.target_pose
        target.header.frame_id, target.header.stamp = "map", now
        target.pose.position.x, target.pose.position.y = pose.x, pose.y
        target.pose.orientation.z, target.pose.orientation.w = quaternion_of(pose.yaw)
        return goal

    def _publish_event(self, stamp: rospy.Time, kind: str, name: str, values: dict[str, str]) -> None:
        message = MissionEvent(kind=kind, name=name, values=[KeyValue(key, value) for key, value in values.items()])
        message.header.stamp = stamp
        self._events.publish(message)
        self._tell(Event(stamp.to_sec(), kind, name, values))

    def _tell(self, report: Report) -> None:
        """Shows what is new in a report, once the mission runs; before, it is only taken note of."""
        entries = self._timeline.tell(report)
        if self._state is not None:
            for entry in entries:
                self._display.entry(entry)

    # Callbacks: the inbox brings them to the mission's thread

    def _subscribe(self, topic: str, kind: type, handler: Callable[[Any], None]) -> None:
        rospy.Subscriber(topic, kind, lambda message: self._inbox.put(partial(handler, message)))

    def _on_request(self, contingency: Contingency) -> None:
        """A call of the service.

        Raises:
            StrikeError: it could not happen.
        """
        try:
            self._inbox.call(partial(self._strike_now, contingency), _REQUEST_S)
        except TimeoutError as error:
            raise StrikeError(f"the mission did not answer within {_REQUEST_S:g} s") from error

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        position = message.pose.pose.position
        if not (math.isfinite(position.x) and math.isfinite(position.y)):
            rospy.logwarn_throttle(5.0, "mission: a pose on amcl_pose is not finite; left out")
            return
        self._position = (position.x, position.y)
        if self._state is not None:
            self._take(mission.on_pose(self._plan, self._mission, rospy.get_time(), *self._position))
            if not self._mission.over:
                self._display.progress(self._mission.share, rospy.get_time(), self._mission.distance_m)

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        reports = messages.configurations(message, rospy.get_time())
        self._stable = bool(reports) and all(report.state == FunctionGrounding.STABLE for report in reports)
        if self._state is None:
            broken = [report for report in reports if report.state == FunctionGrounding.FAILED]
            self._failed = f"the manipulator could not deploy {broken[0].configuration}" if broken else None
        else:
            self._take(mission.on_configuration(self._mission, rospy.get_time(), self._stable))
        for report in reports:
            self._tell(report)

    def _on_status(self, message: GoalStatusArray) -> None:
        self._server_seen = True
        if self._state is None:
            return
        listed = (GoalStatus.of(s.status) for s in message.status_list if s.goal_id.id == self._goal_id.id)
        self._take(mission.on_goal_status(self._mission, rospy.get_time(), next(listed, None)))

    def _on_result(self, message: MoveBaseActionResult) -> None:
        report = messages.result(message, rospy.get_time())
        if self._state is not None and report.id == self._goal_id.id:
            status = GoalStatus.of(message.status.status)
            self._take(mission.on_goal_result(self._mission, report.stamp, status, report.text))

    def _on_decision(self, message: Decision) -> None:
        self._tell(messages.decision(message, rospy.get_time()))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for report in messages.diagnostics(message, rospy.get_time()):
            if isinstance(report, QualityReport) and report.level is not None:
                self._observed.add(report.name)
            self._graph_seen |= not isinstance(report, QualityReport)
            if not isinstance(report, CostReport):
                self._tell(report)
