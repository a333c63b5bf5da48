#!/usr/bin/env python3
"""Does something once, as spawners do."""

import rospy

rospy.init_node("once")
rospy.set_param("once_done", True)
