"""The ROS shell of a mission of D1: the pyramid is to be built, and a scenario strikes meanwhile."""

from __future__ import annotations

import re
import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import rospy
from actionlib_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from metacontrol_bags import messages
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_manipulation.msg import BuildPyramidActionFeedback, BuildPyramidActionGoal, BuildPyramidActionResult
from metacontrol_msgs.msg import MissionEvent
from node_kit.ros.services import call
from simulator_msgs.msg import ArmState
from simulator_msgs.srv import DeleteObstacle, SpawnObstacle
from std_srvs.srv import Trigger

from metacontrol_experiments.contingency.contingency import Contingency, InjectionError, Kind
from metacontrol_experiments.mission.mission import Action
from metacontrol_experiments.pyramid import course
from metacontrol_experiments.pyramid.course import Inject, State, TakeAway
from metacontrol_experiments.pyramid.record import ACTION
from metacontrol_experiments.pyramid.scenarios import ARMS, Kill, Light, Obstacle, Release
from metacontrol_experiments.pyramid.summary import IN_PLACE, placed
from metacontrol_experiments.ros.fault_injection import FaultInjector, Injected
from metacontrol_experiments.ros.goal import MissionGoal
from metacontrol_experiments.ros.mission_node import MissionNode

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.io.processes import ProcessTree
    from metacontrol_experiments.pyramid.scenarios import Strike
    from metacontrol_experiments.pyramid.settings import PyramidSettings

_COMPONENTS = {"camera": "camera", "left_arm": "left_arm", "right_arm": "right_arm"}
"""Component -> node."""
_WALL = "wall"
_WALL_SIZE = {"length": 0.3, "width": 0.06, "height": 0.6}
"""m, of the obstacle: higher than an arm carries a block, and too wide to be knocked over."""
_SAFETY = "_arm: safety"
_PLACES = re.compile(r"Place\(arm='(\w+)'")
_SERVER = "the action server of build"


