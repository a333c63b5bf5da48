"""Node of an arm: the driver of its joints and its gripper. Trajectories in, targets of the servos out."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

import actionlib
import rospy
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryResult,
    GripperCommandAction,
    GripperCommandResult,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.action_server import Sturdy
from node_kit.ros.lifetime import Lifetime
from sensor_msgs.msg import JointState
from simulator_msgs.msg import ArmCommand, ArmState
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from pybullet_simulator.messages.arms import joint_state, read_trajectory
from pybullet_simulator.robot.arm_controller import ArmController, Outcome, TrajectoryError
from pybullet_simulator.robot.gripper_controller import GripperController, GripperError
from pybullet_simulator.ros.device import DeviceError, check_device

if TYPE_CHECKING:
    from actionlib.server_goal_handle import ServerGoalHandle

FORCE_LIMIT = 25.0
"""N: above what a block brings about that is put 5 mm too low (18 N), below what an obstacle does at once (200 N)."""
_SECONDS = 1 << 32
"""Nanoseconds of more than a second may make more seconds of a stamp than it has room for."""
_REPORT = 0.5
"""s of ROS time between two reports on /diagnostics; a change is reported at once."""
_SILENCE = 5.0
"""s, wall, in which a new state must come while the arm goes back; a slow simulation takes less for one."""
_CODES = {
    Outcome.DONE: FollowJointTrajectoryResult.SUCCESSFUL,
    Outcome.STOPPED: FollowJointTrajectoryResult.PATH_TOLERANCE_VIOLATED,
    Outcome.BEHIND: FollowJointTrajectoryResult.PATH_TOLERANCE_VIOLATED,
    Outcome.NOT_REACHED: FollowJointTrajectoryResult.GOAL_TOLERANCE_VIOLATED,
    Outcome.SET_BACK: FollowJointTrajectoryResult.PATH_TOLERANCE_VIOLATED,
}
_WORDS = {
    Outcome.DONE: "the goal is reached",
    Outcome.STOPPED: "safety stop",
    Outcome.BEHIND: "a joint has fallen behind its path",
    Outcome.NOT_REACHED: "a joint is not at its goal in time",
    Outcome.SET_BACK: "the clock was set back; the arm stays where it is",
}


class _Server(Sturdy, actionlib.ActionServer):
    """actionlib's, which outlives a clock that is set back."""


