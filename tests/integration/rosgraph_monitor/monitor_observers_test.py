#!/usr/bin/env python3
"""Observers as plug-ins in a running monitor: those that come with it, and such as fail in every way."""

import unittest

import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from helpers.waiting import wait_for
from metacontrol_msgs.srv import ListObservers, LoadObserver, UnloadObserver
from monitor_common import Diagnostics
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool, Float32
from std_srvs.srv import Trigger, TriggerResponse

SHIPPED = {"ObjectiveErrorObserver", "LocalizationQualityObserver", "CpuLoadQualityObserver"}


class MonitorObserversTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("monitor_observers_test")
        cls.seen = Diagnostics()
        for service in ("load_observer", "unload_observer", "active_observers", "list_observers"):
            rospy.wait_for_service(service, timeout=150.0)
        cls.load = rospy.ServiceProxy("load_observer", LoadObserver)
        cls.unload = rospy.ServiceProxy("unload_observer", UnloadObserver)
        cls.active = rospy.ServiceProxy("active_observers", ListObservers)
        cls.available = rospy.ServiceProxy("list_observers", ListObservers)
        cls.topic = rospy.Publisher("failing/input", Float32, queue_size=1)
        cls.timer = rospy.Timer(rospy.Duration(0.1), lambda _: cls.topic.publish(Float32(0.5)))

    def setUp(self):
        self.seen.forget()

    def loaded(self, name):
        self.assertTrue(self.load(f"monitor_observers:{name}").ok)
        self.addCleanup(self.unload, f"monitor_observers:{name}")

    def wait_qa(self, observer, text="", timeout=150.0):
        _, status = self.seen.wait(
            f"{text or 'level'} of {observer}",
            lambda s: s.hardware_id == observer and (text in s.values[0].value if text else s.message == "QA status"),
            timeout,
        )
        return status

    def test_observers_are_listed_loaded_and_unloaded(self):
        self.seen.wait("load observers", lambda s: s.hardware_id == "CpuLoadQualityObserver")
        self.assertLessEqual(SHIPPED | {"SafetyQualityObserver"}, set(self.available().types))
        self.assertLessEqual(SHIPPED, set(self.active().types))
        name = "monitor_observers:HealthyObserver"
        self.assertTrue(self.load(name).ok)
        self.assertFalse(self.load(name).ok)
        self.wait_qa("HealthyObserver")
        self.assertTrue(self.unload(name).ok)
        self.assertFalse(self.unload(name).ok)
        self.assertNotIn(name, self.active().types)
        self.assertFalse(self.load("NoSuchObserver").ok)

    def test_observer_that_cannot_be_made_or_imported_is_refused(self):
        self.assertFalse(self.load("monitor_observers:BrokenObserver").ok)
        self.assertFalse(self.load("monitor_broken_import:Observer").ok)

    def test_observers_that_raise_quit_or_hang_stop_no_other(self):
        log = []
        rosout = rospy.Subscriber("/rosout", Log, lambda msg: log.append(msg.msg))
        self.addCleanup(rosout.unregister)
        for name in ("FailingObserver", "QuittingObserver", "HangingObserver", "HealthyObserver"):
            self.loaded(name)
        self.wait_qa("FailingObserver", "ValueError: no sense in 0.5")
        self.wait_qa("QuittingObserver", "SystemExit")
        status = self.wait_qa("HangingObserver", "observer hangs")
        self.assertEqual(status.message, "QA stale")
        for name in ("FailingObserver", "QuittingObserver"):  # which have failed dozens of times by now
            self.assertLessEqual(sum(f"{name} fails" in line for line in log), 5, log)
        self.seen.forget()
        self.assertEqual(float(self.wait_qa("HealthyObserver").values[0].value), 0.5)
        self.assertTrue(self.unload("monitor_observers:HangingObserver").ok)
        self.assertNotIn("monitor_observers:HangingObserver", self.active().types)

    def test_published_observer_of_a_service_is_stale_until_there_is_one(self):
        self.loaded("ServedQualityObserver")
        self.assertEqual(self.wait_qa("ServedQualityObserver", "unavailable").message, "QA stale")
        service = rospy.Service("served_level", Trigger, lambda _: TriggerResponse(True, "0.75"))
        self.assertEqual(self.wait_qa("ServedQualityObserver").values[0].value, "0.75")
        service.shutdown()

    def test_published_observer_that_does_without_the_time(self):
        self.loaded("TimelessObserver")
        self.assertEqual(self.wait_qa("TimelessObserver").values[0].value, "0.25")

    def test_aborted_goal_is_told_on_obj_error(self):
        heard = []
        error = rospy.Subscriber("/obj_error", Bool, lambda msg: heard.append(msg.data))
        wait_for(error.get_num_connections, "the monitor is heard")
        status = rospy.Publisher("move_base/status", GoalStatusArray, queue_size=10)
        state = [GoalStatus.ACTIVE]

        def publish(_):
            goal = GoalID(rospy.Time(1), "goal")
            status.publish(GoalStatusArray(status_list=[GoalStatus(goal, state[0], "no way")]))

        timer = rospy.Timer(rospy.Duration(0.1), publish)
        self.addCleanup(timer.shutdown)
        self.seen.wait("goal that fares well", lambda s: (s.name, s.message) == ("move_base", "no objective error"))
        state[0] = GoalStatus.ABORTED
        self.seen.wait("objective error", lambda s: (s.name, s.message) == ("move_base", "Objective error"))
        wait_for(lambda: True in heard, lambda: f"an error on obj_error, not only {heard}")

    def test_new_quality_attributes_need_nothing_but_an_observer(self):
        self.assertLessEqual(float(self.wait_qa("CpuLoadQualityObserver").values[0].value), 1.0)
        pose = rospy.Publisher("amcl_pose", PoseWithCovarianceStamped, queue_size=1, latch=True)
        msg = PoseWithCovarianceStamped()
        covariance = [0.0] * 36
        covariance[0] = covariance[7] = 0.0625
        msg.pose.covariance = covariance
        pose.publish(msg)
        status = self.wait_qa("LocalizationQualityObserver")
        self.assertEqual((status.values[0].key, float(status.values[0].value)), ("localization", 0.5))


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_observers", MonitorObserversTest)
