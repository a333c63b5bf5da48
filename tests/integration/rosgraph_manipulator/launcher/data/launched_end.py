#!/usr/bin/env python3
"""Counts its starts, and ends with the status in its argument when /launched_go is as high as that number."""

import sys
import time

import rospy

rospy.init_node("name_of_the_script")
starts = rospy.get_param("/launched_starts", 0) + 1
rospy.set_param("/launched_starts", starts)
while rospy.get_param("/launched_go", 0) < starts:
    time.sleep(0.02)
sys.exit(int(rospy.myargv()[1]))
