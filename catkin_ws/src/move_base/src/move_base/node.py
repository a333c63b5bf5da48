"""ROS shell of move_base: parameters in; action, topics and services out. All decisions are in `navigator`."""

from __future__ import annotations

import contextlib
import functools
import math
import queue
import threading
from typing import TYPE_CHECKING, Any

import actionlib
import cv2
import genpy
import numpy as np
import rospy
import tf2_ros
from actionlib.goal_id_generator import GoalIDGenerator
from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped, Quaternion, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseResult
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetPlan, GetPlanResponse
from node_lifetime.lifetime_node import Lifetime
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan, PointCloud2
from std_srvs.srv import Empty, EmptyResponse

from move_base.geometry import STOP, Pose, Velocity
from move_base.global_planner import PlanningError
from move_base.grid import occupancy_values
from move_base.navigator import Navigator, Outcome
from move_base.parameter_tree import ParameterError
from move_base.parameters import read_parameters
from move_base.reconfiguration import changed, present_values, servers
from move_base.sensors import SensorError, cloud_observation, scan_observation
from move_base.static_map import MapError, StaticMap
from move_base.takeover import TakeoverError, decode_parameter

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib.server_goal_handle import ServerGoalHandle
    from numpy.typing import NDArray

    from move_base.costmap import Snapshot
    from move_base.navigator import Result
    from move_base.parameters import CostmapParameters, MoveBaseParameters, ObservationSource
    from move_base.reconfiguration import ServerDescription

ACTION = "move_base"

WARN_PERIOD = 5.0
"""The same warning is repeated no sooner than this, s."""

FRAME_PATIENCE = 2.0
"""How long a goal waits for its frame to become known, s."""

FEEDBACK_PERIOD = 0.2
"""s; the action's status has the same rate."""

FARTHEST = 1e6
"""Coordinates beyond this (m) are a mistake: it is farther than anything drives."""

TF_CACHE = 10.0
"""Transforms kept, s: tf2's own default."""


class TakingOverActionServer(actionlib.ActionServer):
    """An action server that may start with a goal already at work."""

    def __init__(self, *arguments: Any, resumed: MoveBaseActionGoal | None = None, **options: Any) -> None:
        super().__init__(*arguments, auto_start=False, **options)
        self._resumed = resumed

    def start(self) -> None:
        """Starts like the base class, but the first status message already holds the resumed goal."""
        with self.lock:
            self.initialize()
            self.started = True
            if self._resumed is not None:
                self.internal_goal_callback(self._resumed)
            self.publish_status()