class ArmNode:
    """Actions `~follow_joint_trajectory`, `~gripper_command`; services `~release`, `~retreat`.

    Each state of the arm is a turn.
    """

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._arm = parameters.choice("arm", "left", ("left", "right"))
        self._controller = ArmController(parameters.number("force_limit", FORCE_LIMIT, low=1.0, high=1000.0))
        self._controller.is_stopped = parameters.flag("stopped", False)
        self._gripper = GripperController()
        self._state: ArmState | None = None
        self._lock = threading.RLock()  # actionlib's callbacks and the arm's state come in threads of their own
        self._motion: ServerGoalHandle | None = None
        self._grip: ServerGoalHandle | None = None
        self._reported = 0.0
        self._was_stopped = False
        raw = f"simulator/{self._arm}_arm"
        self._command = rospy.Publisher(f"{raw}/command", ArmCommand, queue_size=1, tcp_nodelay=True)
        self._joints = rospy.Publisher("joint_states", JointState, queue_size=1)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=5)
        self._ended = threading.Condition(self._lock)
        self._last_outcome: Outcome | None = None
        self._release = rospy.Service("~release", Trigger, self._on_release)
        self._retreat = rospy.Service("~retreat", Trigger, self._on_retreat)
        self._motions = _Server(
            "~follow_joint_trajectory", FollowJointTrajectoryAction, self._on_motion, self._on_cancel, auto_start=False
        )
        self._grips = _Server(
            "~gripper_command", GripperCommandAction, self._on_grip, self._on_cancel, auto_start=False
        )
        self._input = rospy.Subscriber(f"{raw}/state", ArmState, self._on_state, queue_size=1, tcp_nodelay=True)
        # They hold their lock while they call back, and want it for each answer: with two locks, threads that come from
        # both sides would wait for each other for ever.
        self._motions.lock = self._grips.lock = self._lock
        self._motions.start()
        self._grips.start()

    # Callbacks

    def _on_state(self, state: ArmState) -> None:
        if state.stamp.secs >= _SECONDS:
            rospy.logwarn_throttle(10.0, f"a state of the {self._arm} arm is ignored: its stamp fits no message")
            return
        try:
            self._take(state)
        except rospy.ROSException:  # the node's topics are closed while it ends
            if not rospy.core.is_shutdown_requested():
                raise

    def _take(self, state: ArmState) -> None:
        with self._lock:
            self._state = state
            now = state.stamp.to_sec()
            outcome = self._controller.update(now, state.positions, state.contact_force)
            gripped = self._gripper.update(now, state.gripper_width)
            self._send()
            if outcome is not None:
                self._end_motion(outcome)
            if gripped is not None and self._grip is not None:
                result = GripperCommandResult(gripped.width, self._gripper.force, gripped.stalled, gripped.reached)
                self._grip.set_succeeded(result)
                self._grip = None
            self._report(state.stamp)
        self._joints.publish(joint_state(self._arm, state, state.stamp))

    def _on_motion(self, goal: ServerGoalHandle) -> None:
        wanted = goal.get_goal()
        with self._lock:
            try:
                trajectory = read_trajectory(wanted.trajectory, self._arm)
                if self._state is None:
                    raise TrajectoryError("the arm has not told yet where it is")
                patience = wanted.goal_time_tolerance.to_sec()
                self._controller.follow(trajectory, self._state.stamp.to_sec(), self._state.positions, patience)
            except TrajectoryError as error:
                code = FollowJointTrajectoryResult.INVALID_GOAL
                goal.set_rejected(FollowJointTrajectoryResult(code, str(error)), str(error))
                return
            if self._motion is not None:
                self._motion.set_canceled(FollowJointTrajectoryResult(), "another trajectory has taken its place")
            goal.set_accepted()
            self._motion = goal

    def _on_grip(self, goal: ServerGoalHandle) -> None:
        wanted = goal.get_goal().command
        with self._lock:
            try:
                if self._state is None:
                    raise GripperError("the gripper has not told yet where it is")
                self._gripper.command(wanted.position, wanted.max_effort, self._state.stamp.to_sec())
            except GripperError as error:
                goal.set_rejected(GripperCommandResult(), str(error))
                return
            if self._grip is not None:
                self._grip.set_canceled(GripperCommandResult(), "another command has taken its place")
            goal.set_accepted()
            self._grip = goal

    def _on_cancel(self, goal: ServerGoalHandle) -> None:
        with self._lock:
            if self._motion is not None and goal == self._motion and self._state is not None:
                self._controller.cancel(self._state.positions)
                goal.set_canceled(FollowJointTrajectoryResult(), "cancelled; the arm stays where it is")
                self._motion = None
            elif self._grip is not None and goal == self._grip:
                goal.set_canceled(GripperCommandResult(), "cancelled; the fingers keep their target")
                self._grip = None

    def _on_release(self, _request: TriggerRequest) -> TriggerResponse:
        with self._lock:
            problem = self._controller.release(self._state.contact_force if self._state else 0.0)
            if not problem:
                rospy.loginfo("released")
                self._report(rospy.Time.now())
        return TriggerResponse(not problem, problem or "released")

    def _on_retreat(self, _request: TriggerRequest) -> TriggerResponse:
        with self._lock:
            if self._state is None:
                return TriggerResponse(False, "the arm has not told yet where it is")
            self._last_outcome = None
            problem = self._controller.go_back(self._state.stamp.to_sec(), self._state.positions)
            if problem:
                return TriggerResponse(False, problem)
            stamp, since = self._state.stamp, time.monotonic()
            while self._controller.is_moving and not rospy.is_shutdown():
                self._ended.wait(0.1)
                if self._state.stamp != stamp:
                    stamp, since = self._state.stamp, time.monotonic()
                elif time.monotonic() - since > _SILENCE:
                    self._controller.cancel(self._state.positions)
                    topic = rospy.resolve_name(f"simulator/{self._arm}_arm/state")
                    text = f"nothing new comes on {topic} for {_SILENCE:g} s: see whether the simulator runs"
                    return TriggerResponse(False, text)
            outcome = self._last_outcome
        return TriggerResponse(outcome is Outcome.DONE, _WORDS[outcome] if outcome else "the node ends")

    # Output

    def _send(self) -> None:
        target, width = self._controller.target, self._gripper.width
        if target is not None and width is not None:
            self._command.publish(ArmCommand(target, width, self._gripper.force))

    def _end_motion(self, outcome: Outcome) -> None:
        self._last_outcome = outcome
        self._ended.notify_all()
        words = _WORDS[outcome]
        if outcome is Outcome.STOPPED:
            words = f"{words}: the arm met {self._controller.resistance:.0f} N"
            rospy.logwarn(words)
        goal, self._motion = self._motion, None
        if goal is None:
            return
        result = FollowJointTrajectoryResult(_CODES[outcome], words)
        if outcome is Outcome.DONE:
            goal.set_succeeded(result, words)
        else:
            goal.set_aborted(result, words)

    def _report(self, stamp: rospy.Time) -> None:
        """Say on /diagnostics how the arm is."""
        now, stopped = stamp.to_sec(), self._controller.is_stopped
        if stopped == self._was_stopped and 0.0 <= now - self._reported < _REPORT:
            return
        self._was_stopped, self._reported = stopped, now
        # On a master of several robots, the hardware_id says whose arm it is: see the README of rosgraph_monitor.
        robot = rospy.get_namespace()
        hardware_id = f"{self._arm}_arm" if robot == "/" else f"robot:{robot.rstrip('/')}"
        status = DiagnosticStatus(DiagnosticStatus.OK, f"{self._arm}_arm: safety", "works", hardware_id, [])
        if stopped:
            status.level = DiagnosticStatus.ERROR
            status.message = "safety stop: the arm met resistance; take away what it met, then call ~release"
            status.values = [KeyValue("force", f"{self._controller.resistance:.0f}")]
        message = DiagnosticArray(status=[status])
        message.header.stamp = stamp
        self._diagnostics.publish(message)


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("arm", ParameterError, DeviceError) as life:
        life.start()
        check_device()
        ArmNode()
        rospy.spin()
