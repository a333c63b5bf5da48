"""The ROS shell of a navigation mission: the robot is sent to a goal, and contingencies strike on the way."""

from __future__ import annotations

import math
import time
from functools import partial
from typing import TYPE_CHECKING

import rospy
from actionlib_msgs.msg import GoalStatusArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from metacontrol_bags import messages
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_msgs.msg import ActiveConfiguration, MissionEvent
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from robot_formulas.geometry import Pose, quaternion_of

from metacontrol_experiments.contingency.contingency import InjectionError
from metacontrol_experiments.mission import mission
from metacontrol_experiments.mission.mission import Action, Inject, State
from metacontrol_experiments.ros.fault_injection import FaultInjector, Injected, serve
from metacontrol_experiments.ros.goal import MissionGoal
from metacontrol_experiments.ros.mission_node import MissionNode
from metacontrol_experiments.ros.startup import StartError

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_experiments.contingency.contingency import Contingency
    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.io.processes import ProcessTree
    from metacontrol_experiments.mission.settings import Settings

_REQUEST_S = 30.0
"""Wall seconds that a call of `contingency/strike` waits for the mission's thread."""
_SERVER = "the action server of move_base"


class NavigationMission(MissionNode[State]):
    """A mission of D2."""

    def __init__(self, settings: Settings, tree: ProcessTree, display: Display, check: Callable[[], None]) -> None:
        """Join the graph.

        Args:
            settings: the mission.
            tree: the processes of this run; only these may be signalled.
            display: where the timeline is shown.
            check: raises an error when the launched system ends.

        Raises:
            StartError: the master did not come up in time, or does not run on simulated time.
        """
        self._settings = settings
        self._plan = settings.plan
        self._position: tuple[float, float] | None = None
        super().__init__(display, check, settings.thresholds, settings.decider)
        self._injector = FaultInjector(settings.components, tree.owns)
        self._service = serve(self._on_request, settings.seed)
        self._subscribe("amcl_pose", PoseWithCovarianceStamped, self._on_pose)
        self._subscribe("move_base/status", GoalStatusArray, self._on_status)
        self._subscribe("move_base/result", MoveBaseActionResult, self._on_result)

    @property
    def is_over(self) -> bool:
        """Whether the mission is over."""
        return self.state.over

    def start_up(self) -> None:
        """Wait until the whole system is up.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """
        self._startup.wait(lambda: self._position is not None, "the robot's pose on amcl_pose")
        self.wait_ready(self._settings.thresholds, _SERVER)

    def _make_goal(self) -> MissionGoal:
        return MissionGoal("move_base", MoveBaseActionGoal)

    def _begin(self) -> None:
        if self._position is None:
            raise RuntimeError("the robot's pose is not known yet")
        now = rospy.Time.now()  # before what happens at the start: the system may adapt to it at once
        injected = self._inject_at_start()
        self._state = mission.start(self._plan, now.to_sec(), *self._position)
        target = self._goal.make(now).target_pose
        goal = self._settings.route.goal
        target.header.frame_id, target.header.stamp = "map", now
        target.pose.position.x, target.pose.position.y = goal.x, goal.y
        target.pose.orientation.z, target.pose.orientation.w = quaternion_of(goal.yaw)
        self._began_wall = time.monotonic()
        self._display.start(now.to_sec())
        values = self._settings.describe() | {"goal_id": self._goal.id}
        values["controller_hz"] = str(rospy.get_param("move_base/controller_frequency", 0.0))
        self._publish_event(now, MissionEvent.MISSION_START, self._settings.route.name, values)
        for contingency, told in injected:
            self._publish_perturbation(contingency, told, 0.0)
        self._goal.send()

    def _advance(self, now: float) -> None:
        self._take(mission.on_time(self._plan, self.state, now))

    def _follow_jump(self, now: float, by: float) -> None:
        self._state = mission.on_jump(self.state, now, by)

    def _give_up(self, now: float, reason: str, *, interrupted: bool) -> None:
        end = mission.interrupt if interrupted else mission.abort
        self._state = end(self.state, now, reason)

    def _ending(self) -> tuple[float | None, str, dict[str, str]]:
        state = self.state
        values = {
            "outcome": state.outcome.value if state.outcome else "unknown",
            "reason": state.reason,
            "share": f"{state.share:.4f}",
            "distance_m": f"{state.distance_m:.3f}",
        }
        return state.ended_s, self._settings.route.name, values

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
            self._state = mission.abort(self.state, self._now(), f"a contingency could not strike: {error}")

    def _inject_now(self, contingency: Contingency) -> None:
        injected = self._injector.inject(contingency, self._way())
        self._publish_perturbation(contingency, injected, self.state.share)

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

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        super()._on_configuration(message)
        if self._state is not None:
            self._take(mission.on_configuration(self._state, self._now(), self._readiness.stable))

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
        if self._state is not None:
            self._take(mission.on_pose(self._plan, self.state, self._now(), *self._position))
            if not self.state.over:
                self._display.progress(self.state.share, self._now(), f"{self.state.distance_m:4.1f} m")

    def _on_status(self, message: GoalStatusArray) -> None:
        self._readiness.has_server = True
        if self._state is not None:
            self._take(mission.on_goal_status(self.state, self._now(), self._goal.status_in(message)))

    def _on_result(self, message: MoveBaseActionResult) -> None:
        report = messages.result(message, self._now())
        if self._state is not None and report.id == self._goal.id:
            status = GoalStatus.of(message.status.status)
            self._take(mission.on_goal_result(self.state, report.stamp, status, report.text))