class TfTransformer:
    """The navigator's access to /tf."""

    def __init__(self) -> None:
        self.buffer = tf2_ros.Buffer(cache_time=rospy.Duration.from_sec(TF_CACHE), debug=False)
        self._listener = tf2_ros.TransformListener(self.buffer)

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Returns the 4 x 4 transform at a time (s), the newest for None, or None."""
        when = rospy.Time() if stamp is None else rospy.Time.from_sec(stamp)
        try:
            transform = self.buffer.lookup_transform_core(target, source, when).transform
        except tf2_ros.TransformException:
            return None
        matrix = _matrix(transform.translation, transform.rotation)
        return matrix if (np.abs(matrix) <= FARTHEST).all() else None  # tf2 takes infinity for a number

    def newest(self, target: str, source: str) -> float | None:
        """Returns the time of the newest transform in s, or None. Frames that never move are current at any time."""
        try:
            stamp: float = self.buffer.get_latest_common_time(target, source).to_sec()
        except tf2_ros.TransformException:
            return None
        return stamp or math.inf

    def clear(self) -> None:
        """Forgets everything, after the clock was set back."""
        self.buffer.clear()


class MoveBaseNode:
    """The node: callbacks fill the navigator, `run` steps it at controller_frequency."""

    def __init__(
        self, parameters: MoveBaseParameters, tree: dict[str, Any], resumed: MoveBaseActionGoal | None
    ) -> None:
        self._parameters = parameters
        self._tree = tree  # what they were read from
        self._reconfigured: MoveBaseParameters | None = None  # to be taken on at the next tick
        self._tree_lock = threading.Lock()
        self._navigator = Navigator(parameters)
        self._lock = threading.RLock()  # the navigator, and the last word on cmd_vel
        self._closing = False
        self._requests: queue.SimpleQueue[tuple[str, ServerGoalHandle]] = queue.SimpleQueue()
        self._active: ServerGoalHandle | None = None
        self._waiting: tuple[ServerGoalHandle, float] | None = None
        self._velocity: Velocity = STOP
        self._fed_back = -math.inf
        self._frames = TfTransformer()
        self._cmd_vel = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._goals = rospy.Publisher(f"{ACTION}/goal", MoveBaseActionGoal, queue_size=5)
        self._current_goal = rospy.Publisher("~current_goal", PoseStamped, queue_size=1)
        self._plan = rospy.Publisher("~NavfnROS/plan", Path, queue_size=1)
        self._global_plan = rospy.Publisher("~TrajectoryPlannerROS/global_plan", Path, queue_size=1)
        self._local_plan = rospy.Publisher("~TrajectoryPlannerROS/local_plan", Path, queue_size=1)
        self._displays = [
            _CostmapDisplay("global_costmap", parameters.global_costmap),
            _CostmapDisplay("local_costmap", parameters.local_costmap),
        ]
        self._server = TakingOverActionServer(
            ACTION, MoveBaseAction, goal_cb=self._on_goal, cancel_cb=self._on_cancel, resumed=resumed
        )
        rospy.on_shutdown(self._stop_base)
        self._subscribe()
        self._server.start()
        rospy.Service("~make_plan", GetPlan, self._on_make_plan)
        rospy.Service("~clear_costmaps", Empty, self._on_clear_costmaps)
        # Beside the control loop: the first command must not wait for a score of registrations.
        threading.Thread(target=self._offer_reconfiguration, daemon=True).start()

    def run(self) -> None:
        """Steps until shutdown."""
        period = 1.0 / self._parameters.controller_frequency
        rate = rospy.Rate(self._parameters.controller_frequency)
        last = 0.0
        while not rospy.is_shutdown():
            if self._take_parameters():
                period = 1.0 / self._parameters.controller_frequency
                rate = rospy.Rate(self._parameters.controller_frequency)
            now = rospy.get_time()
            if now < last:
                self._clock_set_back(now)
            elif now > 0.0:
                if last and now - last > 2.5 * period:
                    rospy.logwarn_throttle(WARN_PERIOD, "The control loop missed its rate")
                self._tick(now)
            last = now
            with contextlib.suppress(rospy.ROSInterruptException, rospy.ROSTimeMovedBackwardsException):
                rate.sleep()

    def _tick(self, now: float) -> None:
        self._take_requests(now)
        with self._lock:
            result = self._navigator.step(now, self._frames, self._velocity)
            if result.velocity is not None and not self._closing:
                self._cmd_vel.publish(_twist(result.velocity))
        if result.warning:
            rospy.logwarn_throttle_identical(WARN_PERIOD, result.warning)
        self._publish_paths(result)
        if result.outcome is not None:
            self._finish(result)
        elif self._active is not None and result.robot is not None and now - self._fed_back >= FEEDBACK_PERIOD:
            self._fed_back = now
            pose = _pose_stamped(result.robot, self._parameters.global_costmap.global_frame)
            self._active.publish_feedback(MoveBaseFeedback(base_position=pose))
        for display, snapshot in zip(
            self._displays, (self._navigator.global_snapshot, self._navigator.local_snapshot), strict=True
        ):
            display.publish(now, snapshot, self._frames)

    # -- parameters that change on the way -------------------------------------------------------------------------

    def _offer_reconfiguration(self) -> None:
        from move_base.reconfigure_node import offer  # not needed for the first command

        with contextlib.suppress(rospy.ROSException, OSError):  # the node ends while it starts
            offer(servers(self._parameters), self._present_values, self._reconfigure)

    def _present_values(self, server: ServerDescription, names: Iterable[str]) -> dict[str, Any]:
        with self._tree_lock:
            return present_values(self._reconfigured or self._parameters, self._tree, server, names)

    def _reconfigure(self, namespace: str, values: dict[str, Any]) -> str:
        """Takes values at the next tick; returns why they do not fit, or an empty text."""
        with self._tree_lock:
            try:
                self._tree, self._reconfigured = changed(self._tree, namespace, values)
            except ParameterError as error:
                return str(error)
        return ""

    def _take_parameters(self) -> bool:
        with self._tree_lock:
            parameters, self._reconfigured = self._reconfigured, None
        if parameters is None:
            return False
        self._parameters = parameters
        with self._lock:
            self._navigator.reconfigure(parameters)
        for display, costmap in zip(self._displays, (parameters.global_costmap, parameters.local_costmap), strict=True):
            display.reconfigure(costmap)
        return True

    # -- goals -----------------------------------------------------------------------------------------------------

    def _on_goal(self, handle: ServerGoalHandle) -> None:
        problem = _goal_problem(handle.get_goal().target_pose)
        if problem:
            rospy.logwarn("Goal rejected: %s", problem)
            handle.set_rejected(MoveBaseResult(), problem)
            return
        handle.set_accepted("This goal has been accepted.")
        self._requests.put(("goal", handle))

    def _on_cancel(self, handle: ServerGoalHandle) -> None:
        self._requests.put(("cancel", handle))

    def _take_requests(self, now: float) -> None:
        while not self._requests.empty():
            kind, handle = self._requests.get()
            if kind == "goal":
                self._take_goal(handle, now)
            elif self._is_same(handle, self._active) or self._is_same(handle, self._waiting and self._waiting[0]):
                self._drop_goal("cancelled by the client")
        if self._waiting is not None:
            self._resolve_waiting(now)

    def _take_goal(self, handle: ServerGoalHandle, now: float) -> None:
        current = self._active or (self._waiting and self._waiting[0])
        if current is not None and handle.get_goal_id().stamp < current.get_goal_id().stamp:
            handle.set_canceled(MoveBaseResult(), "a newer goal is active")
            return
        if current is not None:
            self._drop_goal("preempted by a newer goal", stop=False)
        self._waiting = (handle, now)

    def _resolve_waiting(self, now: float) -> None:
        """Starts the waiting goal as soon as its frame is known."""
        assert self._waiting is not None  # noqa: S101
        handle, since = self._waiting
        target = handle.get_goal().target_pose
        global_frame = self._parameters.global_costmap.global_frame
        frame = target.header.frame_id.removeprefix("/")
        goal = Pose.from_matrix(_matrix(target.pose.position, target.pose.orientation))
        if frame != global_frame:
            matrix = self._frames.lookup(global_frame, frame, None)
            if matrix is None:
                if now - since > FRAME_PATIENCE:
                    self._waiting = None
                    reason = f"the goal's frame {frame!r} has no transform to {global_frame!r}"
                    rospy.logwarn("Goal aborted: %s", reason)
                    self._send_stop()
                    handle.set_aborted(MoveBaseResult(), reason)
                return
            goal = Pose.from_matrix(matrix).compose(goal)
        self._waiting, self._active = None, handle
        with self._lock:
            self._navigator.set_goal(goal, now)
        self._current_goal.publish(_pose_stamped(goal, global_frame))
        rospy.loginfo("Goal (%.2f, %.2f, %.2f) accepted", goal.x, goal.y, goal.yaw)

    def _drop_goal(self, reason: str, stop: bool = True) -> None:
        handle = self._active or (self._waiting and self._waiting[0])
        self._active = self._waiting = None
        with self._lock:
            self._navigator.cancel()
        if stop:
            self._send_stop()
        if handle is not None:
            rospy.loginfo("Goal %s", reason)
            handle.set_canceled(MoveBaseResult(), reason)

    def _finish(self, result: Result) -> None:
        handle, self._active = self._active, None
        if handle is None:
            return
        if result.outcome is Outcome.SUCCEEDED:
            rospy.loginfo("%s", result.text)
            handle.set_succeeded(MoveBaseResult(), result.text)
        else:
            rospy.logwarn("Goal aborted: %s", result.text)
            handle.set_aborted(MoveBaseResult(), result.text)

    @staticmethod
    def _is_same(one: ServerGoalHandle, other: ServerGoalHandle | None) -> bool:
        return other is not None and one.get_goal_id().id == other.get_goal_id().id

    def _on_simple_goal(self, message: PoseStamped) -> None:
        """Sends the pose as an action goal on the action's topic, where others can see it, too."""
        goal = MoveBaseActionGoal()
        goal.header.stamp = rospy.Time.now()
        goal.goal_id = GoalIDGenerator().generate_ID()
        goal.goal.target_pose = message
        self._goals.publish(goal)

    # -- sensors and services --------------------------------------------------------------------------------------

    def _subscribe(self) -> None:
        controller = self._parameters.controller
        rospy.Subscriber(controller.odom_topic, Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber(f"{ACTION}_simple/goal", PoseStamped, self._on_simple_goal, queue_size=5)
        for source in self._navigator.sources:
            kind = numpy_msg(LaserScan) if source.data_type == "LaserScan" else PointCloud2
            # buff_size: a cloud must fit in it, or rospy falls behind
            callback = functools.partial(self._on_sensor, source)
            rospy.Subscriber(source.topic, kind, callback, queue_size=2, buff_size=1 << 22)
        costmaps = (self._parameters.global_costmap, self._parameters.local_costmap)
        for topic in {layer.map_topic for costmap in costmaps for layer in costmap.layers_of("static")}:
            rospy.Subscriber(topic, numpy_msg(OccupancyGrid), self._on_map, queue_size=1)

    def _on_sensor(self, source: ObservationSource, message: Any) -> None:
        convert = scan_observation if source.data_type == "LaserScan" else cloud_observation
        try:
            observation = convert(message, source)
        except SensorError as error:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"{source.topic}: message ignored: {error}")
            return
        with self._lock:
            ignored = self._navigator.observe(observation, rospy.get_time())
        if ignored:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"Message ignored: {ignored}")

    def _on_odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        values = (twist.linear.x, twist.linear.y, twist.angular.z)
        if all(math.isfinite(value) for value in values):
            self._velocity = Velocity(*values)
        else:
            rospy.logwarn_throttle(WARN_PERIOD, "Odometry ignored: its velocity is not finite")

    def _on_map(self, message: OccupancyGrid) -> None:
        info = message.info
        yaw = Pose.from_matrix(_matrix(info.origin.position, info.origin.orientation)).yaw
        origin = (info.origin.position.x, info.origin.position.y, yaw)
        try:
            static = StaticMap.create(message.data, info.width, info.height, info.resolution, origin)
        except MapError as error:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"Map ignored: {error}")
            return
        with self._lock:
            self._navigator.set_map(static, message.header.frame_id)

    def _on_make_plan(self, request: Any) -> GetPlanResponse:
        response = GetPlanResponse()
        frame = self._parameters.global_costmap.global_frame
        response.plan.header.frame_id = frame
        response.plan.header.stamp = rospy.Time.now()
        start = self._in_global(request.start) if request.start.header.frame_id else self._robot()
        goal = self._in_global(request.goal)
        if start is None or goal is None:
            rospy.logwarn("make_plan: start or goal is not a finite pose in a known frame")
            return response
        try:
            plan = self._navigator.plan_between(start, goal, request.tolerance)
        except PlanningError as error:
            rospy.logwarn("make_plan: %s", error)
            return response
        response.plan.poses = _path(plan.points, plan.headings(), frame).poses
        return response

    def _on_clear_costmaps(self, _request: Any) -> EmptyResponse:
        with self._lock:
            self._navigator.clear_costmaps()
        return EmptyResponse()

    def _in_global(self, stamped: PoseStamped) -> Pose | None:
        if _goal_problem(stamped):
            return None
        frame = self._parameters.global_costmap.global_frame
        matrix = self._frames.lookup(frame, stamped.header.frame_id.removeprefix("/"), None)
        if matrix is None:
            return None
        return Pose.from_matrix(matrix @ _matrix(stamped.pose.position, stamped.pose.orientation))

    def _robot(self) -> Pose | None:
        p = self._parameters.global_costmap
        matrix = self._frames.lookup(p.global_frame, p.robot_base_frame, None)
        return None if matrix is None else Pose.from_matrix(matrix)

    # -- output ----------------------------------------------------------------------------------------------------

    def _publish_paths(self, result: Result) -> None:
        global_frame = self._parameters.global_costmap.global_frame
        local_frame = self._parameters.local_costmap.global_frame
        if result.new_plan is not None:
            self._plan.publish(_path(result.new_plan.points, result.new_plan.headings(), global_frame))
        if result.path is not None and self._global_plan.get_num_connections():
            steps = np.diff(result.path, axis=0, append=result.path[-1:])
            self._global_plan.publish(_path(result.path, np.arctan2(steps[:, 1], steps[:, 0]), local_frame))
        if result.trajectory is not None and self._local_plan.get_num_connections():
            poses = result.trajectory.poses
            self._local_plan.publish(_path(poses[:, :2], poses[:, 2], local_frame))

    def _send_stop(self) -> None:
        with self._lock:
            if not self._closing:
                self._cmd_vel.publish(Twist())

    def _stop_base(self) -> None:
        """The last command of a node that ends is to stand still."""
        with self._lock:
            self._closing = True
            with contextlib.suppress(rospy.ROSException):
                self._cmd_vel.publish(Twist())

    def _clock_set_back(self, now: float) -> None:
        rospy.logwarn("The clock was set back; sensor data and transforms are forgotten")
        self._frames.clear()
        self._fed_back = -math.inf
        with self._lock:
            self._navigator.reset_time(now)


