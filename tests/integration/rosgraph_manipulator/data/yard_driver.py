#!/usr/bin/env python3
"""The driver of a scanner: publishes what its parameter says.

With --broken it ends at once, as without its device; with --mute it waits for that for ever.
"""

import signal
import sys

import rospy
from std_msgs.msg import String

if "--broken" in sys.argv:
    sys.exit(3)
while "--mute" in sys.argv:
    signal.pause()
rospy.init_node("yard_driver")
publisher = rospy.Publisher("scan", String, queue_size=1, latch=True)
publisher.publish(str(rospy.get_param("~port", "none")))
rospy.spin()
