"""The robot over ROS, as a program that builds sees it: drivers of arms and grippers, camera, base."""

from __future__ import annotations

import math
import threading
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any

import actionlib
import rospy
from arm_motion.kinematics import forward
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryGoal,
    GripperCommand,
    GripperCommandAction,
    GripperCommandGoal,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, PoseStamped
from metacontrol_bags import ownership
from nav_msgs.msg import Path
from node_kit.ros.action_server import wait_for_server
from node_kit.ros.goals import send_and_wait
from node_kit.ros.patience import Patience
from pybullet_simulator.messages.arms import FINGERS, joint_names
from pybullet_simulator.messages.cell import ImageError, read_floats
from pybullet_simulator.robot.manipulator import ARMS
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint

from metacontrol_manipulation.handling.deeds import Move
from metacontrol_manipulation.pick_place.pyramid import SIDE
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.images import take_image

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy as np
    from arm_motion.timing import Trajectory
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from metacontrol_manipulation.handling.deeds import Deed
    from metacontrol_manipulation.perception.camera import Camera
    from metacontrol_manipulation.ros.places import Place

_HELD = 0.008
"""m by which the fingers may be nearer or farther than a block's edge while they hold it."""
_PATIENCE = 10.0
"""s of ROS time for an image, and for an arm's driver after the end of its motion."""
_BRAKING = 2.0
"""s of ROS time in which an arm stands after its motion was cancelled."""
_LOOK, _STANDING = 0.1, 0.005
"""s between two looks at an arm's joints, and rad by which none of them moves in between if it stands."""


class RosRobot:
    """A Robot (see `pick_place.building`). The program says where the cell is and how the base moves."""

    def __init__(self, place: Place, move_base: Callable[[float], bool]) -> None:
        """Connect to the drivers.

        Args:
            place: where the cell is.
            move_base: drives to y in m along the table; returns whether the base is there.

        Raises:
            RobotError: a driver is not there.
        """
        self._place, self._move_base = place, move_base
        self._news = threading.Condition()
        self._joints: dict[str, tuple[float, ...]] = {}
        self._widths: dict[str, float] = {}
        self._stopped: set[str] = set()
        self._arms = {mount.name: _Clients(mount.name) for mount in ARMS}
        self._workers = ThreadPoolExecutor(len(ARMS), "arm")
        self._begun: dict[Future[bool], str] = {}
        self._mounts = {mount.name: mount for mount in ARMS}
        self._plan = rospy.Publisher("arm_plan", Path, queue_size=2)
        self._inputs = (
            rospy.Subscriber("joint_states", JointState, self._on_joints, queue_size=10),
            rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=50),
        )
        self._wait(lambda: len(self._joints) == len(ARMS), "no driver of an arm tells its joints")

    @property
    def joints(self) -> Mapping[str, Sequence[float]]:
        """The joints of each arm, rad."""
        return dict(self._joints)

    @property
    def held(self) -> frozenset[str]:
        """Arms whose fingers are as far apart as a block is wide."""
        return frozenset(name for name, width in self._widths.items() if abs(width - SIDE) <= _HELD)

    @property
    def working(self) -> frozenset[str]:
        """Arms that are not stopped, as their drivers say."""
        return frozenset(self._arms) - self._stopped

    @property
    def cell(self) -> Pose:
        """Pose of the cell frame in base_link."""
        return self._place.cell()

    def sees_cell(self) -> bool:
        """Return whether it is known well enough where the cell is."""
        return self._place.is_seen()

    def depth(self) -> tuple[NDArray[np.float32], Camera]:
        """See anew where the cell is, then take a depth image.

        Raises:
            RobotError: there is no image, or it is not known where the cell is.
        """
        self._place.renew()
        image, camera = take_image("camera/depth/image_raw", _PATIENCE)
        try:
            return read_floats(image, 1), camera
        except ImageError as error:
            raise RobotError(str(error)) from error

    def do(self, arm: str, deeds: Sequence[Deed]) -> bool:
        """Have an arm do something; return whether it has."""
        clients = self._arms[arm]
        self._show(arm, deeds)
        for deed in deeds:
            done = clients.follow(deed.trajectory) if isinstance(deed, Move) else clients.grip(deed.width, deed.force)
            if not done:
                return False
        rospy.sleep(0.1)  # ROS time, for the joints' last state to arrive
        return True

    def begin(self, arm: str, deeds: Sequence[Deed]) -> None:
        """Have an arm do something in a thread of its own."""
        self._begun[self._workers.submit(self.do, arm, deeds)] = arm

    def ended(self) -> tuple[str, bool]:
        """Wait until an arm has ended what it has begun; return which one, and whether it has done it."""
        done, _ = wait(self._begun, return_when=FIRST_COMPLETED)
        future = min(done, key=lambda one: self._begun[one])
        return self._begun.pop(future), future.result()

    def halt(self) -> None:
        """Have arms that move stop where they are, also if another program moves them, and wait until they stand."""
        for clients in self._arms.values():
            clients.cancel()
        wait(self._begun)
        self._begun.clear()
        time_left, before = Patience(_BRAKING), self.joints
        while not time_left.is_over() and not rospy.is_shutdown():
            rospy.sleep(_LOOK)
            now = self.joints
            if all(abs(a - b) < _STANDING for arm in now for a, b in zip(now[arm], before[arm], strict=True)):
                return
            before = now

    def retreat(self, arm: str) -> bool:
        """Have an arm that is stopped go back to where its last trajectory began; return whether it has."""
        service = rospy.resolve_name(f"{arm}_arm/retreat")
        try:
            rospy.wait_for_service(service, _PATIENCE)
            answer = rospy.ServiceProxy(service, Trigger)()
        except (rospy.ROSException, rospy.ServiceException) as error:
            rospy.logwarn(f"{service}: {error}")
            return False
        if not answer.success:
            rospy.logwarn(f"{service}: {answer.message}")
        rospy.sleep(0.1)
        return bool(answer.success)

    def wait(self, duration: float) -> None:
        """Let ROS time (s) pass."""
        rospy.sleep(duration)

    def move_base(self, y: float) -> bool:
        """Drive along the table."""
        return self._move_base(y)

    def _show(self, arm: str, deeds: Sequence[Deed]) -> None:
        """Publish the way of the hand, where somebody wants to see it."""
        if not self._plan.get_num_connections():
            return
        mount = self._mounts[arm]
        path = Path()
        path.header.stamp, path.header.frame_id = rospy.Time.now(), "base_link"
        for deed in deeds:
            for posture in deed.trajectory.positions if isinstance(deed, Move) else ():
                (x, y, z), _ = forward(posture)
                pose = PoseStamped(header=path.header)
                pose.pose.position = Point(mount.x + x, mount.y + y, mount.z + z)
                pose.pose.orientation.w = 1.0
                path.poses.append(pose)
        self._plan.publish(path)

    # Callbacks

    def _on_joints(self, message: JointState) -> None:
        known = dict(zip(message.name, message.position, strict=False))
        for arm in self._arms:
            names, fingers = joint_names(arm), [f"{arm}_panda_finger_joint{i}" for i in range(1, FINGERS + 1)]
            if all(math.isfinite(known.get(name, math.nan)) for name in (*names, *fingers)):
                with self._news:
                    self._joints[arm] = tuple(known[name] for name in names)
                    self._widths[arm] = sum(known[finger] for finger in fingers)
                    self._news.notify_all()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        publisher = message._connection_header.get("callerid", "")
        for status in ownership.own(message.status, rospy.get_namespace(), publisher):
            arm, _, task = status.name.lstrip("/").partition("_arm: ")
            if task == "safety" and arm in self._arms:
                (self._stopped.add if status.level == DiagnosticStatus.ERROR else self._stopped.discard)(arm)

    def _wait(self, condition: Callable[[], bool], problem: str) -> None:
        """Wait in ROS time for something that a callback tells."""
        patience = Patience(_PATIENCE)
        with self._news:
            while not condition():
                if rospy.is_shutdown() or patience.is_over():
                    raise RobotError(f"{problem} for {_PATIENCE:g} s: see whether its driver runs")
                self._news.wait(0.1)


