#!/usr/bin/env python3
"""A driver of the greenhouse: it publishes until it jams, and a reset frees it as often as ~resets says."""

import rospy
from std_msgs.msg import UInt32
from std_srvs.srv import Empty, EmptyResponse, Trigger, TriggerResponse


class Driver:
    """Counts what it does while it is not jammed."""

    def __init__(self):
        self.is_jammed, self.count = False, 0
        self.level = rospy.Publisher("~level", UInt32, queue_size=1)
        rospy.Service("~jam", Empty, lambda _: self.jam(True))
        rospy.Service("~free", Empty, lambda _: self.jam(False))
        rospy.Service("~reset", Trigger, self.reset)

    def jam(self, is_jammed):
        self.is_jammed = is_jammed
        return EmptyResponse()

    def reset(self, _):
        left = rospy.get_param("~resets", 1)
        if left < 1:
            return TriggerResponse(False, "it is stuck fast")
        rospy.set_param("~resets", left - 1)
        self.is_jammed = False
        return TriggerResponse(True, "")

    def run(self):
        while not rospy.is_shutdown():
            if not self.is_jammed:
                self.count += 1
                self.level.publish(self.count)
            rospy.sleep(0.1)


rospy.init_node("driver_of_greenhouse")
Driver().run()
