#!/usr/bin/env python3
"""The monitor against real nodes: each is a process of its own that this test starts and ends."""

import math
import signal
import threading
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.waiting import DEADLINE_S, wait_for
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding
from monitor_common import Diagnostics, end, start_node
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32

NODES = ("front_driver", "clean_driver", "navigation")


class MonitorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("monitor_test")
        cls.seen = Diagnostics()
        cls.nodes = {}
        for name in NODES:
            cls.start(name)
        cls.configuration = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=5, latch=True
        )
        cls.seen.wait_status("ROS Graph", "running OK", timeout=150.0)
        cls.seen.wait_status("laser_resender", "Component status", "TRUE")

    @classmethod
    def tearDownClass(cls):
        for process in cls.nodes.values():
            end(process)

    @classmethod
    def start(cls, name):
        cls.nodes[name] = start_node(name)

    def setUp(self):
        for name in NODES:  # what a test that failed left undone
            if name not in self.nodes:
                self.start(name)
        self.seen.forget()

    def end(self, name, how):
        process = self.nodes.pop(name)
        process.send_signal(how)
        return process

    def activate(self, configuration, state):
        grounding = FunctionGrounding(function="f_navigate", configuration=configuration, state=state)
        self.configuration.publish(ActiveConfiguration(functions=[grounding] if configuration else []))

    def restart_and_expect_recovery(self, name, component):
        self.seen.forget()
        self.start(name)
        self.seen.wait_status(component, "Component status", "RECOVERED")
        self.seen.wait_status(component, "Component status", "TRUE")
        self.seen.forget()
        self.seen.wait_status(component, "Component status", "TRUE")
        self.assertNotIn("RECOVERED", [s.values[0].value for s in self.seen.statuses(component, "Component status")])

    def test_killed_node_is_missing_and_its_component_false_at_once(self):
        self.end("front_driver", signal.SIGKILL).wait()
        _, status = self.seen.wait_status("laser_resender", "Component status", "FALSE")
        self.assertEqual(status.level, DiagnosticStatus.ERROR)
        _, status = self.seen.wait_status("front_driver", "Missing node")
        self.assertEqual(status.level, DiagnosticStatus.ERROR)
        self.assertIn("dead", status.values[0].value)
        self.restart_and_expect_recovery("front_driver", "laser_resender")

    def test_node_that_exits_cleanly_is_missing(self):
        self.end("clean_driver", signal.SIGINT)
        self.seen.wait(
            "clean_driver that has ended",
            lambda s: (s.name, s.message) == ("clean_driver", "Missing node") and "ended" in s.values[0].value,
        )
        self.seen.wait_status("clean_driver", "Component status", "FALSE")
        self.restart_and_expect_recovery("clean_driver", "clean_driver")

    def test_stopped_node_is_hung(self):
        process = self.nodes["clean_driver"]
        process.send_signal(signal.SIGSTOP)
        try:
            _, status = self.seen.wait_status("clean_driver", "Missing node")
            self.assertIn("hung", status.values[0].value)
        finally:
            process.send_signal(signal.SIGCONT)
        self.seen.wait_status("clean_driver", "Component status", "RECOVERED")

    def test_parameter_that_drifts_is_wrong(self):
        rospy.set_param("/navigation/planner/max_vel", 0.9)
        try:
            _, status = self.seen.wait_status("navigation", "Wrong param configuration")
            self.assertEqual((status.values[0].key, status.values[0].value), ("planner/max_vel", "0.9"))
            self.assertEqual(status.level, DiagnosticStatus.ERROR)
        finally:
            rospy.set_param("/navigation/planner/max_vel", 0.5)
        self.seen.forget()
        self.seen.wait_status("ROS Graph", "running OK")

    def test_additional_node_is_a_warning_and_ignored_ones_are_not(self):
        self.start("quiet_tool")
        rospy.wait_for_service("/quiet_tool/get_loggers", DEADLINE_S)  # seen at the latest with the other one
        self.start("stray")
        _, status = self.seen.wait_status("stray", "Additional node")
        self.assertEqual(status.level, DiagnosticStatus.WARN)
        self.assertEqual(self.seen.statuses("quiet_tool", "Additional node"), [])
        self.end("stray", signal.SIGKILL).wait()
        self.end("quiet_tool", signal.SIGKILL).wait()
        self.seen.forget()
        self.seen.wait_status("ROS Graph", "running OK")

    def test_node_under_reconfiguration_raises_no_alarm_and_the_variant_is_then_desired(self):
        self.activate("slow", FunctionGrounding.RECONFIGURING)
        wait_for(self.is_excused, "the monitor knows that navigation changes")
        self.end("navigation", signal.SIGKILL).wait()
        rospy.set_param("/navigation/planner/max_vel", 0.3)
        self.start("navigation")
        self.seen.forget()
        rospy.wait_for_service("/navigation/get_loggers", timeout=DEADLINE_S)
        self.activate("slow", FunctionGrounding.STABLE)
        self.seen.wait_status("navigation", "Component status", "TRUE")
        self.assertEqual(self.seen.statuses("navigation", "Missing node"), [])
        self.assertEqual(len({s.values[0].value for s in self.seen.statuses("navigation", "Component status")}), 1)
        rospy.set_param("/navigation/planner/max_vel", 0.5)
        self.seen.wait_status("navigation", "Wrong param configuration", "0.5")
        self.activate("usual", FunctionGrounding.STABLE)
        self.seen.forget()
        self.seen.wait_status("ROS Graph", "running OK")

    def is_excused(self):
        """Whether the monitor's next looks judge all but navigation."""
        self.seen.forget()
        self.seen.wait_status("clean_driver", "Component status")
        return not self.seen.statuses("navigation", "Component status")

    def test_variant_that_is_unknown_or_does_not_parse_keeps_the_last_good_model(self):
        for name, place in (("../evil", "configuration"), ("broken", "broken.rossystem:3")):
            self.activate(name, FunctionGrounding.STABLE)
            _, status = self.seen.wait(
                f"problem of {name}", lambda s, place=place: "desired model" in s.message and place in s.message
            )
            self.assertEqual((status.name, status.level), ("ROS Graph", DiagnosticStatus.ERROR))
        self.activate("usual", FunctionGrounding.STABLE)
        self.seen.forget()
        self.seen.wait_status("ROS Graph", "running OK")

    def test_node_that_only_a_released_function_has_is_not_missed(self):
        self.activate("usual", FunctionGrounding.STABLE)
        self.end("navigation", signal.SIGINT)
        self.seen.wait_status("navigation", "Missing node")
        self.seen.forget()
        self.activate("", "")
        self.seen.wait_status("ROS Graph", "running OK")
        self.start("navigation")
        self.activate("usual", FunctionGrounding.STABLE)
        self.seen.wait_status("navigation", "Component status", "TRUE")

    def test_safety_and_energy_from_topics(self):
        odometry = rospy.Publisher("odometry/filtered", Odometry, queue_size=1)
        laser = rospy.Publisher("front/scan", LaserScan, queue_size=1)
        load = rospy.Publisher("power_load", Float32, queue_size=1)
        distances = []
        rospy.Subscriber("d_obstacle", Float32, lambda m: distances.append(m.data))
        moving = Odometry()
        moving.twist.twist.linear.x = 0.4
        scan = LaserScan(angle_min=-math.pi / 2, angle_max=math.pi / 2, angle_increment=math.pi / 180)
        scan.range_min, scan.range_max = 0.05, 10.0
        scan.ranges = [5.0] * 181
        scan.ranges[90] = 0.25

        stop = threading.Event()

        def publish():
            while not stop.wait(0.05):
                odometry.publish(moving)
                laser.publish(scan)
                load.publish(Float32(2.6))

        thread = threading.Thread(target=publish)
        thread.start()
        try:
            self.seen.wait("safety 0.75", lambda s: value_of(s, "QA status", "safety", 0.75))
            self.seen.wait("energy 0.5", lambda s: value_of(s, "QA status", "energy", 0.5))
            wait_for(lambda: distances and math.isclose(distances[-1], 0.25), lambda: f"0.25, not {distances[-1:]}")
        finally:
            stop.set()
            thread.join()
        self.seen.forget()
        _, status = self.seen.wait(
            "stale safety", lambda s: (s.name, s.message) == ("", "QA stale") and s.values[0].key == "safety"
        )
        self.assertEqual(status.level, DiagnosticStatus.STALE)

    def test_cost_of_the_monitor_is_measured(self):
        _, status = self.seen.wait_status("rosgraph_monitor", "CPU Usage")
        self.assertGreaterEqual(float(status.values[0].value), 0.0)
        _, status = self.seen.wait_status("rosgraph_monitor", "Memory Usage")
        self.assertGreater(float(status.values[0].value), 5.0)


def value_of(status, message, key, level):
    return (
        status.message == message
        and status.values[0].key == key
        and math.isclose(float(status.values[0].value), level, abs_tol=1e-6)
    )


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor", MonitorTest)
