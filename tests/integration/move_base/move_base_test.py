#!/usr/bin/env python3
"""move_base as a node: goals and reasons, restarts with a goal at work, silent sensors. The test plays the robot."""

import base64
import contextlib
import copy
import io
import math
import signal
import subprocess
import threading
import time
import unittest
import xmlrpc.client

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PolygonStamped, PoseStamped, TransformStamped, Twist
from helpers.cases import case
from helpers.programs import program
from helpers.waiting import DEADLINE_S, wait_for
from integration.action_clients import SureActionClient
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetPlan
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

HALF_ROOM = 5.0
PERIOD = 0.02


def pose(x, y, frame="map"):
    stamped = PoseStamped()
    stamped.header.frame_id = frame
    stamped.pose.position.x, stamped.pose.position.y = x, y
    stamped.pose.orientation.w = 1.0
    return stamped


class Robot:
    """A base in an empty square room: integrates cmd_vel, publishes tf, odometry, map and scan."""

    def __init__(self):
        self.x = self.y = self.yaw = 0.0
        self.command = Twist()
        self.commands = []
        self.silent = False
        self._tf = tf2_ros.TransformBroadcaster()
        self._odometry = rospy.Publisher("odometry/filtered", Odometry, queue_size=1)
        self._scan = rospy.Publisher("front/scan", LaserScan, queue_size=1)
        self._map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._map.publish(self._room())
        rospy.Subscriber("cmd_vel", Twist, self._on_command)
        threading.Thread(target=self._run, daemon=True).start()

    @staticmethod
    def _room():
        grid = OccupancyGrid()
        grid.header.frame_id = "map"
        cells = np.zeros((220, 220), dtype=np.int8)
        cells[:10] = cells[-10:] = cells[:, :10] = cells[:, -10:] = 100
        grid.info.resolution, grid.info.width, grid.info.height = 0.05, 220, 220
        grid.info.origin.position.x = grid.info.origin.position.y = -5.5
        grid.info.origin.orientation.w = 1.0
        grid.data = cells.ravel().tolist()
        return grid

    def _on_command(self, twist):
        self.command = twist
        self.commands.append(twist)

    def _run(self):
        count = 0
        while not rospy.is_shutdown():
            v = self.command
            cos, sin = math.cos(self.yaw), math.sin(self.yaw)
            self.x += (cos * v.linear.x - sin * v.linear.y) * PERIOD
            self.y += (sin * v.linear.x + cos * v.linear.y) * PERIOD
            self.yaw += v.angular.z * PERIOD
            now = rospy.Time.now()
            self._tf.sendTransform(
                [
                    self._transform("map", "odom", now, (0.0, 0.0, 0.0)),
                    self._transform("odom", "base_link", now, (self.x, self.y, self.yaw)),
                    self._transform("base_link", "front_laser", now, (0.4, 0.0, 0.0)),
                ]
            )
            odometry = Odometry(child_frame_id="base_link")
            odometry.header.stamp, odometry.header.frame_id = now, "odom"
            odometry.twist.twist = v
            self._odometry.publish(odometry)
            if count % 5 == 0 and not self.silent:
                self._publish_scan(now)
            count += 1
            time.sleep(PERIOD)

    def _publish_scan(self, now):
        scan = LaserScan(angle_min=-2.35, angle_increment=0.01, range_min=0.05, range_max=10.0)
        scan.header.stamp, scan.header.frame_id = now, "front_laser"
        angles = self.yaw + scan.angle_min + scan.angle_increment * np.arange(471)
        x, y = self.x + 0.4 * math.cos(self.yaw), self.y + 0.4 * math.sin(self.yaw)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_x = (np.sign(np.cos(angles)) * HALF_ROOM - x) / np.cos(angles)
            to_y = (np.sign(np.sin(angles)) * HALF_ROOM - y) / np.sin(angles)
        scan.ranges = np.fmin(to_x, to_y).tolist()
        self._scan.publish(scan)

    @staticmethod
    def _transform(parent, child, stamp, values):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = parent, stamp
        transform.transform.translation.x, transform.transform.translation.y = values[:2]
        transform.transform.rotation.z = math.sin(values[2] / 2)
        transform.transform.rotation.w = math.cos(values[2] / 2)
        return transform


class MoveBaseTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("move_base_test")
        cls.log = []
        cls.goals = []
        rospy.Subscriber("/rosout", Log, lambda message: cls.log.append(message.msg))
        rospy.Subscriber("move_base/goal", MoveBaseActionGoal, cls.goals.append)
        rospy.Subscriber("move_base/status", GoalStatusArray, lambda message: setattr(cls, "status", message))
        cls.robot = Robot()
        cls.client = SureActionClient("move_base", MoveBaseAction)
        cls.addClassCleanup(cls.stop)
        cls.start()
        assert cls.client.wait_for_server(rospy.Duration(DEADLINE_S))

    def setUp(self):
        self.wait_for_stand()
        self.robot.x = self.robot.y = self.robot.yaw = 0.0
        self.robot.silent = False

    @classmethod
    def start(cls):
        cls.process = subprocess.Popen(
            [program("move_base", "move_base"), "__name:=move_base", "odom:=odometry/filtered"]
        )

    @classmethod
    def stop(cls, how=signal.SIGINT):
        cls.process.send_signal(how)
        cls.process.wait(timeout=DEADLINE_S)

    def send(self, x, y, frame="map"):
        self.client.send_goal(MoveBaseGoal(target_pose=pose(x, y, frame)))

    def is_taken(self, x, y):
        self.send(x, y)
        deadline = time.monotonic() + 2.0
        while self.client.get_state() == GoalStatus.PENDING and time.monotonic() < deadline:
            time.sleep(0.02)
        return self.client.get_state() != GoalStatus.PENDING

    def finish(self):
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)), "the goal has no result")
        return self.client.get_state(), self.client.get_goal_status_text()

    def cancel_all(self):
        """Cancel what is at work, and wait for its end: a cancellation that comes late would hit the next goal."""
        self.client.cancel_all_goals()
        at_work = {GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING}
        wait_for(lambda: not at_work & {goal.status for goal in self.status.status_list}, "no goal is at work")

    def wait_for_stand(self):
        wait_for(
            lambda: self.robot.command == Twist(), lambda: f"the base stands; the last command: {self.robot.command}"
        )

    def moving(self):
        return wait_for(lambda: self.robot.command.linear.x > 0.2, "the robot moves")

    def restart_with(self, parameter):
        rospy.set_param("move_base/resume_goal", parameter)
        self.start()

    def wait_until_deleted(self):
        wait_for(lambda: not rospy.has_param("move_base/resume_goal"), "the goal to resume is deleted")

    def test_goal_is_reached_and_the_base_stands(self):
        self.send(1.5, 1.0)
        self.assertEqual(self.finish(), (GoalStatus.SUCCEEDED, "Goal reached."))
        self.assertLess(math.hypot(self.robot.x - 1.5, self.robot.y - 1.0), 0.3)
        self.wait_for_stand()

    def test_goal_survives_a_restart_unnoticed_by_its_client(self):
        states = set()
        goal = MoveBaseGoal(target_pose=pose(2.5, 0.0))
        self.client.send_goal(goal)
        goal_id = self.client.gh.comm_state_machine.action_goal.goal_id.id
        self.moving()
        (sent,) = wait_for(lambda: [goal for goal in self.goals if goal.goal_id.id == goal_id], "the goal was seen")
        uri = rosgraph.Master("/test").lookupNode("/move_base")
        with contextlib.suppress(OSError):  # it may be gone before it answers
            xmlrpc.client.ServerProxy(uri).shutdown("/test", "restart")
        self.process.wait(timeout=DEADLINE_S)
        self.wait_for_stand()  # by the last command of the old node
        buffer = io.BytesIO()
        sent.serialize(buffer)
        data = base64.b64encode(buffer.getvalue()).decode()
        parameter = {"type": "move_base_msgs/MoveBaseActionGoal", "data": data}
        self.restart_with(parameter)
        self.moving()
        self.assertEqual(rospy.get_param("move_base/resume_goal"), parameter, "the next one needs it if this one dies")
        while not self.client.wait_for_result(rospy.Duration.from_sec(0.05)):
            states.add(self.client.get_state())
        self.assertEqual(self.finish()[0], GoalStatus.SUCCEEDED)
        self.assertEqual(states, {GoalStatus.ACTIVE})
        self.assertGreater(self.robot.x, 2.2)
        self.wait_until_deleted()

    def test_malformed_goal_to_resume_is_ignored(self):
        self.stop()
        self.restart_with({"type": "move_base_msgs/MoveBaseActionGoal", "data": "?"})
        wait_for(lambda: any("resume_goal ignored" in line for line in self.log), "a warning")
        self.wait_until_deleted()
        # The goal's topic may not have found the new server yet, and holds nothing back for it.
        wait_for(lambda: self.is_taken(0.6, 0.0), "the goal is taken")
        self.assertEqual(self.finish()[0], GoalStatus.SUCCEEDED)

    def test_silent_laser_stops_the_base_and_ends_the_goal_with_the_reason(self):
        self.send(3.0, 0.0)
        self.moving()
        before = len(self.robot.commands)
        self.robot.silent = True
        state, text = self.finish()
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertRegex(text, r"^no current data from front/scan for \d+\.\d s$")
        self.assertLess(self.robot.x, 2.0)
        self.wait_for_stand()
        moves = [twist != Twist() for twist in self.robot.commands[before:]]
        self.assertEqual(moves, sorted(moves, reverse=True), "it stops once, and stands until the end")

    def test_bad_goals_end_with_a_reason(self):
        for x, frame, state, words in (
            (math.nan, "map", GoalStatus.REJECTED, "not finite"),
            (1.0, "", GoalStatus.REJECTED, "no frame_id"),
            (1.0, "nowhere", GoalStatus.ABORTED, "'nowhere' has no transform"),
            (50.0, "map", GoalStatus.ABORTED, "outside the map"),
            (5.2, "map", GoalStatus.ABORTED, "in a wall"),
        ):
            with case(words):
                self.send(x, 0.0, frame)
                got, text = self.finish()
                self.assertEqual(got, state, text)
                self.assertIn(words, text)

    def test_newer_goal_preempts_and_cancel_stops(self):
        self.send(2.0, 0.0)
        first = self.client.gh
        self.moving()
        other = SureActionClient("move_base", MoveBaseAction)
        other.wait_for_server(rospy.Duration(DEADLINE_S))
        other.send_goal(MoveBaseGoal(target_pose=pose(0.0, 2.0)))
        wait_for(lambda: first.get_goal_status() == GoalStatus.PREEMPTED, "the first goal is preempted")
        self.assertEqual(first.get_goal_status_text(), "preempted by a newer goal")
        other.cancel_goal()
        self.assertTrue(other.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(other.get_state(), GoalStatus.PREEMPTED)
        self.wait_for_stand()

    def test_simple_goal_becomes_an_action_goal_and_a_plan(self):
        plans = []
        subscriber = rospy.Subscriber("move_base/NavfnROS/plan", Path, plans.append)
        publisher = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1)
        wait_for(lambda: publisher.get_num_connections() and subscriber.get_num_connections(), "connections")
        count = len(self.goals)
        publisher.publish(pose(1.0, 0.0))
        wait_for(lambda: plans, "a plan")
        self.assertEqual(plans[-1].header.frame_id, "map")
        wait_for(lambda: self.goals[count:] and self.goals[count].goal_id.id, "a goal with an id")
        self.cancel_all()

    def test_make_plan_answers(self):
        rospy.wait_for_service("move_base/make_plan", DEADLINE_S)
        make_plan = rospy.ServiceProxy("move_base/make_plan", GetPlan)
        plan = wait_for(lambda: make_plan(pose(0.0, 0.0), pose(3.0, 2.0), 0.0).plan.poses, "a plan")
        self.assertAlmostEqual(plan[-1].pose.position.x, 3.0)
        self.assertFalse(make_plan(pose(0.0, 0.0), pose(30.0, 2.0), 0.0).plan.poses)
        self.assertFalse(make_plan(pose(0.0, 0.0), pose(3.0, 2.0), math.nan).plan.poses)

    def test_clear_costmaps_forgets_what_was_seen(self):
        costmaps = self.listen_to_costmap()
        self.robot.silent = True
        scan = LaserScan(angle_min=-0.05, angle_increment=0.01, range_min=0.05, range_max=10.0, ranges=[2.0] * 11)
        scan.header.frame_id = "front_laser"

        def is_seen():
            scan.header.stamp = rospy.Time.now()
            self.robot._scan.publish(scan)
            return (self.cost(costmaps, 2.42, 0.0) or 0) >= 99

        def is_forgotten():
            rospy.ServiceProxy("move_base/clear_costmaps", Empty)()  # again, if the last scan came after it
            return self.cost(costmaps, 2.42, 0.0) == 0

        wait_for(is_seen, "the obstacle is in the costmap")
        wait_for(is_forgotten, "it is forgotten")

    def test_inflation_and_padding_change_what_is_published(self):
        costmaps, polygons = self.listen_to_costmap(), []
        rospy.Subscriber("move_base/local_costmap/footprint", PolygonStamped, polygons.append)
        layer = "move_base/local_costmap/inflater_layer"
        self.robot.x = 1.0  # the wall is in the rolling window
        wait_for(lambda: costmaps and self.cost(costmaps, 4.2, 0.0) == 0, "the wall is far enough")
        self.set_parameter(layer, "inflation_radius", 2.0)
        self.addCleanup(self.set_parameter, layer, "inflation_radius", 0.65)
        wait_for(lambda: 0 < self.cost(costmaps, 4.2, 0.0) < 99, "the wall reaches farther")
        self.set_parameter("move_base/local_costmap", "footprint_padding", 0.4)
        self.addCleanup(self.set_parameter, "move_base/local_costmap", "footprint_padding", 0.1)
        wait_for(
            lambda: polygons and max(p.x for p in polygons[-1].polygon.points) > 0.87,
            lambda: f"the footprint is larger; it is {polygons[-1:]}",
        )

    def test_transform_that_is_not_finite_is_ignored(self):
        self.send(1.0, 0.0)
        self.moving()
        for far in (math.inf, 1e300):
            stamp = rospy.Time.now() + rospy.Duration.from_sec(0.1)
            self.robot._tf.sendTransform(self.robot._transform("map", "odom", stamp, (far, 0.0, 0.0)))
            wait_for(lambda: rospy.Time.now() > stamp + rospy.Duration.from_sec(0.1), "it is past")  # noqa: B023
        self.assertEqual(self.finish(), (GoalStatus.SUCCEEDED, "Goal reached."))

    def listen_to_costmap(self):
        """Return a list that grows by the costmap after each message, whole or update, as RViz puts them together."""
        costmaps = []

        def take(update):
            if costmaps:
                grid = copy.copy(costmaps[-1])
                cells = np.array(grid.data, dtype=np.int8).reshape(grid.info.height, grid.info.width)
                area = slice(update.y, update.y + update.height), slice(update.x, update.x + update.width)
                cells[area] = np.array(update.data, dtype=np.int8).reshape(update.height, update.width)
                grid.data = cells.ravel().tolist()
                costmaps.append(grid)

        name = "move_base/local_costmap/costmap"
        for subscriber in (
            rospy.Subscriber(name, OccupancyGrid, costmaps.append),
            rospy.Subscriber(f"{name}_updates", OccupancyGridUpdate, take),
        ):
            self.addCleanup(subscriber.unregister)
        return costmaps

    @staticmethod
    def cost(costmaps, x, y):
        if not costmaps:
            return None
        grid = costmaps[-1]
        column = int((x - grid.info.origin.position.x) / grid.info.resolution)
        row = int((y - grid.info.origin.position.y) / grid.info.resolution)
        return grid.data[row * grid.info.width + column]

    def test_parameters_change_on_the_way_without_a_stop(self):
        self.addCleanup(self.set_speed, 0.75)
        self.set_speed(0.75)
        planner = Client("move_base/TrajectoryPlannerROS", timeout=DEADLINE_S)  # at hand, before it is there
        self.send(4.0, 0.0)
        wait_for(lambda: self.robot.command.linear.x > 0.6, "the robot is fast")
        before = len(self.robot.commands)
        planner.update_configuration({"max_vel_x": 0.3})
        wait_for(lambda: self.robot.command.linear.x <= 0.3, "the robot is slow")
        wait_for(lambda: len(self.robot.commands) > before + 40, "it drives on")
        speeds = [twist.linear.x for twist in self.robot.commands[before:]]
        self.assertGreater(min(speeds), 0.0)
        self.assertLessEqual(max(speeds[-10:]), 0.3)
        self.assertEqual(rospy.get_param("move_base/TrajectoryPlannerROS/max_vel_x"), 0.3)
        self.assertEqual(self.client.get_state(), GoalStatus.ACTIVE)
        self.cancel_all()

    def test_parameters_that_do_not_fit_are_refused(self):
        self.set_speed(0.05)  # less than min_vel_x
        wait_for(lambda: any("Parameters refused" in line for line in self.log), "a warning")
        self.assertNotEqual(rospy.get_param("move_base/TrajectoryPlannerROS/max_vel_x"), 0.05)

    def set_speed(self, speed):
        self.set_parameter("move_base/TrajectoryPlannerROS", "max_vel_x", speed)

    @staticmethod
    def set_parameter(server, name, value):
        """As an operator does it."""
        wait_for(
            lambda: any(topic == f"/{server}/parameter_updates" for topic, _ in rospy.get_published_topics()), server
        )
        command = ["/usr/bin/rosrun", "dynamic_reconfigure", "dynparam", "set", server, name, str(value)]
        subprocess.run(command, check=True, timeout=DEADLINE_S)

    def test_bad_parameter_ends_the_node_with_its_name(self):
        rospy.set_param("other", {**rospy.get_param("move_base"), "controller_frequency": "fast"})
        process = subprocess.run(
            [program("move_base", "move_base"), "__name:=other"],
            capture_output=True,
            text=True,
            timeout=DEADLINE_S,
            check=False,
        )
        self.assertEqual(process.returncode, 2)
        said = process.stdout + process.stderr
        self.assertIn("parameter ~controller_frequency is 'fast': it must be a finite number", said)
        self.assertNotIn("Traceback", process.stderr)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "move_base_node", MoveBaseTest)