class _Clients:
    """The actions of one arm's driver."""

    def __init__(self, arm: str) -> None:
        self._arm = arm
        self._motion = actionlib.ActionClient(f"{arm}_arm/follow_joint_trajectory", FollowJointTrajectoryAction)
        self._gripper = actionlib.ActionClient(f"{arm}_arm/gripper_command", GripperCommandAction)
        for client in (self._motion, self._gripper):
            if not wait_for_server(client, _PATIENCE):
                raise RobotError(f"the driver of the {arm} arm is not there: start it")

    def follow(self, trajectory: Trajectory) -> bool:
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = joint_names(self._arm)
        goal.trajectory.points = [
            JointTrajectoryPoint(positions=p, velocities=v, time_from_start=rospy.Duration.from_sec(t))
            for t, p, v in zip(
                trajectory.times.tolist(), trajectory.positions.tolist(), trajectory.velocities.tolist(), strict=True
            )
        ]
        return self._send(self._motion, goal, trajectory.duration)

    def grip(self, width: float, force: float) -> bool:
        return self._send(self._gripper, GripperCommandGoal(GripperCommand(width, force)), 2.0)

    def cancel(self) -> None:
        """Cancel whatever the arm is at, by whomever."""
        self._motion.cancel_all_goals()
        self._gripper.cancel_all_goals()

    @staticmethod
    def _send(client: actionlib.ActionClient, goal: Any, duration: float) -> bool:
        ended = send_and_wait(client, goal, duration + _PATIENCE)
        return bool(ended and ended.get_goal_status() == actionlib.GoalStatus.SUCCEEDED)
