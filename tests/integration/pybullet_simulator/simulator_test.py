#!/usr/bin/env python3
"""The simulated robot as other nodes see it."""

import math
import os
import signal
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import rospy
import rostest
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Twist
from helpers.cases import case
from metacontrol_sim.srv import DeleteObstacle, IncreaseConsumptionFactor, SetLight, SpawnObstacle
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Illuminance, Imu, LaserScan, PointCloud2
from std_msgs.msg import Float32, Int32
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

TOPICS = {
    "/clock": Clock,
    "odom": Odometry,
    "odometry/filtered": Odometry,
    "imu/data": Imu,
    "battery_state": BatteryState,
    "map": OccupancyGrid,
    "amcl_pose": PoseWithCovarianceStamped,
    "/tf": TFMessage,
    "/tf_static": TFMessage,
    "front/scan": LaserScan,
    "rear/scan": LaserScan,
    "camera/depth/points": PointCloud2,
    "ground_truth/state": Odometry,
    "ground_truth/safety": Float32,
    "ground_truth/energy": Float32,
    "ground_truth/contacts": Int32,
    "ground_truth/obstacles": MarkerArray,
    "simulator/light": Float32,
    "illuminance": Illuminance,
    "power_load": Float32,
}

DEADLINE_S = 150


class Latest:
    """Keeps the latest message of a topic and counts them."""

    def __init__(self, topic, kind):
        self._condition = threading.Condition()
        self.count = 0
        self.message = None
        self._subscriber = rospy.Subscriber(topic, kind, self._on_message)

    def _on_message(self, message):
        with self._condition:
            self.message = message
            self.count += 1
            self._condition.notify_all()

    def wait(self, accept=lambda _message: True, timeout=DEADLINE_S, or_latest=False):
        """Returns the next message that is accepted, or the latest, or None at the deadline (wall time)."""
        deadline = time.monotonic() + timeout
        with self._condition:
            is_new = or_latest and self.message is not None
            while not (is_new and accept(self.message)):
                is_new = self._condition.wait(max(deadline - time.monotonic(), 0.0))
                if not is_new:
                    return None
            return self.message

    def close(self):
        self._subscriber.unregister()


class SimulatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("simulator_test")
        cls.command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        cls.state = Latest("ground_truth/state", Odometry)
        assert cls.state.wait() is not None, "the simulator publishes nothing"

    def drive(self, forward, accept):
        """Sends a command at 20 Hz until the state is accepted, or the deadline has come."""
        twist = Twist()
        twist.linear.x = forward
        deadline = time.monotonic() + DEADLINE_S
        while time.monotonic() < deadline:
            self.command.publish(twist)
            if self.state.wait(accept, 0.05):
                return self.state.message
        return None

    def test_every_topic_speaks(self):
        latest = {topic: Latest(topic, kind) for topic, kind in TOPICS.items()}
        for topic, heard in latest.items():
            with case(topic=topic):
                self.assertIsNotNone(heard.wait(or_latest=True))
        scan, grid, cloud = (latest[topic].message for topic in ("front/scan", "map", "camera/depth/points"))
        self.assertEqual(scan.header.frame_id, "front_laser")
        self.assertGreaterEqual(len(scan.ranges), 360)
        self.assertEqual((grid.info.width, grid.info.height), (420, 420))
        self.assertEqual(cloud.header.frame_id, "camera_link")
        self.assertGreater(cloud.width, 1000)
        frames = {transform.child_frame_id for transform in latest["/tf_static"].message.transforms}
        self.assertLessEqual({"front_laser", "rear_laser", "camera_link", "imu_link"}, frames)
        for heard in latest.values():
            heard.close()

    def call(self, service, kind, *arguments, **fields):
        rospy.wait_for_service(service, DEADLINE_S)
        return rospy.ServiceProxy(service, kind)(*arguments, **fields)

    def test_spawned_obstacle_stands_in_the_scan_but_not_on_the_map_until_deleted(self):
        pose = self.state.message.pose.pose
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        place = {"x": pose.position.x + 2.0 * math.cos(yaw), "y": pose.position.y + 2.0 * math.sin(yaw)}
        scan, shown = Latest("front/scan", LaserScan), Latest("ground_truth/obstacles", MarkerArray)
        spawned = self.call("simulator/spawn_obstacle", SpawnObstacle, name="crate", yaw=yaw, **place)
        self.assertTrue(spawned.success, spawned.message)
        expected = 2.0 - 0.15 - 0.393
        self.assertIsNotNone(scan.wait(lambda s: abs(s.ranges[180] - expected) < 0.1), "not seen")
        self.assertIsNotNone(shown.wait(lambda m: "crate" in {marker.ns for marker in m.markers}, or_latest=True))
        again = self.call("simulator/spawn_obstacle", SpawnObstacle, name="crate", **place)
        self.assertFalse(again.success)
        self.assertIn("the name is taken", again.message)
        self.assertTrue(self.call("simulator/delete_obstacle", DeleteObstacle, "crate").success)
        self.assertIsNotNone(scan.wait(lambda s: abs(s.ranges[180] - expected) > 0.5), "still there")
        self.assertIn("no obstacle 'crate'", self.call("simulator/delete_obstacle", DeleteObstacle, "crate").message)
        for heard in (scan, shown):
            heard.close()

    def test_spawned_person_walks(self):
        way = [Point(-8.0, 8.0, 0.0), Point(-5.5, 8.0, 0.0)]
        spawned = self.call("simulator/spawn_obstacle", SpawnObstacle, name="ann", waypoints=way, speed=2.0)
        self.assertTrue(spawned.success, spawned.message)
        shown = Latest("ground_truth/obstacles", MarkerArray)
        walked = shown.wait(lambda m: any(k.ns == "ann" and k.pose.position.x > -7.0 for k in m.markers))
        self.assertIsNotNone(walked, "she stands")
        self.assertTrue(self.call("simulator/delete_obstacle", DeleteObstacle, "").success)
        shown.close()

    def test_camera_goes_blind_in_the_dark_which_the_light_sensor_tells(self):
        cloud = Latest("camera/depth/points", PointCloud2)
        sensor = Latest("illuminance", Illuminance)
        self.assertIsNotNone(sensor.wait(lambda m: 270.0 < m.illuminance < 330.0 and m.header.stamp.to_sec() > 0.0))
        self.assertIsNotNone(cloud.wait(lambda c: c.width > 1000))
        self.assertTrue(self.call("simulator/set_light", SetLight, 0.0).success)
        self.assertIsNotNone(cloud.wait(lambda c: c.width == 0), "it sees in the dark")
        self.assertIsNotNone(sensor.wait(lambda m: m.illuminance == 0.0), "the sensor tells light in the dark")
        self.assertFalse(self.call("simulator/set_light", SetLight, math.nan).success)
        self.assertTrue(self.call("simulator/set_light", SetLight, 1.0).success)
        self.assertIsNotNone(cloud.wait(lambda c: c.width > 1000), "it stays blind")
        cloud.close()
        sensor.close()

    def test_command_moves_the_robot_and_its_end_stops_it(self):
        start = self.state.message.pose.pose.position
        moved = self.drive(
            0.4, lambda s: math.dist((s.pose.pose.position.x, s.pose.pose.position.y), (start.x, start.y)) > 0.3
        )
        self.assertIsNotNone(moved, "the robot does not move")
        stopped = self.state.wait(lambda s: abs(s.twist.twist.linear.x) < 1e-3)
        self.assertIsNotNone(stopped, "the robot does not stop")

    def test_command_that_is_not_a_number_is_ignored(self):
        twist = Twist()
        twist.linear.x = math.nan
        self.command.publish(twist)
        moved = self.drive(0.3, lambda s: s.twist.twist.linear.x > 0.2)
        self.assertIsNotNone(moved, "the simulator died of it, or has taken it")

    def test_power_factor_raises_the_load_and_bad_ones_are_refused(self):
        rospy.wait_for_service("increase_power_consumption", DEADLINE_S)
        increase = rospy.ServiceProxy("increase_power_consumption", IncreaseConsumptionFactor)
        self.assertFalse(increase(-1.0).success)
        self.assertFalse(increase(math.nan).success)
        self.assertTrue(increase(1.6).success)
        factor = Latest("power_consumption_factor", Float32)
        self.assertIsNotNone(factor.wait(lambda m: abs(m.data - 1.6) < 1e-5, or_latest=True))
        self.assertTrue(increase(1.0).success)

    def test_zz_killed_laser_falls_silent_and_the_simulator_runs_on(self):
        scan = Latest("front/scan", LaserScan)
        self.assertIsNotNone(scan.wait())
        uri = rosgraph.Master("/simulator_test").lookupNode("/front_laser")
        _, _, pid = xmlrpc.client.ServerProxy(uri).getPid("/simulator_test")
        os.kill(pid, signal.SIGKILL)
        deadline = time.monotonic() + DEADLINE_S
        heard = -1
        while scan.count != heard and time.monotonic() < deadline:  # what was under way may still arrive
            heard = scan.count
            begin = self.state.wait().header.stamp
            later = self.state.wait(lambda s, begin=begin: (s.header.stamp - begin).to_sec() > 1.0)
            self.assertIsNotNone(later, "the simulator stopped too")
        self.assertEqual(scan.count, heard, "it goes on")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "simulator_test", SimulatorTest)