class _CostmapDisplay:
    """Topics of one costmap, filled at publish_frequency while somebody listens."""

    def __init__(self, name: str, parameters: CostmapParameters) -> None:
        self._parameters = parameters
        self._footprint = parameters.padded_footprint()
        self._costmap = rospy.Publisher(f"~{name}/costmap", OccupancyGrid, queue_size=1)
        self._polygon = rospy.Publisher(f"~{name}/footprint", PolygonStamped, queue_size=1)
        self._published = -math.inf

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Takes other parameters."""
        self._parameters = parameters
        self._footprint = parameters.padded_footprint()

    def publish(self, now: float, snapshot: Snapshot | None, frames: TfTransformer) -> None:
        """Publishes what is due at `now` (s)."""
        p = self._parameters
        if p.publish_frequency == 0.0 or snapshot is None:
            return
        if 0.0 <= now - self._published < 1.0 / p.publish_frequency:
            return
        self._published = now
        if self._costmap.get_num_connections():
            self._costmap.publish(_occupancy_grid(snapshot, p.global_frame))
        if self._polygon.get_num_connections():
            matrix = frames.lookup(p.global_frame, p.robot_base_frame, None)
            if matrix is not None:
                self._polygon.publish(_polygon(Pose.from_matrix(matrix).apply(self._footprint), p.global_frame))


def main() -> None:
    """Entry point of the node; exit status 2 when a parameter can't be used."""
    with Lifetime("move_base", ParameterError) as life:
        life.start()
        cv2.setNumThreads(1)  # the grids are small: threads cost more than they give
        tree = rospy.get_param("~", {})
        tree = tree if isinstance(tree, dict) else {}
        parameters = read_parameters(tree)
        MoveBaseNode(parameters, tree, _resumed_goal(tree.pop("resume_goal", None))).run()


