#!/usr/bin/env python3
"""Tells how it was started, on the parameter server and on its streams, and offers things that can be remapped."""

import json
import os
import sys
import threading

import rospy
from launched_module import AT_IMPORT
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse

BEFORE = sorted(thread.name for thread in threading.enumerate())

rospy.init_node("name_of_the_script")
record = {
    "name": rospy.get_name(),
    "namespace": rospy.get_namespace(),
    "arguments": rospy.myargv()[1:],
    "remappings": rospy.names.get_resolved_mappings(),
    "parameters": rospy.get_param("~", {}),
    "at_import": AT_IMPORT,
    "threads": BEFORE,
    "terminal": [stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr)],
    "main": [sys.modules["__main__"].__file__, str(sys.modules["__main__"].__spec__)],
    "variables": dict(os.environ),
}
publisher = rospy.Publisher("out", String, queue_size=1, latch=True)
private = rospy.Publisher("~out", String, queue_size=1, latch=True)
subscriber = rospy.Subscriber("in", String, publisher.publish)
service = rospy.Service("call", Empty, lambda _: EmptyResponse())
private_service = rospy.Service("~call", Empty, lambda _: EmptyResponse())
sys.stdout.write(f"{rospy.get_name()} says {AT_IMPORT['shared']}\n")
sys.stdout.flush()
sys.stderr.write(f"{rospy.get_name()} warns\n")
sys.stderr.flush()
rospy.set_param(f"/launched_records{rospy.get_name()}", json.dumps(record))
rospy.spin()
