"""ROS shell of move_base: parameters in; action, topics and services out. All decisions are in `navigator`."""

from __future__ import annotations

import contextlib
import functools
import http.client
import threading
import time
import xmlrpc.client
from functools import partial
from typing import TYPE_CHECKING, Any

import cv2
import rosgraph
import rospy
from geometry_msgs.msg import Polygon, PoseStamped
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetPlan, GetPlanResponse
from node_kit.parameters import ParameterError
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.resumed_goal import take_resumed_goal
from robot_formulas.geometry import STOP, Pose, Velocity
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan, PointCloud, PointCloud2
from std_srvs.srv import Empty, EmptyResponse

from move_base.costmap.sensors import SensorError, cloud_observation, points_observation, scan_observation
from move_base.costmap.static_map import MapError, MapPart, StaticMap
from move_base.navigation.navigator import Navigator
from move_base.parameters.costmaps import MOST_CORNERS
from move_base.parameters.layout import sought_above
from move_base.parameters.parameters import FASTEST
from move_base.parameters.reader import read_parameters
from move_base.parameters.reconfiguration import changed, present_values, servers
from move_base.planning.global_planner import PlanningError
from move_base.ros.base import Base
from move_base.ros.display import CostmapDisplay, PathDisplay, in_costmap
from move_base.ros.frames import TfTransformer, pose_in
from move_base.ros.goals import ACTION, GoalServer
from move_base.ros.messages import goal_problem, matrix_of, path_of, pose_stamped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from move_base.parameters.parameters import MoveBaseParameters, ObservationSource
    from move_base.parameters.reconfiguration import ServerDescription

OFFER_AGAIN = 1.0
"""Wall s until services and servers are offered that could not be."""

_MAY_PASS = (
    OSError,
    http.client.HTTPException,
    xmlrpc.client.Error,
    rosgraph.MasterException,
    rospy.ROSException,
    RuntimeError,
    MemoryError,
)
"""What registering raises where the master is in trouble for a moment, or no thread or memory is left."""

WARN_PERIOD = 5.0
"""The same warning is repeated no sooner than this, s."""

ENDS_AT_GOAL = 1e-3
"""A plan whose end is nearer to the goal than this ends there, m."""