class PyramidMission(MissionNode[State]):
    """A mission of D1."""

    def __init__(
        self, settings: PyramidSettings, tree: ProcessTree, display: Display, check: Callable[[], None]
    ) -> None:
        """Join the graph.

        Args:
            settings: the mission.
            tree: the processes of this run; only these may be signalled.
            display: where the timeline is shown.
            check: raises an error when the launched system ends.

        Raises:
            StartError: the master did not come up in time, or does not run on simulated time.
        """
        self._settings, self._scenario = settings, settings.drawn
        self._placing = ""  # the arm that is to place a block
        super().__init__(display, check, {}, settings.decider)
        self._injector = FaultInjector(_COMPONENTS, tree.owns)
        self._subscribe(f"{ACTION}/status", GoalStatusArray, self._on_status)
        self._subscribe(f"{ACTION}/result", BuildPyramidActionResult, self._on_result)
        self._subscribe(f"{ACTION}/feedback", BuildPyramidActionFeedback, self._on_feedback)
        for arm in ARMS:
            self._subscribe(f"simulator/{arm}_arm/state", ArmState, partial(self._on_arm, arm))
        self._subscribe("ground_truth/blocks", PoseArray, self._on_blocks)

    @property
    def is_over(self) -> bool:
        """Whether the mission is over."""
        return self.state.is_over

    def start_up(self) -> None:
        """Wait until the whole system is up.

        Raises:
            StartError: it is not, in time; or the manipulator gave up.
        """
        self.wait_ready((), _SERVER)

    def _make_goal(self) -> MissionGoal:
        return MissionGoal(ACTION, BuildPyramidActionGoal)

    def _begin(self) -> None:
        now = rospy.Time.now()
        self._state = course.start(now.to_sec())
        self._goal.make(now)
        self._began_wall = time.monotonic()
        self._display.start(now.to_sec())
        values = self._settings.describe() | {"goal_id": self._goal.id}
        self._publish_event(now, MissionEvent.MISSION_START, self._name, values)
        self._goal.send()

    def _advance(self, now: float) -> None:
        self._state, deeds = course.on_time(self._scenario, self.state, now)
        for deed in deeds:
            if isinstance(deed, Inject):
                self._strike(deed.strike)
            elif isinstance(deed, TakeAway):
                self._take_away(now)
            elif deed is Action.RESEND_GOAL:
                self._goal.send()
            elif deed is Action.CANCEL_GOAL:
                self._goal.cancel()

    def _give_up(self, now: float, reason: str, *, interrupted: bool) -> None:
        end = course.interrupt if interrupted else course.abort
        self._state = end(self.state, now, reason)

    def _ending(self) -> tuple[float | None, str, dict[str, str]]:
        state = self.state
        outcome = state.outcome.value if state.outcome else "unknown"
        return state.over_at, self._name, {"outcome": outcome, "reason": state.reason, "placed": str(state.placed)}

    @property
    def _name(self) -> str:
        return f"scenario {self._scenario.number}"

    def _strike(self, strike: Strike) -> None:
        """Let something happen; what the robot is in the way of, or still holds, is tried again."""
        try:
            injected = self._happen(strike)
        except (InjectionError, OSError, rospy.ROSException, rospy.ServiceException) as error:
            self._give_up(self._now(), f"{strike} could not happen: {error}", interrupted=False)
            return
        if injected is None:
            return
        self._state = course.struck(self.state, injected.stamp.to_sec())
        if isinstance(strike.what, Obstacle):
            self._state = course.stands(self.state, strike.what)
        self._publish_event(injected.stamp, MissionEvent.PERTURBATION, str(strike.what), injected.values)

    def _take_away(self, now: float) -> None:
        try:
            answer = call("simulator/delete_obstacle", DeleteObstacle, _WALL)
        except (OSError, rospy.ROSException, rospy.ServiceException) as error:
            self._give_up(now, f"the obstacle could not be taken away: {error}", interrupted=False)
            return
        if not answer.success:
            self._give_up(now, f"the obstacle could not be taken away: {answer.message}", interrupted=False)

    def _happen(self, strike: Strike) -> Injected | None:
        """Let something happen; return when, None where it cannot happen yet.

        Raises:
            InjectionError, OSError, ROSException, ServiceException: it cannot happen at all.
        """
        what = strike.what
        if isinstance(what, Light):
            return self._injector.inject(Contingency(Kind.LIGHT, value=what.level), None)
        if isinstance(what, Kill):
            return self._injector.inject(Contingency(Kind.KILL, target=what.component), None)
        stamp = rospy.Time.now()
        if isinstance(what, Release):
            answer = call(f"{what.arm}_arm/release", Trigger)
            return Injected(stamp, {"arm": what.arm}) if answer.success else None
        told = {"arm": what.arm, "x": f"{what.x:.3f}", "y": f"{what.y:.3f}"}
        spawned = call("simulator/spawn_obstacle", SpawnObstacle, name=_WALL, x=what.x, y=what.y, **_WALL_SIZE)
        return Injected(stamp, told) if spawned.success else None

    # Callbacks: the inbox brings them to the mission's thread

    def _on_status(self, message: GoalStatusArray) -> None:
        self._readiness.has_server = True
        if self._state is not None and self._goal.status_in(message) is not None:
            self._state = course.on_known(self._state)

    def _on_result(self, message: BuildPyramidActionResult) -> None:
        report = messages.result(message, self._now())
        if self._state is not None and report.id == self._goal.id:
            text = report.text or message.result.message
            self._state = course.on_result(self._state, report.stamp, GoalStatus.of(message.status.status), text)

    def _on_feedback(self, message: BuildPyramidActionFeedback) -> None:
        if self._state is not None:
            places = _PLACES.match(message.feedback.step)
            self._placing = places[1] if places else ""

    def _on_arm(self, arm: str, message: ArmState) -> None:
        if self._state is not None and arm == self._placing:
            self._state = course.on_carrying(self._state, frozenset((arm,)) if message.is_holding else frozenset())

    def _on_blocks(self, message: PoseArray) -> None:
        if self._state is None or self._state.is_over or not message.poses:
            return
        distances = placed(np.array([(p.position.x, p.position.y, p.position.z) for p in message.poses]))
        count = int((distances <= IN_PLACE).sum())
        self._state = course.on_placed(self._state, count)
        left = course.BLOCKS - count
        self._display.progress(count / course.BLOCKS, self._now(), f"{left} block{'' if left == 1 else 's'}")

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        super()._on_diagnostics(message)
        if self._state is None:
            return
        for status in message.status:
            if status.name.endswith(_SAFETY):
                arm = status.name.lstrip("/").removesuffix(_SAFETY)
                is_stopped = status.level == DiagnosticStatus.ERROR
                stamp = message.header.stamp.to_sec()
                self._state = course.on_stops(self._state, stamp, arm, is_stopped=is_stopped)