def _resumed_goal(value: object) -> MoveBaseActionGoal | None:
    """Returns the goal to take over, and deletes the parameter: it is meant for this start only."""
    if value is None:
        return None
    with contextlib.suppress(KeyError):
        rospy.delete_param("~resume_goal")
    try:
        goal = MoveBaseActionGoal().deserialize(decode_parameter(value))
    except (TakeoverError, genpy.DeserializationError) as error:
        rospy.logwarn("%s ignored: %s", rospy.resolve_name("~resume_goal"), error)
        return None
    rospy.loginfo("Taking over goal %s", goal.goal_id.id)
    return goal


def _goal_problem(target: PoseStamped) -> str:
    """Returns why a pose can't be a goal, or an empty text."""
    position, orientation = target.pose.position, target.pose.orientation
    values = (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)
    if not all(abs(value) <= FARTHEST for value in values):
        return f"the goal's pose is not finite, or over {FARTHEST / 1000:g} km away"
    length = math.sqrt(sum(value * value for value in values[3:]))
    if abs(length - 1.0) > 0.1:
        return f"the goal's quaternion has length {length:.2f}, must be 1"
    if not target.header.frame_id.strip("/"):
        return "the goal has no frame_id"
    return ""


def _matrix(position: Any, q: Quaternion) -> NDArray[np.float64]:
    """Returns the homogeneous 4 x 4 transform of a position and a unit quaternion."""
    matrix = np.eye(4)
    matrix[:3, :3] = (
        (1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.z * q.w), 2 * (q.x * q.z + q.y * q.w)),
        (2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.x * q.w)),
        (2 * (q.x * q.z - q.y * q.w), 2 * (q.y * q.z + q.x * q.w), 1 - 2 * (q.x * q.x + q.y * q.y)),
    )
    matrix[:3, 3] = position.x, position.y, position.z
    return matrix


