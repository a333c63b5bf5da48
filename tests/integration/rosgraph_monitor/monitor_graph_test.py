#!/usr/bin/env python3
"""The monitor's findings on interfaces and topics, with real nodes whose interfaces are not those of the model."""

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from monitor_common import GraphTest, value_of
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

AS_MODELLED = {
    "/laser": ("pub=scan:sensor_msgs/LaserScan@20",),
    "/nav": ("pub=cmd:std_msgs/Int32@10", "sub=scan:sensor_msgs/LaserScan", "srv=clear"),
    "/base": ("sub=cmd:std_msgs/Int32",),
}


class MonitorGraphTest(GraphTest):
    NODES = AS_MODELLED

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.modes = {name: rospy.Publisher(f"{name}/mode", String, queue_size=1, latch=True) for name in AS_MODELLED}
        _, status = cls.seen.wait_status("laser", "Missing node")
        assert value_of(status, "actual") == "absent", status  # it never came
        cls.start_all()

    def setUp(self):
        for mode in self.modes.values():
            mode.publish("")
        super().setUp()

    def test_port_that_a_node_lacks_and_its_connection(self):
        self.start("/laser", "pub=front_scan:sensor_msgs/LaserScan@20")
        _, status = self.seen.wait_status("laser", "Missing port")
        self.assertEqual([v.value for v in status.values], ["scan", "publisher", "none"])
        _, status = self.seen.wait_status("scan", "Missing connection")
        self.assertEqual(value_of(status, "expected"), "laser.scan -> nav.scan")
        _, status = self.seen.wait_status("laser", "Additional port", "front_scan")
        self.assertEqual(value_of(status, "actual"), "publisher")
        self.restore("/laser")

    def test_service_that_a_node_lacks(self):
        self.start("/nav", *AS_MODELLED["/nav"][:2])
        self.seen.wait_status("nav", "Missing port", "clear")
        self.restore("/nav")

    def test_ends_of_a_connection_on_different_topics(self):
        self.start("/base", "sub=cmd_vel:std_msgs/Int32")
        _, status = self.seen.wait_status("cmd", "Missing connection")
        self.assertIn("base.cmd takes nothing", value_of(status, "actual"))
        _, status = self.seen.wait_status("base", "Missing port", "cmd")
        self.assertEqual(value_of(status, "expected"), "subscriber")
        self.restore("/base")

    def test_topic_of_another_type(self):
        self.start("/laser", "pub=scan:std_msgs/String@20")
        _, status = self.seen.wait_status("laser", "Wrong type")
        self.assertEqual(value_of(status, "expected"), "sensor_msgs/LaserScan")
        self.assertEqual(value_of(status, "actual"), "std_msgs/String")
        self.restore("/laser")

    def test_silent_topic_fails_its_component_though_the_node_lives(self):
        self.modes["/laser"].publish("quiet")
        _, status = self.seen.wait_status("scan", "Silent topic")
        self.assertEqual(value_of(status, "expected"), "max_age 2")
        self.seen.wait_status("laser", "Component status", "FALSE")
        self.assertEqual(self.seen.statuses("laser", "Missing node"), [])
        self.seen.forget()
        self.modes["/laser"].publish("")
        self.seen.wait_status("laser", "Component status", "RECOVERED")

    def test_limit_that_the_model_gives(self):
        self.modes["/nav"].publish("quiet")
        self.seen.wait_status("cmd", "Silent topic")
        self.seen.wait_status("nav", "Component status", "FALSE")
        self.seen.forget()
        self.modes["/nav"].publish("")
        self.seen.wait_status("nav", "Component status", "RECOVERED")

    def test_stuck_sensor(self):
        self.modes["/laser"].publish("stuck")
        _, status = self.seen.wait_status("scan", "Stuck topic")
        self.assertEqual(value_of(status, "expected"), "stuck_after 40")
        self.seen.wait_status("laser", "Component status", "FALSE")
        self.seen.forget()
        self.modes["/laser"].publish("")
        self.seen.wait_status("laser", "Component status", "RECOVERED")

    def test_slow_topic(self):
        self.start("/laser", "pub=scan:sensor_msgs/LaserScan@1")
        _, status = self.seen.wait_status("scan", "Slow topic")
        self.assertLessEqual(float(value_of(status, "actual")), 5.0)  # it is rounded
        self.restore("/laser")

    def test_battery_below_its_limit(self):
        battery = rospy.Publisher("battery_state", BatteryState, queue_size=1, latch=True)
        battery.publish(BatteryState(percentage=0.9))
        self.seen.wait_status("battery", "Component status", "TRUE")
        battery.publish(BatteryState(percentage=0.1))
        self.seen.wait_status("battery", "Component status", "FALSE")
        self.seen.forget()
        battery.publish(BatteryState(percentage=float("nan"), charge=float("nan")))
        battery.publish(BatteryState(percentage=0.4))
        self.seen.wait_status("battery", "Component status", "RECOVERED")
        battery.unregister()

    def test_driver_that_says_that_it_does_not_work(self):
        diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1, latch=True)

        def say(level, name="hand_driver: fingers"):
            diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(level=level, name=name)]))

        say(DiagnosticStatus.OK)
        self.seen.wait_status("gripper", "Component status", "TRUE")
        say(DiagnosticStatus.ERROR)
        self.seen.wait_status("gripper", "Component status", "FALSE")
        self.seen.forget()
        say(DiagnosticStatus.OK, "hand_driver_2: fingers")
        self.seen.wait_status("gripper", "Component status", "FALSE")
        say(DiagnosticStatus.OK)
        self.seen.wait_status("gripper", "Component status", "RECOVERED")
        diagnostics.unregister()


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_graph", MonitorGraphTest)
