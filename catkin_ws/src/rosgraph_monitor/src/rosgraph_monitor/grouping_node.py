"""ROS shell of the names for the aggregator: passes diagnostics on, each under a name of its own."""

from __future__ import annotations

import rospy
from diagnostic_msgs.msg import DiagnosticArray

from rosgraph_monitor.grouping import unique_name
from rosgraph_monitor.master_node import PATIENCE, MasterWatch, require_master

NAME = "diagnostic_names"


def main() -> None:
    """Run the node; exit with status 2 and one line without a master."""
    require_master(NAME)
    master = MasterWatch(NAME)
    try:
        rospy.init_node(NAME)
    except rospy.ROSException:
        if not rospy.is_shutdown():
            raise
        return  # it was ended, or lost its master, while it started
    master.patience = PATIENCE
    publisher = rospy.Publisher("diagnostics_named", DiagnosticArray, queue_size=50)

    def pass_on(msg: DiagnosticArray) -> None:
        for status in msg.status:
            status.name = unique_name(status)
        publisher.publish(msg)

    rospy.Subscriber("/diagnostics", DiagnosticArray, pass_on, queue_size=50)
    rospy.spin()
