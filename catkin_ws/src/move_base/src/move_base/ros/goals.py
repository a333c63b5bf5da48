"""The action server, with one goal at a time, from its arrival to the answer for its client."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import actionlib
import rospy
from actionlib.goal_id_generator import GoalIDGenerator
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseActionGoal,
    MoveBaseFeedback,
    MoveBaseResult,
    RecoveryStatus,
)
from node_kit.io.inbox import Inbox
from node_kit.ros.action_server import Sturdy
from node_kit.ros.resumed_goal import start_with

from move_base.navigation.result import Outcome
from move_base.ros.frames import pose_in
from move_base.ros.messages import goal_problem, pose_stamped

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib.server_goal_handle import ServerGoalHandle
    from robot_formulas.geometry import Pose

    from move_base.navigation import result as recovery
    from move_base.ros.frames import TfTransformer

ACTION = "move_base"

FRAME_PATIENCE = 2.0
"""How long a goal waits for its frame to become known, s."""

MOST_AHEAD = 1.0
"""A goal's stamp that is this far ahead of the clock (s) does not tell which goal is the newer one."""

FEEDBACK_PERIOD = 0.2
"""s; the action's status has the same rate."""


class _Server(Sturdy, actionlib.ActionServer):
    """An action server that may end at any time, and whose clock may be set back."""


