"""A module of a node's own, which fixes at its import what it finds then."""

import os
import sys

import rospy

AT_IMPORT = {
    "arguments": sys.argv[1:],
    "folder": os.getcwd(),
    "namespace": rospy.get_namespace(),
    "shared": rospy.get_param("/launched_shared", None),
}