_KINDS = {"LaserScan": numpy_msg(LaserScan), "PointCloud": PointCloud, "PointCloud2": PointCloud2}
_CONVERSIONS = {"LaserScan": scan_observation, "PointCloud": points_observation, "PointCloud2": cloud_observation}


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
        self._lock = threading.RLock()  # the navigator
        self._velocity: Velocity = STOP
        self._frames = TfTransformer()
        self._base = Base(parameters.controller_frequency)
        self._goals = GoalServer(
            self._frames, parameters.global_costmap.global_frame, self._begin_goal, self._cancel_goal, resumed
        )
        rospy.on_shutdown(self._base.close)
        self._base.start_watch()
        self._subscribe()
        self._goals.start()
        self._path_display = PathDisplay(parameters)
        self._displays = [
            CostmapDisplay("global_costmap", parameters.global_costmap),
            CostmapDisplay("local_costmap", parameters.local_costmap),
        ]
        # Beside the control loop: the first command must not wait for scores of registrations.
        threading.Thread(target=self._offer_the_rest, daemon=True).start()

    def run(self) -> None:
        """Step until shutdown."""
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
        self._goals.take_requests(now)
        with self._lock:
            result = self._navigator.step(now, self._frames, self._velocity)
        if result.velocity is not None:
            self._base.send(result.velocity)
        if result.warning:
            rospy.logwarn_throttle_identical(WARN_PERIOD, result.warning)
        self._path_display.publish(result)
        if result.recovery is not None and result.robot is not None:
            self._goals.tell_recovery(result.recovery, result.robot)
        if result.outcome is not None:
            self._goals.finish(result.outcome, result.text)
        elif result.robot is not None:
            self._goals.feed_back(now, result.robot)
        for display, snapshot in zip(
            self._displays, (self._navigator.global_snapshot, self._navigator.local_snapshot), strict=True
        ):
            display.publish(now, snapshot, self._frames)

    def _offer_the_rest(self) -> None:
        """Offer what the first command does not need: services and dynamic_reconfigure."""
        from move_base.ros.reconfigure import offer

        planner = self._parameters.global_planner
        offers: list[tuple[str, Callable[[], object]]] = [
            ("~make_plan", lambda: rospy.Service("~make_plan", GetPlan, self._on_make_plan)),
            (f"~{planner}/make_plan", lambda: rospy.Service(f"~{planner}/make_plan", GetPlan, self._on_make_plan)),
            ("~clear_costmaps", lambda: rospy.Service("~clear_costmaps", Empty, self._on_clear_costmaps)),
        ]
        offers += [
            (f"~{one.namespace}", partial(offer, [one], self._present_values, self._reconfigure))
            for one in servers(self._parameters)
        ]
        while offers and not rospy.core.is_shutdown_requested():
            name, make = offers[0]
            try:
                make()
            except Exception as error:
                if isinstance(error, _MAY_PASS) and not isinstance(error, rospy.ROSSerializationException):
                    if not rospy.core.is_shutdown_requested():
                        rospy.logwarn("What move_base can be asked for is offered later: %s", error)
                        time.sleep(OFFER_AGAIN)
                    continue
                rospy.logwarn("%s is not offered: %s: correct the parameters of that name", name, error)
            del offers[0]

    # -- parameters that change on the way -------------------------------------------------------------------------

    def _present_values(self, server: ServerDescription, names: Iterable[str]) -> dict[str, Any]:
        with self._tree_lock:
            return present_values(self._reconfigured or self._parameters, self._tree, server, names)

    def _reconfigure(self, namespace: str, values: dict[str, Any]) -> str:
        """Take values at the next tick; return why they do not fit, or an empty text."""
        with self._tree_lock:
            try:
                self._tree, self._reconfigured = changed(self._tree, namespace, values)
            except ParameterError as error:
                return str(error)
        return ""

    def _take_parameters(self) -> bool:
        if not self._tree_lock.acquire(blocking=False):
            return False  # they are being changed: the next tick takes them
        parameters, self._reconfigured = self._reconfigured, None
        self._tree_lock.release()
        if parameters is None:
            return False
        self._parameters = parameters
        self._base.reconfigure(parameters.controller_frequency)
        with self._lock:
            self._navigator.reconfigure(parameters)
        for display, costmap in zip(self._displays, (parameters.global_costmap, parameters.local_costmap), strict=True):
            display.reconfigure(costmap)
        return True

    # -- sensors and services --------------------------------------------------------------------------------------

    def _subscribe(self) -> None:
        controller = self._parameters.controller
        rospy.Subscriber(controller.odom_topic, Odometry, self._on_odometry, queue_size=1)
        for source in self._navigator.sources:
            # buff_size: a cloud must fit in it, or rospy falls behind
            callback = functools.partial(self._on_sensor, source)
            rospy.Subscriber(source.topic, _KINDS[source.data_type], callback, queue_size=2, buff_size=1 << 22)
        costmaps = {"global_costmap": self._parameters.global_costmap, "local_costmap": self._parameters.local_costmap}
        static = [layer for costmap in costmaps.values() for layer in costmap.layers if layer.kind == "static"]
        for topic in {layer.map_topic for layer in static}:
            callback = functools.partial(self._on_map, topic)
            rospy.Subscriber(topic, numpy_msg(OccupancyGrid), callback, queue_size=1)
        for topic in {layer.map_topic for layer in static if layer.subscribe_to_updates}:
            callback = functools.partial(self._on_map_update, topic)
            rospy.Subscriber(f"{topic}_updates", numpy_msg(OccupancyGridUpdate), callback, queue_size=10)
        for name, costmap in costmaps.items():
            if costmap.footprint_topic:
                topic = in_costmap(name, costmap.footprint_topic)
                rospy.Subscriber(topic, Polygon, functools.partial(self._on_footprint, name), queue_size=1)

    def _on_sensor(self, source: ObservationSource, message: Any) -> None:
        try:
            observation = _CONVERSIONS[source.data_type](message, source)
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
        if all(abs(value) <= FASTEST for value in values):
            self._velocity = Velocity(*values)
        else:
            rospy.logwarn_throttle(
                WARN_PERIOD, f"Odometry ignored: its velocity is not finite, or over {FASTEST:g} m/s"
            )

    def _on_footprint(self, costmap: str, message: Polygon) -> None:
        if len(message.points) > MOST_CORNERS:
            problem = f"it has {len(message.points)} corners, more than {MOST_CORNERS}"
        else:
            problem = self._reconfigure(costmap, {"footprint": [[point.x, point.y] for point in message.points]})
        if problem:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"Footprint ignored: {problem}")

    def _on_map(self, topic: str, message: OccupancyGrid) -> None:
        info = message.info
        yaw = Pose.from_matrix(matrix_of(info.origin.position, info.origin.orientation)).yaw
        origin = (info.origin.position.x, info.origin.position.y, yaw)
        try:
            static = StaticMap.create(
                message.data, info.width, info.height, info.resolution, origin, message.header.frame_id
            )
        except MapError as error:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"Map ignored: {error}")
            return
        with self._lock:
            waits = self._navigator.set_map(static, topic, rospy.get_time(), self._frames)
        if waits:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"The map on {topic} is not used yet: {waits}")

    def _on_map_update(self, topic: str, message: OccupancyGridUpdate) -> None:
        try:
            part = MapPart.create(
                message.data, message.x, message.y, message.width, message.height, message.header.frame_id
            )
            with self._lock:
                self._navigator.update_map(part, topic)
        except MapError as error:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"{topic}_updates: update ignored: {error}")

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
        response.plan.poses = path_of(plan.points, plan.headings(), frame, response.plan.header.stamp).poses
        if self._parameters.make_plan_add_unreachable_goal and plan.goal.distance(goal) > ENDS_AT_GOAL:
            response.plan.poses.append(pose_stamped(goal, frame, response.plan.header.stamp))
        return response

    def _on_clear_costmaps(self, _request: Any) -> EmptyResponse:
        with self._lock:
            self._navigator.clear_costmaps()
        return EmptyResponse()

    def _in_global(self, stamped: PoseStamped) -> Pose | None:
        if goal_problem(stamped):
            return None
        return pose_in(self._parameters.global_costmap.global_frame, stamped, self._frames)

    def _robot(self) -> Pose | None:
        p = self._parameters.global_costmap
        matrix = self._frames.lookup(p.global_frame, p.robot_base_frame, None)
        return None if matrix is None else Pose.from_matrix(matrix)

    # -- goals and the clock ---------------------------------------------------------------------------------------

    def _begin_goal(self, goal: Pose, now: float) -> None:
        with self._lock:
            self._navigator.set_goal(goal, now)

    def _cancel_goal(self, stop: bool) -> None:
        with self._lock:
            self._navigator.cancel()
        if stop:
            self._base.send(STOP)

    def _clock_set_back(self, now: float) -> None:
        rospy.logwarn("The clock was set back; sensor data and transforms are forgotten")
        self._base.send(STOP)
        self._frames.clear()
        self._goals.reset_time(now)
        with self._lock:
            self._navigator.reset_time(now)


def main() -> None:
    """Run the node; exit status 2 when a parameter can't be used."""
    with Lifetime("move_base", ParameterError) as life:
        life.longest_end_without_master = life.longest_end  # then, too, the base is stopped first
        life.start()
        cv2.setNumThreads(1)  # the grids are small: threads cost more than they give
        tree = rospy.get_param("~", {})
        tree = tree if isinstance(tree, dict) else {}
        tree.pop("resume_goal", None)
        for name in sought_above(tree):
            above = rospy.search_param(name)
            if above:
                tree[name] = rospy.get_param(above)
        parameters = read_parameters(tree)
        for note in parameters.notes:
            rospy.logwarn("%s", note)
        MoveBaseNode(parameters, tree, take_resumed_goal(ACTION, MoveBaseActionGoal)).run()
