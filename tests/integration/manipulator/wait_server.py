#!/usr/bin/env python3
"""An unmodified actionlib server: a goal of 0 is pending until cancelled, any other succeeds at once."""

import sys

import actionlib
import rospy
from actionlib.msg import TestAction, TestResult

if "--exit-at-once" in sys.argv:
    sys.exit(1)

rospy.init_node("wait_server")


def accept(handle):
    handle.set_accepted()
    if handle.get_goal().goal:
        handle.set_succeeded(TestResult(handle.get_goal().goal))


server = actionlib.ActionServer("wait", TestAction, accept, lambda handle: handle.set_canceled(), auto_start=False)
server.start()
rospy.spin()
