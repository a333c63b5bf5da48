#!/usr/bin/env python3
"""A node of the assembly station: it publishes how often it has looked, so that it can be seen at work."""

import rospy
from std_msgs.msg import UInt32

rospy.init_node("part_of_station")
looks = rospy.Publisher("~looks", UInt32, queue_size=1)
count = 0
while not rospy.is_shutdown():
    count += 1
    looks.publish(count)
    rospy.sleep(0.1)