def _twist(velocity: Velocity) -> Twist:
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.angular.z = velocity.x, velocity.y, velocity.yaw
    return twist


def _pose_stamped(pose: Pose, frame: str) -> PoseStamped:
    stamped = PoseStamped()
    stamped.header.stamp = rospy.Time.now()
    stamped.header.frame_id = frame
    stamped.pose.position.x, stamped.pose.position.y = pose.x, pose.y
    stamped.pose.orientation = Quaternion(0.0, 0.0, math.sin(0.5 * pose.yaw), math.cos(0.5 * pose.yaw))
    return stamped


def _path(points: NDArray[np.float64], headings: NDArray[np.float64], frame: str) -> Path:
    path = Path()
    path.header.stamp = rospy.Time.now()
    path.header.frame_id = frame
    for (x, y), yaw in zip(points.tolist(), headings.tolist(), strict=True):
        stamped = PoseStamped(header=path.header)
        stamped.pose.position.x, stamped.pose.position.y = x, y
        stamped.pose.orientation = Quaternion(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        path.poses.append(stamped)
    return path


def _polygon(corners: NDArray[np.float64], frame: str) -> PolygonStamped:
    polygon = PolygonStamped()
    polygon.header.stamp = rospy.Time.now()
    polygon.header.frame_id = frame
    polygon.polygon.points = [Point32(x, y, 0.0) for x, y in corners.tolist()]
    return polygon


def _occupancy_grid(snapshot: Snapshot, frame: str) -> OccupancyGrid:
    grid = OccupancyGrid()
    g = snapshot.geometry
    grid.header.stamp = rospy.Time.now()
    grid.header.frame_id = frame
    grid.info.resolution, grid.info.width, grid.info.height = g.resolution, g.width, g.height
    grid.info.origin.position.x, grid.info.origin.position.y = g.origin_x, g.origin_y
    grid.info.origin.orientation.w = 1.0
    grid.data = occupancy_values(snapshot.costs).ravel().tolist()
    return grid
