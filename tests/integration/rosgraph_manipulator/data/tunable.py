#!/usr/bin/env python3
"""A node that takes its parameters by dynamic_reconfigure; its definition stands for any other."""

import rospy
from dynamic_reconfigure.server import Server
from move_base.cfg import MoveBaseConfig

rospy.init_node("tunable")
server = Server(MoveBaseConfig, lambda config, _level: config)
rospy.spin()
