#!/usr/bin/env python3
"""Names in the graph of a move_base that is configured unlike D2, beside those that ROS Navigation 1.17.3 has."""

import contextlib
import math
import unittest

import rosgraph
import rospy
import rostest
import tf2_ros
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import Point32, Polygon, PolygonStamped, TransformStamped
from helpers.waiting import DEADLINE_S, wait_for

NODE = "/yard/pilot"

ACTION = {f"/yard/move_base/{name}" for name in ("goal", "cancel", "status", "feedback", "result")}
COSTMAPS = ("global_costmap", "local_costmap")
SERVERS = {"": "", "DWAPlannerROS/": "", "global_costmap/": "", "local_costmap/": ""} | {
    f"{costmap}/{layer}/": "" for costmap in COSTMAPS for layer in ("obstacle_layer", "inflation_layer")
}
SERVERS["global_costmap/static_layer/"] = ""

PUBLISHED = {
    "/yard/cmd_vel",
    "/yard/move_base/goal",
    "/yard/move_base/recovery_status",
    *(ACTION - {"/yard/move_base/goal", "/yard/move_base/cancel"}),
    f"{NODE}/current_goal",
    f"{NODE}/GlobalPlanner/plan",
    f"{NODE}/DWAPlannerROS/global_plan",
    f"{NODE}/DWAPlannerROS/local_plan",
    *(f"{NODE}/{costmap}/{topic}" for costmap in COSTMAPS for topic in ("costmap", "costmap_updates", "footprint")),
    *(f"{NODE}/{server}parameter_{what}" for server in SERVERS for what in ("descriptions", "updates")),
    "/rosout",
}
LACKING = {
    f"{NODE}/GlobalPlanner/potential",
    f"{NODE}/DWAPlannerROS/cost_cloud",
    f"{NODE}/DWAPlannerROS/trajectory_cloud",
    f"{NODE}/local_costmap/obstacle_layer/clearing_endpoints",
}
"""What the original publishes besides; the README lists them."""

SUBSCRIBED = {
    "/yard/move_base/goal",
    "/yard/move_base/cancel",
    "/yard/move_base_simple/goal",
    "/yard/wheels/odometry",
    "/yard/plan_of_the_yard",
    "/yard/sweep",
    "/yard/bumps",
    f"{NODE}/local_costmap/load",
    "/tf",
    "/tf_static",
}
SERVICES = {
    f"{NODE}/make_plan",
    f"{NODE}/clear_costmaps",
    f"{NODE}/GlobalPlanner/make_plan",
    *(f"{NODE}/{server}set_parameters" for server in SERVERS),
}


class InterfacesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("interfaces_test")
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        frames = []
        for parent, child in (("map", "wheels"), ("wheels", "cart")):
            frame = TransformStamped(child_frame_id=child)
            frame.header.frame_id, frame.transform.rotation.w = parent, 1.0
            frames.append(frame)
        cls.broadcaster.sendTransform(frames)
        wait_for(lambda: cls.names(2) >= SERVICES, lambda: f"all services; there are {cls.names(2)}")

    @staticmethod
    def names(kind):
        """Names in the graph that the node publishes (0), listens to (1) or serves (2)."""
        with contextlib.suppress(OSError):
            return {name for name, nodes in rosgraph.Master("/test").getSystemState()[kind] if NODE in nodes}
        return set()

    def test_publishes_what_the_original_publishes(self):
        wait_for(lambda: self.names(0) == PUBLISHED, lambda: f"publishers {self.names(0) ^ PUBLISHED}")
        self.assertFalse(self.names(0) & LACKING)

    def test_listens_to_what_the_original_listens_to(self):
        wait_for(lambda: self.names(1) == SUBSCRIBED, lambda: f"subscribers {self.names(1) ^ SUBSCRIBED}")

    def test_serves_what_the_original_serves(self):
        def ours():
            return {name for name in self.names(2) if not name.endswith(("get_loggers", "set_logger_level"))}

        wait_for(lambda: ours() == SERVICES, lambda: f"services {ours() ^ SERVICES}")

    def test_radius_from_the_level_above_is_the_footprint_until_another_one_comes(self):
        polygons = []
        rospy.Subscriber(f"{NODE}/local_costmap/footprint", PolygonStamped, polygons.append)

        def width():
            return max(point.x for point in polygons[-1].polygon.points) if polygons else 0.0

        wait_for(lambda: math.isclose(width(), 0.22, abs_tol=1e-6), "the radius and the padding")
        publisher = rospy.Publisher(f"{NODE}/local_costmap/load", Polygon, queue_size=1, latch=True)
        publisher.publish([Point32(x, y, 0.0) for x, y in ((0.5, 0.3), (0.5, -0.3), (-0.5, -0.3), (-0.5, 0.3))])
        wait_for(lambda: math.isclose(width(), 0.51, abs_tol=1e-6), "the footprint that has come")

    def test_defaults_can_be_restored(self):
        client = Client(f"{NODE}/DWAPlannerROS", timeout=DEADLINE_S)
        self.assertEqual(client.update_configuration({"max_vel_x": 0.1})["max_vel_x"], 0.1)
        restored = client.update_configuration({"restore_defaults": True})
        self.assertEqual((restored["max_vel_x"], restored["restore_defaults"]), (0.22, False))


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "move_base_interfaces", InterfacesTest)
