#!/usr/bin/env python3
"""Contingencies happen at their moments, on demand, and never where they make no sense."""

import math
import threading
import time
import unittest

import psutil
import rospy
import rostest
from helpers.cases import case
from metacontrol_msgs.msg import MissionEvent
from metacontrol_sim.srv import Contingency
from move_base_msgs.msg import MoveBaseActionGoal
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32
from visualization_msgs.msg import MarkerArray

DEADLINE_S = 150


class Heard:
    """Keeps every message of a topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self._condition = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, kind, self._on_message)

    def is_connected(self):
        return self._subscriber.get_num_connections() > 0

    def _on_message(self, message):
        with self._condition:
            self.messages.append(message)
            self._condition.notify_all()

    def wait(self, accept, since=0):
        """Returns the first message from number `since` on that is accepted, None at the deadline."""
        end = time.monotonic() + DEADLINE_S
        with self._condition:
            while True:
                for message in self.messages[since:]:
                    if accept(message):
                        return message
                left = end - time.monotonic()
                if left <= 0.0 or not self._condition.wait(left):
                    return None


def becomes(condition):
    """Tell whether a condition comes to hold before the deadline."""
    end = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def is_dead(pid):
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


class ContingenciesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("simulator_contingencies_test")
        cls.obstacles = Heard("ground_truth/obstacles", MarkerArray)
        cls.events = Heard("mission/event", MissionEvent)
        cls.rear = Heard("rear/scan", LaserScan)
        cls.light = Heard("simulator/light", Float32)
        rospy.wait_for_service("contingency/strike", DEADLINE_S)
        assert becomes(cls.events.is_connected), "nobody tells events"
        cls.strike = rospy.ServiceProxy("contingency/strike", Contingency)

    def test_1_clutter_lies_there_from_the_start(self):
        self.assertIsNotNone(
            self.obstacles.wait(lambda m: sum(k.type == k.CUBE and k.action == 0 for k in m.markers) == 3)
        )

    def test_2_frozen_driver_is_silent_until_thawed(self):
        self.assertIsNotNone(self.rear.wait(lambda _scan: True))
        done = self.strike(kind="freeze", target="/rear_laser")
        self.assertTrue(done.success, done.message)
        event = self.events.wait(lambda e: e.name == "component:/rear_laser")
        pid = int({pair.key: pair.value for pair in event.values}["pid"])
        self.assertTrue(becomes(lambda: psutil.Process(pid).status() == psutil.STATUS_STOPPED))
        count = len(self.rear.messages)
        self.assertTrue(self.strike(kind="thaw", target="/rear_laser").success)
        self.assertIsNotNone(self.rear.wait(lambda _scan: True, since=count))

    def test_2_spoilt_driver_repeats_itself_or_jumps_until_thawed(self):
        stamps = lambda count: [m.header.stamp for m in self.rear.messages[-count:]]  # noqa: E731
        self.assertTrue(self.strike(kind="repeat", target="/rear_laser").success)
        self.assertTrue(becomes(lambda: len(set(stamps(4))) == 1))
        self.assertTrue(self.strike(kind="jump", target="/rear_laser").success)
        self.assertTrue(becomes(lambda: any(b < a for a, b in zip(stamps(3), stamps(3)[1:], strict=False))))
        self.assertTrue(self.strike(kind="thaw", target="/rear_laser").success)
        self.assertTrue(becomes(lambda: stamps(4) == sorted(set(stamps(4)))))
        refused = self.strike(kind="jump", target="/simulator")
        self.assertFalse(refused.success)
        self.assertIn("not a driver", refused.message)

    def test_3_what_makes_no_sense_is_refused_with_a_reason(self):
        for request, reason in (
            ({"kind": "explode", "target": "camera"}, "no kind"),
            ({"kind": "kill", "target": "warp_drive"}, "no component"),
            ({"kind": "kill", "target": "/nobody"}, "nobody"),
            ({"kind": "power", "value": math.nan}, "finite"),
            ({"kind": "power", "value": -1.0}, "0 or more"),
            ({"kind": "light", "value": 3.0}, "from 0"),
            ({"kind": "clutter", "value": 1e6}, "whole number"),
        ):
            with case(request=request):
                answer = self.strike(**request)
                self.assertFalse(answer.success)
                self.assertIn(reason, answer.message)

    def test_4_timeline_begins_with_the_goal(self):
        self.assertIsNone(next((e for e in self.events.messages if e.name == "component:front_laser"), None))
        goals = rospy.Publisher("move_base/goal", MoveBaseActionGoal, queue_size=1, latch=True)
        goal = MoveBaseActionGoal()
        goal.goal.target_pose.pose.position.x = 5.0
        goals.publish(goal)
        struck = self.events.wait(lambda e: e.name == "component:front_laser")
        self.assertIsNotNone(struck)
        self.assertEqual(struck.kind, MissionEvent.PERTURBATION)
        pid = int({pair.key: pair.value for pair in struck.values}["pid"])
        self.assertTrue(becomes(lambda: is_dead(pid)))
        self.assertIsNotNone(self.light.wait(lambda _light: True))
        self.assertEqual([message.data for message in self.light.messages], [1.0])  # the robot has not moved

    def test_5_light_and_power_change_on_demand(self):
        factor = Heard("power_consumption_factor", Float32)
        self.assertTrue(self.strike(kind="power", value=1.5).success)
        self.assertIsNotNone(factor.wait(lambda m: abs(m.data - 1.5) < 1e-6))
        self.assertTrue(self.strike(kind="light", value=0.25).success)
        self.assertIsNotNone(self.light.wait(lambda m: abs(m.data - 0.25) < 1e-6))

    def test_6_unplugged_device_is_missing_at_the_next_start_of_its_driver(self):
        self.assertTrue(self.strike(kind="unplug", target="camera").success)
        struck = self.events.wait(lambda e: e.name == "component:camera")
        pid = int({pair.key: pair.value for pair in struck.values}["pid"])
        self.assertTrue(becomes(lambda: is_dead(pid)))
        self.assertIs(rospy.get_param("/camera/unplugged"), True)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "simulator_contingencies_test", ContingenciesTest)
