#!/usr/bin/env python3
"""The node of the greenhouse that waters, by the means that ~means names."""

import rospy

rospy.init_node("somebody_waters")
rospy.spin()
