#!/usr/bin/env python3
"""Asks a gripper to do something for each message on `ask`, and waits for the result."""

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal
from std_msgs.msg import Empty

rospy.init_node("foreman")
client = actionlib.SimpleActionClient("arm/wait", TestAction)
client.wait_for_server()
while not client.action_client.pub_goal.impl.has_connection("/rosgraph_manipulator"):  # it may connect after the server
    rospy.sleep(0.01)
rospy.Subscriber("ask", Empty, lambda _: client.send_goal(TestGoal(0)))
rospy.spin()