class GoalServer:
    """Goals of the action and of RViz; all but their arrival happens in the control loop."""

    def __init__(
        self,
        frames: TfTransformer,
        global_frame: str,
        begin: Callable[[Pose, float], None],
        cancel: Callable[[bool], None],
        resumed: MoveBaseActionGoal | None,
    ) -> None:
        """Prepare the server.

        Args:
            frames: the transforms.
            global_frame: that of the goals that are begun.
            begin: starts on a goal, at a time in s.
            cancel: drops the present goal, and stops the base if it is told to.
            resumed: a goal that was at work before this start.
        """
        self._frames = frames
        self._global_frame = global_frame
        self._begin = begin
        self._cancel = cancel
        self._requests = Inbox()
        self._active: ServerGoalHandle | None = None
        self._waiting: tuple[ServerGoalHandle, float] | None = None  # with the time from which it waits, s
        self._stamp = rospy.Time()  # of the current goal; 0 where it is from another time
        self._fed_back = -math.inf
        self._sent_on = rospy.Publisher(f"{ACTION}/goal", MoveBaseActionGoal, queue_size=5)
        self._recovery = rospy.Publisher(f"{ACTION}/recovery_status", RecoveryStatus, queue_size=1)
        self._current_goal = rospy.Publisher("~current_goal", PoseStamped, queue_size=1)
        self._resumed = resumed
        self._server = _Server(ACTION, MoveBaseAction, self._on_goal, self._on_cancel, auto_start=False)
        rospy.Subscriber(f"{ACTION}_simple/goal", PoseStamped, self._on_simple_goal, queue_size=5)

    def start(self) -> None:
        """Begin to take goals."""
        start_with(self._server, self._resumed)

    def take_requests(self, now: float) -> None:
        """Process the goals and cancellations that have arrived; `now` in s."""
        self._requests.drain()
        if self._waiting is not None:
            self._begin_waiting(now)

    def feed_back(self, now: float, robot: Pose) -> None:
        """Tell the active goal's client where the robot is, if it is time."""
        if self._active is not None and now - self._fed_back >= FEEDBACK_PERIOD:
            self._fed_back = now
            pose = pose_stamped(robot, self._global_frame, rospy.Time.now())
            self._active.publish_feedback(MoveBaseFeedback(base_position=pose))

    def tell_recovery(self, begun: recovery.RecoveryStatus, robot: Pose) -> None:
        """Publish that a recovery behaviour begins."""
        status = RecoveryStatus()
        status.pose_stamped = pose_stamped(robot, self._global_frame, rospy.Time.now())
        status.current_recovery_number = begun.index
        status.total_number_of_recoveries = begun.count
        status.recovery_behavior_name = begun.name
        self._recovery.publish(status)

    def finish(self, outcome: Outcome, text: str) -> None:
        """Tell the active goal's client how it ended."""
        handle, self._active = self._active, None
        if handle is None:
            return
        if outcome is Outcome.SUCCEEDED:
            rospy.loginfo("%s", text)
            handle.set_succeeded(MoveBaseResult(), text)
        else:
            rospy.logwarn("Goal aborted: %s", text)
            handle.set_aborted(MoveBaseResult(), text)

    def reset_time(self, now: float) -> None:
        """Forget times, after the clock was set back to `now` (s)."""
        self._fed_back = -math.inf
        self._stamp = rospy.Time()
        if self._waiting is not None:
            self._waiting = (self._waiting[0], now)

    def _on_goal(self, handle: ServerGoalHandle) -> None:
        problem = goal_problem(handle.get_goal().target_pose)
        if problem:
            rospy.logwarn("Goal rejected: %s", problem)
            handle.set_rejected(MoveBaseResult(), problem)
            return
        handle.set_accepted("This goal has been accepted.")
        self._requests.put(partial(self._take_goal, handle))

    def _on_cancel(self, handle: ServerGoalHandle) -> None:
        self._requests.put(partial(self._take_cancellation, handle))

    def _on_simple_goal(self, message: PoseStamped) -> None:
        """Send the pose as an action goal on the action's topic, where others can see it, too."""
        goal = MoveBaseActionGoal()
        goal.header.stamp = rospy.Time.now()
        goal.goal_id = GoalIDGenerator().generate_ID()
        goal.goal.target_pose = message
        self._sent_on.publish(goal)

    def _current(self) -> ServerGoalHandle | None:
        """Return the active goal, or the one that waits for its frame."""
        return self._active or (self._waiting[0] if self._waiting is not None else None)

    def _take_goal(self, handle: ServerGoalHandle) -> None:
        now, stamp = rospy.get_time(), handle.get_goal_id().stamp
        current = self._current()
        if current is not None and stamp < self._stamp:
            handle.set_canceled(MoveBaseResult(), "a newer goal is active")
            return
        goal = self._pose_of(handle)
        if current is not None:
            self._drop_goal("preempted by a newer goal", stop=goal is None)
        self._stamp = stamp if stamp.to_sec() <= now + MOST_AHEAD else rospy.Time()
        if goal is None:
            self._waiting = (handle, now)
        else:
            self._begin_goal(handle, goal, now)

    def _take_cancellation(self, handle: ServerGoalHandle) -> None:
        if _is_same(handle, self._current()):
            self._drop_goal("cancelled by the client")

    def _begin_waiting(self, now: float) -> None:
        """Begin the waiting goal as soon as its frame is known; abort it after a while."""
        assert self._waiting is not None  # noqa: S101
        handle, since = self._waiting
        goal = self._pose_of(handle)
        if goal is not None:
            self._waiting = None
            self._begin_goal(handle, goal, now)
        elif now - since > FRAME_PATIENCE:
            self._waiting = None
            frame = handle.get_goal().target_pose.header.frame_id.removeprefix("/")
            reason = f"the goal's frame {frame!r} has no transform to {self._global_frame!r}"
            rospy.logwarn("Goal aborted: %s", reason)
            self._cancel(True)
            handle.set_aborted(MoveBaseResult(), reason)

    def _begin_goal(self, handle: ServerGoalHandle, goal: Pose, now: float) -> None:
        self._active = handle
        self._begin(goal, now)
        self._current_goal.publish(pose_stamped(goal, self._global_frame, rospy.Time.now()))
        rospy.loginfo("Goal (%.2f, %.2f, %.2f) accepted", goal.x, goal.y, goal.yaw)

    def _pose_of(self, handle: ServerGoalHandle) -> Pose | None:
        """Return a goal in the global frame, or None while its frame is not known."""
        return pose_in(self._global_frame, handle.get_goal().target_pose, self._frames)

    def _drop_goal(self, reason: str, stop: bool = True) -> None:
        handle = self._current()
        self._active = self._waiting = None
        self._cancel(stop)
        if handle is not None:
            rospy.loginfo("Goal %s", reason)
            handle.set_canceled(MoveBaseResult(), reason)


def _is_same(one: ServerGoalHandle, other: ServerGoalHandle | None) -> bool:
    return other is not None and one.get_goal_id().id == other.get_goal_id().id
